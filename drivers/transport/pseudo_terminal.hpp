// The far end of a serial line that exists in this machine alone: what an emulated device speaks on.
#pragma once

#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "drivers/transport/byte_stream.hpp"

namespace perimap {

// A stream to whoever opens `path()` as a serial port. Destroying it unplugs the device: the other side's reads fail.
class PseudoTerminal final : public ByteStream {
 public:
  // `link`: a name for the port that stays the same when it is opened again; a link there is replaced, anything else is
  // an error. Empty: none.
  [[nodiscard]] static Expected<std::unique_ptr<PseudoTerminal>> open(const std::string& link);

  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  ~PseudoTerminal() override;

  [[nodiscard]] const std::string& path() const noexcept { return link_.empty() ? device_ : link_; }

  // Nobody having the port open is no error: what is written then is thrown away, as on a real line.
  Expected<std::size_t> read(std::span<std::byte> buffer) override;
  Expected<std::size_t> write(std::span<const std::byte> bytes) override;
  int descriptor() const noexcept override { return master_.get(); }
  // The rate that the other side has set, baud; 0 when it cannot be told.
  [[nodiscard]] int line_rate() const noexcept;
  // What a byte would take at that rate; a pseudo-terminal itself takes no time.
  double byte_time_ns() const noexcept override;

 private:
  PseudoTerminal(Descriptor master, Descriptor slave, std::string device, std::string link)
      : master_(std::move(master)), slave_(std::move(slave)), device_(std::move(device)), link_(std::move(link)) {}

  Descriptor master_;
  Descriptor slave_;  // kept open, so that a peer may come and go without hanging the master up
  std::string device_;
  std::string link_;
};

}  // namespace perimap

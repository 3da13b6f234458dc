// An emulated NDI tracker: the far end of drivers/tracker/ndi_session.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "drivers/device/device_protocol.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/standins/emulator/pose_track.hpp"

namespace perimap {

struct NdiEmulatorSettings {
  enum class Newest : std::uint8_t { kBx2, kBx, kTx };  // the newest way of asking for poses that it knows

  Newest newest = Newest::kBx2;
  int wired_tools = 0;                           // in its ports from the start, port handles 0A, 0B ...
  std::optional<Pose> reference = std::nullopt;  // where the second tool is, constant; the first follows the track
  bool second_channel = false;                   // of the first wired tool: shows when that has been initialised
  bool frame_a_tool = false;                     // BX2: each tool has a frame of its own, one number after the other's
  std::map<std::uint16_t, PoseTrack> tools =
      {};                               // where tools of these handles are; those from 0A on are in their ports
  std::set<std::uint16_t> broken = {};  // port handles that PINIT answers with ERROR13
  double error_mm = 0.0;                // that it says each of its poses has
  Duration jump_every{0};               // 0: never
  std::int64_t jump_by = 0;             // then its frame numbers jump by so many
  bool malformed_bx2 = false;           // its BX2 replies are whole, but their bodies are not as in the guide
};

// On a serial line it begins at 9600 baud and goes on at what COMM says, until it is plugged in anew; while the other
// end has set another rate it hears and sends nonsense. It hears no break. For 100 ms after INIT it hears nothing, as
// the guide allows it.
class NdiEmulator final : public DeviceProtocol {
 public:
  NdiEmulator(PoseTrack track, const NdiEmulatorSettings& settings, const EmulatorFaults& faults);

  void on_open(LinkControl& link, Instant now) override;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override;
  void on_time(LinkControl& link, Instant now) override;
  [[nodiscard]] Instant next_time() const noexcept override { return held_.empty() ? kNever : held_.front().due; }

  // A wired tool is taken out of its port: the device tells it as disabled.
  void unplug(std::uint16_t handle) { ports_.at(handle).enabled = false; }
  // It is plugged in again, and has to be initialised anew.
  void plug_in(std::uint16_t handle) { ports_.at(handle).initialised = false; }
  // The definition uploaded to a port handle, for tests.
  [[nodiscard]] const std::vector<std::byte>& definition(std::uint16_t handle) const {
    return ports_.at(handle).definition;
  }

 private:
  struct Port {
    std::vector<std::byte> definition;
    bool wired = false;
    bool initialised = false;
    bool enabled = false;
  };

  // A pseudo-terminal takes no time for what a serial line takes its time for, so the reply waits for it.
  struct Held {
    Instant due;
    std::vector<std::byte> reply;
    int baud_after = 0;  // of the line, once this has gone; 0: as it is
  };

  void restart();
  // Whether the other end of the line has the device's rate.
  [[nodiscard]] bool rates_agree(const LinkControl& link) const noexcept;
  void send(LinkControl& link, std::span<const std::byte> bytes, std::size_t check);
  void on_command(LinkControl& link, const std::string& line, Instant now);
  void reply(LinkControl& link, std::string_view text);
  void reply_binary(LinkControl& link, std::span<const std::byte> body);
  [[nodiscard]] std::string search(std::string_view option) const;
  [[nodiscard]] Port* port_of(std::string_view digits);
  [[nodiscard]] std::int64_t frame_at(Instant now) const noexcept;
  // What it says the frame's number is.
  [[nodiscard]] std::uint32_t number_of(std::int64_t frame) const noexcept;
  // Of the tool of this handle, the `tool`-th of all of them.
  [[nodiscard]] ToolReading reading(std::uint16_t handle, std::size_t tool, std::int64_t frame) const noexcept;
  void send_bx(LinkControl& link, std::int64_t frame);
  void send_bx2(LinkControl& link, std::int64_t frame);
  void send_tx(LinkControl& link, std::int64_t frame);

  PoseTrack track_;
  NdiEmulatorSettings settings_;
  EmulatorFaults faults_;
  FaultySender sender_;
  std::string line_;
  std::deque<Held> held_;
  Instant now_{};
  int baud_ = 0;
  Instant deaf_until_{};
  std::map<std::uint16_t, Port> ports_;
  bool initialised_ = false;
  bool tracking_ = false;
};

}  // namespace perimap

// Any bytes from an ECG device, in any chunks: blocks in order, whole, stamped before they arrived.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "device_bytes.hpp"
#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/ecg/cyton.hpp"
#include "drivers/ecg/medlab.hpp"

namespace perimap {
namespace {

// Counts go on and never repeat; a lead-off block is one all through by its type.
class Checked {
 public:
  EcgSinks sink() {
    return {[this](const EcgBlock& block) {
              check(block, next_);
              samples += block.count;
            },
            [this](const RespirationBlock& block) { check(block, next_breath_); }};
  }
  std::uint64_t samples = 0;
  DeviceHealth health;

 private:
  template <class Block>
  static void check(const Block& block, std::uint32_t& next) {
    if (block.count == 0 || block.count > Block::kCapacity) std::abort();
    if (block.device_sequence < next) std::abort();
    if (block.first_sample_time > block.arrival) std::abort();
    next = block.device_sequence + block.count;
  }

  std::uint32_t next_ = 0;
  std::uint32_t next_breath_ = 0;
};

void feed_can(std::span<const std::byte> input) {
  Checked checked;
  CanEcgDecoder decoder({}, checked.sink(), checked.health);
  Instant now(std::chrono::seconds(1));
  constexpr std::size_t kRecord = 12;
  for (; input.size() >= kRecord; input = input.subspan(kRecord)) {
    CanFrame frame;
    frame.identifier = 0x2E0U ^ std::to_integer<unsigned>(input[0] & std::byte{1});
    frame.error = input[0] == std::byte{0xFF};
    frame.length = static_cast<std::uint8_t>(std::to_integer<unsigned>(input[1]) % 9);
    frame.dropped_before = std::to_integer<std::uint32_t>(input[2]);
    now += Duration(std::to_integer<int>(input[3])) * 1'000'000;
    frame.arrival = now;
    for (std::size_t i = 0; i < 8; ++i) frame.data[i] = std::to_integer<std::uint8_t>(input[4 + i]);
    decoder.decode_frame(frame);
  }
}

}  // namespace
}  // namespace perimap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  if (size < 2) return 0;
  const auto input = std::as_bytes(std::span(data, size)).subspan(2);
  Checked checked;
  std::unique_ptr<EcgProtocol> protocol;
  // In half of the trials the device has a respiration channel, in half a second lead.
  const int breathes = data[0] % 8 < 4 ? 0 : 1;
  const int two = data[0] % 16 < 8 ? 0 : 1;
  switch (data[0] % 4) {
    case 0:
      protocol = std::make_unique<MedlabProtocol>(MedlabSettings{}, checked.sink(), checked.health);
      break;
    case 1:
      protocol = std::make_unique<BitalinoProtocol>(
          BitalinoSettings{.second_channel = two * 4, .respiration_channel = breathes * 3}, checked.sink(),
          checked.health);
      break;
    case 2:
      protocol =
          std::make_unique<CytonProtocol>(CytonSettings{.second_channel = two * 2, .respiration_channel = breathes * 8},
                                          checked.sink(), checked.health);
      break;
    default:
      feed_can(input);
      return 0;
  }
  ScriptedLink link;
  const Instant now(std::chrono::seconds(1));
  protocol->on_open(link, now);
  feed_in_chunks(*protocol, link, now, input, 1 + data[1] % 64U, std::chrono::milliseconds(data[1] >> 6U));
  if (checked.samples > input.size()) std::abort();
  return 0;
}

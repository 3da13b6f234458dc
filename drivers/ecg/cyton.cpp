#include "drivers/ecg/cyton.hpp"

#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kPacketsToSynchronise = 3;
constexpr unsigned kCountModulus = 256;
constexpr std::byte kBegin{0xA0};
constexpr unsigned kFirstEnd = 0xC0;
constexpr unsigned kLastEnd = 0xC6;
constexpr std::string_view kPrompt = "$$$";
constexpr std::size_t kLongestGreeting = 2048;
constexpr double kReference_mV = 4500.0;
constexpr std::int32_t kFullScale = 0x7FFFFF;

bool closed(std::span<const std::byte> packet) {
  const auto end = std::to_integer<unsigned>(packet.back());
  return packet[0] == kBegin && end >= kFirstEnd && end <= kLastEnd;
}
unsigned count_of(std::span<const std::byte> packet) { return std::to_integer<unsigned>(packet[1]); }

constexpr FrameShape kShape{
    .bytes = CytonProtocol::kPacketBytes,
    .modulus = kCountModulus,
    .to_synchronise = kPacketsToSynchronise,
    .well_formed = &closed,
    .count = &count_of,
};

}  // namespace

CytonProtocol::CytonProtocol(const CytonSettings& settings, EcgSink sink, DeviceHealth& health)
    : EcgProtocol(kSampleRate_hz, time_on_line(kPacketBytes, kBaud), std::move(sink), health),
      settings_(settings),
      framer_(kShape) {}

void CytonProtocol::start(LinkControl& link) {
  prompted_ = false;
  greeting_.clear();
  framer_.restart();
  rail_.restart();
  // The board may be streaming still, from a session that ended without a word.
  link.send("sv");
}

void CytonProtocol::await_prompt(LinkControl& link, std::span<const std::byte> bytes) {
  for (const std::byte b : bytes) greeting_.push_back(static_cast<char>(b));
  const std::size_t prompt = greeting_.find(kPrompt);
  if (prompt == std::string::npos) {
    // Of a stream that is still running only the end can hold the prompt.
    if (greeting_.size() > kLongestGreeting) greeting_.erase(0, greeting_.size() - kLongestGreeting / 2);
    return;
  }
  const std::size_t name = greeting_.find("OpenBCI");
  if (name < prompt) health().set_identity(greeting_.substr(name, prompt - name));
  prompted_ = true;
  link.send("b");
}

void CytonProtocol::decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  if (!prompted_) return await_prompt(link, bytes);
  const auto take = [&](std::span<const std::byte> packet, std::optional<unsigned> lost, std::size_t behind) {
    const auto value = packet.subspan(2 + 3 * static_cast<std::size_t>(settings_.channel - 1), 3);
    const std::uint32_t bits = std::to_integer<std::uint32_t>(value[0]) << 24U |
                               std::to_integer<std::uint32_t>(value[1]) << 16U |
                               std::to_integer<std::uint32_t>(value[2]) << 8U;
    const std::int32_t counts = static_cast<std::int32_t>(bits) / 256;
    const bool off = rail_.lead_off(counts >= kFullScale || counts <= -kFullScale);
    samples().add(static_cast<float>(counts * (kReference_mV / settings_.gain / kFullScale)), off,
                  lost ? samples().lost_samples(*lost, kCountModulus, behind, arrival) : 0);
  };
  health().damaged.add(framer_.feed(bytes, take));
}

}  // namespace perimap

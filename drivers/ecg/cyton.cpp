#include "drivers/ecg/cyton.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kPacketsToSynchronise = 3;
constexpr unsigned kCountModulus = 256;
constexpr std::byte kBegin{0xA0};
constexpr unsigned kFirstEnd = 0xC0;
constexpr unsigned kLastEnd = 0xC6;
constexpr std::string_view kPrompt = "$$$";
constexpr Duration kDongleReset = std::chrono::milliseconds(250);
constexpr Duration kBetweenCommands = std::chrono::milliseconds(100);
constexpr Duration kPromptTime = std::chrono::milliseconds(1500);
constexpr int kMostResets = 2;
// What the dongle says in place of a board that does not answer; it ends as a greeting does.
constexpr std::string_view kNoBoard = "Failure";
constexpr std::string_view kName = "OpenBCI";
constexpr std::string_view kDaisy = "Daisy";  // "On Daisy ADS1299 Device ID: 0x3E", where there is one
constexpr Duration kBetweenBegins = std::chrono::milliseconds(500);
constexpr int kMostBegins = 20;
constexpr std::size_t kLongestGreeting = 2048;
constexpr double kReference_mV = 4500.0;
constexpr std::int32_t kFullScale = 0x7FFFFF;

bool closed(std::span<const std::byte> packet) {
  const auto end = std::to_integer<unsigned>(packet.back());
  return packet[0] == kBegin && end >= kFirstEnd && end <= kLastEnd;
}
unsigned count_of(std::span<const std::byte> packet) { return std::to_integer<unsigned>(packet[1]); }

// `channel`: from 1.
std::int32_t counts_of(std::span<const std::byte> packet, int channel) {
  const auto value = packet.subspan(2 + 3 * static_cast<std::size_t>(channel - 1), 3);
  const std::uint32_t bits = std::to_integer<std::uint32_t>(value[0]) << 24U |
                             std::to_integer<std::uint32_t>(value[1]) << 16U |
                             std::to_integer<std::uint32_t>(value[2]) << 8U;
  return static_cast<std::int32_t>(bits) / 256;
}
bool at_rail(std::int32_t counts) { return counts >= kFullScale || counts <= -kFullScale; }

constexpr FrameShape kShape{
    .bytes = CytonProtocol::kPacketBytes,
    .modulus = kCountModulus,
    .to_synchronise = kPacketsToSynchronise,
    .well_formed = &closed,
    .count = &count_of,
};

}  // namespace

CytonProtocol::CytonProtocol(const CytonSettings& settings, EcgSinks sinks, DeviceHealth& health)
    : EcgProtocol(kSampleRate_hz, time_on_line(kPacketBytes, kBaud), std::move(sinks), health),
      settings_(settings),
      framer_(kShape) {}

void CytonProtocol::start() {
  prompted_ = false;
  no_board_ = false;
  streams_ = false;
  heard_.clear();
  framer_.restart();
  lead_.restart();
  second_lead_.restart();
  breath_sensor_.restart();
  // The board may be streaming still, from a session that ended without a word. Opening the port resets its dongle,
  // which then hears nothing for a while: who is not answered asks again.
  send_in(kDongleReset, "s");
  send_in(kBetweenCommands, "v");
  for (int again = 0; again < kMostResets; ++again) {
    send_in(kPromptTime, "s");
    send_in(kBetweenCommands, "v");
  }
  // Asked again sooner, a slow board would never get that far; one that is switched on meanwhile waits to be asked.
  wait_longer(patience_);
  patience_ = patience_ < kLongestPatience ? 2 * patience_ : kPatience;
  health().set_awaited("no answer yet to v, which asks for its name; is it switched on?");
}

void CytonProtocol::await_greeting(LinkControl& link, std::span<const std::byte> bytes) {
  for (const std::byte b : bytes) heard_.push_back(static_cast<char>(b));
  for (std::size_t end = heard_.find(kPrompt); end != std::string::npos; end = heard_.find(kPrompt)) {
    const std::string text = heard_.substr(0, end);
    heard_.erase(0, end + kPrompt.size());
    const std::size_t name = text.rfind(kName);
    const std::size_t failure = text.rfind(kNoBoard);
    if (failure == std::string::npos || (name != std::string::npos && name > failure)) {
      // All that was said counts: of a greeting whose head was lost the name is missing, and the Daisy may be in it.
      if (text.find(kDaisy) != std::string::npos)
        return refuse_daisy(link, text.substr(name == std::string::npos ? 0 : name));
      return begin(name == std::string::npos ? "" : text.substr(name));
    }
    no_board_ = true;
    patience_ = kPatience;
    answers("its dongle answers that it reaches no board: is the board switched on, and on the dongle's channel?");
  }
  // Of a stream that is still running only the end can hold the prompt.
  if (heard_.size() > kLongestGreeting) heard_.erase(0, heard_.size() - kLongestGreeting / 2);
  const auto running = [this](std::span<const std::byte>, std::optional<unsigned>, std::size_t) {
    if (!std::exchange(streams_, true))
      answers("it sends samples, of an earlier session, and does not answer to v yet.");
  };
  (void)framer_.feed(bytes, running);
}

void CytonProtocol::refuse_daisy(LinkControl& link, const std::string& greeting) {
  health().set_identity(greeting);
  patience_ = kPatience;
  link.fail(
      "a Cyton with a Daisy module, whose packets are of the one board and the other in turn, 125 a second of each: "
      "take the Daisy off");
}

void CytonProtocol::begin(const std::string& name) {
  if (!name.empty()) health().set_identity(name);
  prompted_ = true;
  patience_ = kPatience;
  framer_.restart();
  drop_commands();
  // To open the port anew would reset the board, and lose what it measures meanwhile.
  for (int i = 0; i < kMostBegins; ++i) send_in(i == 0 ? kBetweenCommands : kBetweenBegins, "b");
  answers("it has told its name, and sends no sample yet after b, which starts them.");
}

// What went wrong at an earlier opening is no more.
void CytonProtocol::answers(std::string awaited) {
  health().set_reason("");
  health().set_awaited(std::move(awaited));
}

std::string CytonProtocol::why_no_sample(std::uint64_t bytes, double seconds) const {
  if (prompted_) {
    return fmt::format("it has told its name, but sends no sample, told to begin again and again for {:.1f} s",
                       seconds);
  }
  if (no_board_) return "the dongle reaches no board: is the board switched on, and on the dongle's channel?";
  if (streams_) return "it sends samples, of an earlier session, and hears nothing: switch the board off and on again";
  return EcgProtocol::why_no_sample(bytes, seconds);
}

void CytonProtocol::decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  if (!prompted_) return await_greeting(link, bytes);
  const double count_mV = kReference_mV / settings_.gain / kFullScale;
  const auto take = [&](std::span<const std::byte> packet, std::optional<unsigned> lost, std::size_t behind) {
    drop_commands();
    std::optional<RespirationReading> respiration;
    if (settings_.respiration_channel > 0) {
      const std::int32_t counts = counts_of(packet, settings_.respiration_channel);
      respiration = {static_cast<float>(counts * count_mV), breath_sensor_.off(at_rail(counts))};
    }
    std::optional<SecondLead> second;
    if (settings_.second_channel > 0) {
      const std::int32_t counts = counts_of(packet, settings_.second_channel);
      second = {static_cast<float>(counts * count_mV), second_lead_.off(at_rail(counts))};
    }
    const std::int32_t counts = counts_of(packet, settings_.channel);
    samples().add(static_cast<float>(counts * count_mV), lead_.off(at_rail(counts)),
                  lost ? samples().lost_samples(*lost, kCountModulus, behind, arrival) : 0, respiration, second);
  };
  health().damaged.add(framer_.feed(bytes, take));
}

}  // namespace perimap

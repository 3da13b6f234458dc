#include "drivers/standins/emulator/ndi_emulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <utility>

#include "drivers/tracker/ndi_reply.hpp"

namespace perimap {
namespace {

constexpr std::uint16_t kFirstWiredPort = 0x0A;
constexpr int kFirstBaud = 9600;
// By COMM's first digit.
constexpr std::array<int, 8> kBauds{9600, 14400, 19200, 38400, 57600, 115200, 921600, 1228739};
constexpr char kNonsense = 'x';  // what a byte of another rate is heard as
constexpr std::size_t kLongestCommand = 512;
constexpr Duration kDeafAfterInit = std::chrono::milliseconds(100);

class Bytes {
 public:
  Bytes& u8(unsigned value) { return number(value, 1); }
  Bytes& u16(unsigned value) { return number(value, 2); }
  Bytes& u32(std::uint32_t value) { return number(value, 4); }
  Bytes& f32(double value) { return number(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4); }
  Bytes& transform(const Pose& X, double error_mm) {
    double q[4];
    rotation_to_wxyz(X.R, q);
    for (const double component : q) f32(component);
    for (int axis = 0; axis < 3; ++axis) f32(X.t[axis]);
    return f32(error_mm);
  }
  Bytes& append(const Bytes& other) {
    all.insert(all.end(), other.all.begin(), other.all.end());
    return *this;
  }

  std::vector<std::byte> all;

 private:
  Bytes& number(std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i)
      all.push_back(static_cast<std::byte>(value >> (8U * static_cast<unsigned>(i)) & 0xFFU));
    return *this;
  }
};

Bytes component(unsigned type, std::uint32_t items, const Bytes& content) {
  constexpr std::uint32_t kHeader = 12;
  return Bytes()
      .u16(type)
      .u32(kHeader + static_cast<std::uint32_t>(content.all.size()))
      .u16(0)
      .u32(items)
      .append(content);
}

std::uint32_t port_status(const ToolReading& reading) {
  return 0x31U | (reading.state == ToolState::kOutOfVolume ? 0x40U : 0U);
}

// Keeps what is sent.
class Collected final : public LinkControl {
 public:
  using LinkControl::send;
  void send(std::span<const std::byte> bytes) override { all.insert(all.end(), bytes.begin(), bytes.end()); }
  void set_line_rate(int /*baud*/) override {}
  void send_break() override {}
  void fail(std::string /*reason*/) override {}

  std::vector<std::byte> all;
};

std::optional<unsigned> hex(std::string_view digits) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

}  // namespace

NdiEmulator::NdiEmulator(PoseTrack track, const NdiEmulatorSettings& settings, const EmulatorFaults& faults)
    : track_(std::move(track)), settings_(settings), faults_(faults), sender_(faults) {}

void NdiEmulator::on_open(LinkControl& /*link*/, Instant /*now*/) {
  line_.clear();
  held_.clear();
  baud_ = kFirstBaud;
  restart();
  initialised_ = false;
  deaf_until_ = {};
}

void NdiEmulator::restart() {
  ports_.clear();
  for (int i = 0; i < settings_.wired_tools; ++i) {
    ports_[static_cast<std::uint16_t>(kFirstWiredPort + i)].wired = true;
  }
  for (const auto& [handle, track] : settings_.tools) {
    if (handle >= kFirstWiredPort) ports_[handle].wired = true;
  }
  tracking_ = false;
}

bool NdiEmulator::rates_agree(const LinkControl& link) const noexcept {
  if (!link.serial() || link.byte_time_ns() <= 0.0) return true;
  constexpr double kTolerance = 0.03;  // of UARTs
  return std::abs(10.0e9 / link.byte_time_ns() - baud_) < kTolerance * baud_;
}

void NdiEmulator::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  now_ = arrival;
  if (arrival < deaf_until_) return;
  const bool heard = rates_agree(link);
  for (const std::byte b : bytes) {
    if (heard && b == std::byte{'\r'}) {
      on_command(link, std::exchange(line_, {}), arrival);
    } else if (line_.size() < kLongestCommand) {
      line_.push_back(heard ? static_cast<char>(b) : kNonsense);
    }
  }
}

void NdiEmulator::on_time(LinkControl& link, Instant now) {
  for (; !held_.empty() && held_.front().due <= now; held_.pop_front()) {
    Held& next = held_.front();
    if (!rates_agree(link)) std::fill(next.reply.begin(), next.reply.end(), static_cast<std::byte>(kNonsense));
    link.send(next.reply);
    if (next.baud_after > 0) baud_ = next.baud_after;
  }
}

void NdiEmulator::send(LinkControl& link, std::span<const std::byte> bytes, std::size_t check) {
  if (!link.serial()) return sender_.send(link, bytes, check);
  Collected reply;
  sender_.send(reply, bytes, check);
  const Instant begin = held_.empty() ? now_ : std::max(now_, held_.back().due);
  const auto on_line = std::llround(static_cast<double>(reply.all.size()) * link.byte_time_ns());
  held_.push_back({begin + Duration(on_line), std::move(reply.all)});
}

void NdiEmulator::reply(LinkControl& link, std::string_view text) {
  const std::string framed = ndi_with_crc(text);
  send(link, std::as_bytes(std::span(framed.data(), framed.size())), framed.size() - 2);
}

void NdiEmulator::reply_binary(LinkControl& link, std::span<const std::byte> body) {
  Bytes framed;
  framed.u16(0xA5C4).u16(static_cast<unsigned>(body.size()));
  framed.u16(ndi_crc(framed.all));
  framed.all.insert(framed.all.end(), body.begin(), body.end());
  framed.u16(ndi_crc(body));
  send(link, framed.all, framed.all.size() - 1);
}

NdiEmulator::Port* NdiEmulator::port_of(std::string_view digits) {
  const auto handle = hex(digits.substr(0, std::min<std::size_t>(2, digits.size())));
  const auto found = handle ? ports_.find(static_cast<std::uint16_t>(*handle)) : ports_.end();
  return found == ports_.end() ? nullptr : &found->second;
}

std::string NdiEmulator::search(std::string_view option) const {
  std::string list;
  int count = 0;
  for (const auto& [handle, port] : ports_) {
    const bool wanted = option == "02"   ? !port.initialised
                        : option == "03" ? port.initialised && !port.enabled
                        : option == "04" ? port.enabled
                                         : option == "00";
    if (!wanted) continue;
    const unsigned status = 0x01U | (port.initialised ? 0x10U : 0U) | (port.enabled ? 0x20U : 0U);
    list += fmt::format("{:02X}{:03X}", handle, status);
    ++count;
  }
  return fmt::format("{:02X}{}", count, list);
}

void NdiEmulator::on_command(LinkControl& link, const std::string& line, Instant now) {
  const std::size_t end = line.find_first_of(": ");
  if (end == std::string::npos) return reply(link, "ERROR01");
  const std::string name = line.substr(0, end);
  std::string arguments = line.substr(end + 1);
  if (line[end] == ':') {
    if (arguments.size() < 4) return reply(link, "ERROR03");
    const std::string text = line.substr(0, line.size() - 4);
    if (ndi_with_crc(text) != line + "\r") return reply(link, "ERROR04");
    arguments.resize(arguments.size() - 4);
  }
  if (name == "RESET") return reply(link, "RESET");
  if (name == "INIT") {
    if (tracking_) return reply(link, "ERROR0C");
    restart();
    initialised_ = true;
    deaf_until_ = now + kDeafAfterInit;
    return reply(link, "OKAY");
  }
  if (name == "COMM") {
    const auto rate = hex(std::string_view(arguments).substr(0, 1));
    if (arguments.size() != 5 || !rate || *rate >= kBauds.size()) return reply(link, "ERROR01");
    reply(link, "OKAY");
    if (link.serial() && !held_.empty()) held_.back().baud_after = kBauds[*rate];
    return;
  }
  if (!initialised_) return reply(link, name == "TSTOP" ? "ERROR0C" : "ERROR10");
  if (name == "VER") return reply(link, "perimap emulated tracker\nFreeze Tag: 1.0");
  if (name == "TSTOP") {
    reply(link, tracking_ ? "OKAY" : "ERROR0C");
    tracking_ = false;
    return;
  }
  if (name == "BX" || name == "BX2" || name == "TX") {
    using Newest = NdiEmulatorSettings::Newest;
    if (!tracking_) return reply(link, "ERROR0C");
    const bool known =
        name == "TX" || settings_.newest == Newest::kBx2 || (name == "BX" && settings_.newest == Newest::kBx);
    if (!known) return reply(link, "ERROR01");
    const std::int64_t frame = frame_at(now);
    return name == "BX" ? send_bx(link, frame) : name == "TX" ? send_tx(link, frame) : send_bx2(link, frame);
  }
  if (tracking_) return reply(link, "ERROR0C");
  if (name == "PHSR") return reply(link, search(arguments));
  if (name == "PHRQ") {
    std::uint16_t handle = 1;
    while (ports_.contains(handle)) ++handle;
    ports_[handle] = {};
    return reply(link, fmt::format("{:02X}", handle));
  }
  if (name == "TSTART") {
    tracking_ = true;
    return reply(link, "OKAY");
  }
  Port* port = port_of(arguments);
  if (port == nullptr) return reply(link, name.starts_with('P') ? "ERROR08" : "ERROR01");
  if (name == "PVWR") {
    constexpr std::size_t kLength = 2 + 4 + 128;
    if (arguments.size() != kLength) return reply(link, "ERROR07");
    const auto address = hex(std::string_view(arguments).substr(2, 4));
    if (!address || *address > port->definition.size()) return reply(link, "ERROR07");
    port->definition.resize(std::max<std::size_t>(port->definition.size(), *address + 64));
    for (std::size_t i = 0; i < 64; ++i) {
      const std::string_view digits = std::string_view(arguments).substr(6 + 2 * i, 2);
      port->definition[*address + i] = static_cast<std::byte>(hex(digits).value_or(0));
    }
  } else if (name == "PINIT") {
    if (!port->wired && port->definition.empty()) return reply(link, "ERROR0D");
    if (settings_.broken.contains(static_cast<std::uint16_t>(*hex(std::string_view(arguments).substr(0, 2))))) {
      return reply(link, "ERROR13");
    }
    port->initialised = true;
    if (settings_.second_channel && port == &ports_.at(kFirstWiredPort)) {
      ports_[static_cast<std::uint16_t>(kFirstWiredPort + settings_.wired_tools)].wired = true;
    }
  } else if (name == "PENA") {
    if (!port->initialised) return reply(link, "ERROR0E");
    port->enabled = true;
  } else if (name == "PHF") {
    ports_.erase(static_cast<std::uint16_t>(*hex(std::string_view(arguments).substr(0, 2))));
  } else {
    return reply(link, "ERROR01");
  }
  reply(link, "OKAY");
}

// The newest frame that the device has measured.
std::int64_t NdiEmulator::frame_at(Instant now) const noexcept {
  const double rate_hz = track_.rate_hz() * (1.0 + 1e-6 * faults_.drift_ppm);
  // To the nearest nanosecond and not below it: a frame is there at its own instant.
  return static_cast<std::int64_t>(std::floor(to_seconds(now - track_.start()) * rate_hz + 1e-6));
}

std::uint32_t NdiEmulator::number_of(std::int64_t frame) const noexcept {
  const Duration since = from_seconds(static_cast<double>(std::max<std::int64_t>(frame, 0)) / track_.rate_hz());
  const std::int64_t jumps = settings_.jump_every > Duration(0) ? since / settings_.jump_every : 0;
  return static_cast<std::uint32_t>(frame + jumps * settings_.jump_by);
}

ToolReading NdiEmulator::reading(std::uint16_t handle, std::size_t tool, std::int64_t frame) const noexcept {
  const Duration since = from_seconds(static_cast<double>(std::max<std::int64_t>(frame, 0)) / track_.rate_hz());
  const auto other = settings_.tools.find(handle);
  ToolReading seen;
  if (other != settings_.tools.end()) {
    seen = other->second.at(track_.start() + since - other->second.start());
  } else if (tool > 0) {
    if (settings_.reference) seen = {ToolState::kOk, *settings_.reference};
  } else {
    seen = track_.at(frame);
  }
  if (tool == 0 && faults_.missing(since)) return {};
  if (seen.state == ToolState::kOk) seen.error_mm = settings_.error_mm;
  return seen;
}

void NdiEmulator::send_bx(LinkControl& link, std::int64_t frame) {
  Bytes body;
  body.u8(static_cast<unsigned>(ports_.size()));
  std::size_t tool = 0;
  for (const auto& [handle, port] : ports_) {
    const ToolReading r = reading(handle, tool++, frame);
    body.u8(handle);
    if (!port.enabled || r.state == ToolState::kDisabled) {
      body.u8(4);
      continue;
    }
    const bool has_transform = r.state == ToolState::kOk;
    body.u8(has_transform ? 1 : 2);
    if (has_transform) body.transform(r.X_TO, r.error_mm);
    body.u32(port_status(r)).u32(number_of(frame));
  }
  body.u16(0);
  reply_binary(link, body.all);
}

void NdiEmulator::send_bx2(LinkControl& link, std::int64_t frame) {
  Bytes items;
  std::uint32_t frames = 0;
  Bytes tools;
  std::uint32_t count = 0;
  const auto end_frame = [&](std::int64_t number) {
    const Duration device_time = from_seconds(static_cast<double>(number) / track_.rate_hz());
    items.u8(1).u8(static_cast<unsigned>(number) & 0xFFU).u16(0).u32(number_of(number));
    items.u32(static_cast<std::uint32_t>(device_time.count() / 1'000'000'000));
    items.u32(static_cast<std::uint32_t>(device_time.count() % 1'000'000'000));
    items.u16(1).u16(1).append(component(2, std::exchange(count, 0), std::exchange(tools, {})));
    ++frames;
  };
  std::size_t tool = 0;
  for (const auto& [handle, port] : ports_) {
    const ToolReading r = reading(handle, tool, frame);
    ++count;
    tools.u16(handle);
    if (!port.enabled || r.state == ToolState::kDisabled) {
      tools.u16(0x0120);
    } else if (r.state == ToolState::kOk) {
      tools.u16(0).transform(r.X_TO, r.error_mm);
    } else {
      tools.u16(r.state == ToolState::kOutOfVolume ? 0x0109U : 0x011FU);
    }
    if (settings_.frame_a_tool) end_frame(frame + static_cast<std::int64_t>(tool));
    ++tool;
  }
  if (!settings_.frame_a_tool) end_frame(frame);
  const unsigned components = settings_.malformed_bx2 ? 2 : 1;
  const Bytes body = Bytes().u16(1).u16(components).append(component(1, frames, items));
  reply_binary(link, body.all);
}

void NdiEmulator::send_tx(LinkControl& link, std::int64_t frame) {
  std::string text = fmt::format("{:02X}", ports_.size());
  std::size_t tool = 0;
  for (const auto& [handle, port] : ports_) {
    const ToolReading r = reading(handle, tool++, frame);
    text += fmt::format("{:02X}", handle);
    if (!port.enabled || r.state == ToolState::kDisabled) {
      text += "DISABLED\n";
      continue;
    }
    if (r.state == ToolState::kOk) {
      double q[4];
      rotation_to_wxyz(r.X_TO.R, q);
      for (const double component_q : q) text += fmt::format("{:+06d}", std::lround(component_q * 1e4));
      for (int axis = 0; axis < 3; ++axis) text += fmt::format("{:+07d}", std::lround(r.X_TO.t[axis] * 1e2));
      text += fmt::format("{:+06d}", std::lround(r.error_mm * 1e4));
    } else {
      text += "MISSING";
    }
    text += fmt::format("{:08X}{:08X}\n", port_status(r), number_of(frame));
  }
  reply(link, text + "0000");
}

}  // namespace perimap

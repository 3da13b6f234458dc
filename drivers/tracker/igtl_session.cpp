#include "drivers/tracker/igtl_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace perimap {
namespace {

constexpr Duration kSilentAfter = std::chrono::milliseconds(300);
constexpr Duration kReopenAfter = std::chrono::seconds(2);
constexpr Duration kListenForOthers = std::chrono::seconds(1);
constexpr unsigned kStatusOk = 1;
constexpr std::size_t kMostNames = 8;  // that are told
// TRANSFORM messages of one instant come one by one. A reference that is farther away than this is none.
constexpr Duration kReferenceAge = std::chrono::milliseconds(100);
// Stamps that a server gives to tools of one instant.
constexpr Duration kOneInstant = std::chrono::milliseconds(1);
// For a reference that is sent after the sensor.
constexpr Duration kLongestHold = std::chrono::milliseconds(20);

// Resolution ms, coordinate system name char[32].
std::vector<std::byte> start_tdata() {
  std::vector<std::byte> content(4 + 32);
  content[3] = std::byte{10};
  return encode_igtl({1, "STT_TDATA", "perimapd", 0, content, {}});
}

}  // namespace

IgtlSession::IgtlSession(IgtlSettings settings, TrackerSink sink, DeviceHealth& health)
    : settings_(std::move(settings)), sink_(std::move(sink)), health_(health) {
  settings_.world.relative_to_reference = settings_.reference.has_value();
}

void IgtlSession::on_open(LinkControl& link, Instant now) {
  framer_.restart();
  clock_.reset();
  reference_ = {};
  reference_follows_ = false;
  held_.reset();
  delivered_ = {};
  last_ = now;
  any_ = false;
  listen_until_ = several_ ? now + kListenForOthers : now;
  server_fault_.clear();
  names_.clear();
  link.send(start_tdata());
}

void IgtlSession::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  framer_.feed(bytes);
  while (auto next = framer_.next()) {
    if (const auto* damaged = std::get_if<IgtlDamaged>(&*next)) {
      health_.damaged.add();
      if (damaged->lost_track) return link.fail(fmt::format("{}; is it an OpenIGTLink server?", damaged->what));
    } else {
      on_message(link, std::get<IgtlMessage>(*next), arrival);
    }
  }
}

void IgtlSession::on_message(LinkControl& link, const IgtlMessage& message, Instant arrival) {
  if (message.type == "TRANSFORM" || message.type == "POSITION") note_name(message.device);
  if (message.type == "TRANSFORM") return on_pose(link, message, decode_igtl_transform(message.content), arrival);
  if (message.type == "POSITION") return on_pose(link, message, decode_igtl_position(message.content), arrival);
  if (message.type == "TDATA") return on_tdata(link, message, arrival);
  const auto status = decode_igtl_status(message.content);
  if (!status) return health_.damaged.add();
  server_fault_.clear();
  if (status->code == kStatusOk) return;
  server_fault_ = fmt::format("{} reports status {} {} {}", message.device, status->code, status->name, status->text);
  health_.set_reason(server_fault_);
}

// The protocol has no name of the server itself.
void IgtlSession::note_name(const std::string& name) {
  if (names_.size() >= kMostNames || std::find(names_.begin(), names_.end(), name) != names_.end()) return;
  names_.push_back(name);
  health_.set_identity(fmt::format("sends poses of {}", fmt::join(names_, ", ")));
}

bool IgtlSession::is_sensor(LinkControl& link, const std::string& name, Instant arrival) {
  if (!settings_.sensor.empty()) return name == settings_.sensor;
  if (settings_.reference && name == *settings_.reference) return false;
  if (only_tool_.empty()) only_tool_ = name;
  if (name != only_tool_) {
    several_ = true;
    listen_until_ = kNever;  // what else was read with it is no pose either
    link.fail(fmt::format("several tools ('{}', '{}'): say which one is the sensor", only_tool_, name));
    return false;
  }
  if (arrival < listen_until_) return false;
  several_ = false;
  return true;
}

void IgtlSession::on_pose(LinkControl& link, const IgtlMessage& message, const Expected<Pose>& pose, Instant arrival) {
  const bool is_reference = settings_.reference && message.device == *settings_.reference;
  if (!is_reference && !is_sensor(link, message.device, arrival)) return;
  if (!pose) return health_.damaged.add();
  ToolReading reading{ToolState::kOk, *pose};
  for (const auto& [key, value] : message.metadata) {
    if (key == "TransformStatus" && value != "OK") reading = {};
  }
  const Told told{reading, message.time_stamp, message.time_ns(), arrival};
  return is_reference ? on_reference(told) : on_sensor(told);
}

Duration IgtlSession::apart(const Told& a, const Told& b) noexcept {
  if (a.stamp == 0 || b.stamp == 0) return std::chrono::abs(a.arrival - b.arrival);
  // Stamps are any numbers: their difference need not fit.
  const auto [earlier, later] = std::minmax(a.time_ns, b.time_ns);
  return Duration(static_cast<std::int64_t>(std::min<std::uint64_t>(
      static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier), Duration::max().count())));
}

void IgtlSession::on_sensor(const Told& sensor) {
  const Told& last = held_ ? *held_ : delivered_;
  if (sensor.stamp != 0 && sensor.stamp == last.stamp) return;  // the same reading again
  if (held_) {
    reference_follows_ = false;
    deliver(*std::exchange(held_, std::nullopt), reference_);
  }
  if (reference_follows_ && sensor.stamp != 0 && apart(sensor, reference_) > kOneInstant) {
    held_ = sensor;
  } else {
    deliver(sensor, reference_);
  }
}

void IgtlSession::on_reference(const Told& reference) {
  const Told before = std::exchange(reference_, reference);
  if (reference.stamp == 0) return;
  if (!held_) {
    reference_follows_ = reference_follows_ || (delivered_.stamp != 0 && apart(reference, delivered_) <= kOneInstant &&
                                                apart(before, delivered_) > kOneInstant);
    return;
  }
  const bool of_this_instant = apart(reference, *held_) <= kOneInstant;
  if (!of_this_instant && reference.time_ns < held_->time_ns) return;
  const Told sensor = *std::exchange(held_, std::nullopt);
  deliver(sensor, apart(reference, sensor) <= apart(before, sensor) ? reference : before);
}

void IgtlSession::on_tdata(LinkControl& link, const IgtlMessage& message, Instant arrival) {
  const auto tools = decode_igtl_tdata(message.content);
  if (!tools) return health_.damaged.add();
  ToolReading sensor;
  ToolReading reference;
  for (const IgtlTool& tool : *tools) {
    note_name(tool.name);
    if (settings_.reference && tool.name == *settings_.reference) reference = {ToolState::kOk, tool.X_TO};
    if (is_sensor(link, tool.name, arrival)) sensor = {ToolState::kOk, tool.X_TO};
  }
  if (arrival < listen_until_) return;
  const Told told{sensor, message.time_stamp, message.time_ns(), arrival};
  if (told.stamp != 0 && told.stamp == delivered_.stamp) return;  // the same reading again
  reference_ = {reference, told.stamp, told.time_ns, arrival};
  deliver(told, reference_);
}

void IgtlSession::deliver(const Told& sensor, const Told& reference) {
  delivered_ = sensor;
  TrackerSample sample;
  sample.arrival = sensor.arrival;
  sample.source_time = sensor.arrival;
  if (sensor.stamp != 0) {
    clock_.observe(sensor.time_ns, sensor.arrival);
    health_.jitter.add(clock_.lateness(sensor.time_ns, sensor.arrival));
    sample.source_time = clock_.stamp(sensor.time_ns);
  }
  sample.device_frame = count_++;
  const bool near = apart(sensor, reference) <= kReferenceAge;
  const ToolReading reading = in_world(sensor.reading, near ? reference.reading : ToolReading{}, settings_.world);
  sample.state = reading.state;
  sample.X_WS = reading.X_TO;
  last_ = sensor.arrival;
  any_ = true;
  health_.samples.add();
  health_.set_state(DeviceState::kStreaming);
  sink_(sample);
}

Instant IgtlSession::next_time() const noexcept {
  const Instant expected = last_ + (health_.state() == DeviceState::kStreaming ? kSilentAfter : kReopenAfter);
  return held_ ? std::min(expected, held_->arrival + kLongestHold) : expected;
}

void IgtlSession::on_time(LinkControl& link, Instant now) {
  if (held_ && now - held_->arrival >= kLongestHold) {
    reference_follows_ = false;
    deliver(*std::exchange(held_, std::nullopt), reference_);
  }
  if (now - last_ >= kSilentAfter && health_.state() == DeviceState::kStreaming) {
    health_.set_state(DeviceState::kSilent);
  }
  if (now - last_ < kReopenAfter) return;
  // What the server itself complains of is the likelier reason.
  const std::string why = any_ ? std::string("no pose of the sensor for 2 s")
                          : settings_.sensor.empty()
                              ? std::string("connected, but no pose of any tool in 2 s")
                              : fmt::format("connected, but no pose of '{}' in 2 s", settings_.sensor);
  link.fail(!server_fault_.empty()             ? fmt::format("{}: {}", why, server_fault_)
            : any_ || settings_.sensor.empty() ? why
                                               : why + "; is it the name that the server sends?");
}

}  // namespace perimap

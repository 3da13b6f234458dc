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
// TRANSFORM messages of one instant come one by one; a reference that is older than this is none.
constexpr Duration kReferenceAge = std::chrono::milliseconds(100);

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
  last_stamp_ = 0;
  last_ = now;
  any_ = false;
  only_tool_.clear();
  listen_until_ = several_ ? now + kListenForOthers : now;
  server_fault_.clear();
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
  if (is_reference) {
    reference_ = reading;
    reference_arrival_ = arrival;
    return;
  }
  if (arrival - reference_arrival_ > kReferenceAge) reference_ = {};
  deliver(message.time_stamp, message.time_ns(), reading, arrival);
}

void IgtlSession::on_tdata(LinkControl& link, const IgtlMessage& message, Instant arrival) {
  const auto tools = decode_igtl_tdata(message.content);
  if (!tools) return health_.damaged.add();
  ToolReading sensor;
  ToolReading reference;
  for (const IgtlTool& tool : *tools) {
    if (settings_.reference && tool.name == *settings_.reference) reference = {ToolState::kOk, tool.X_TO};
    if (is_sensor(link, tool.name, arrival)) sensor = {ToolState::kOk, tool.X_TO};
  }
  if (several_) return;
  reference_ = reference;
  reference_arrival_ = arrival;
  deliver(message.time_stamp, message.time_ns(), sensor, arrival);
}

void IgtlSession::deliver(std::uint64_t time_stamp, std::int64_t time_ns, const ToolReading& sensor, Instant arrival) {
  if (time_stamp != 0 && time_stamp == last_stamp_) return;  // the same reading again
  last_stamp_ = time_stamp;
  TrackerSample sample;
  sample.arrival = arrival;
  sample.source_time = arrival;
  if (time_stamp != 0) {
    clock_.observe(time_ns, arrival);
    health_.jitter.add(clock_.lateness(time_ns, arrival));
    sample.source_time = clock_.stamp(time_ns);
  }
  sample.device_frame = count_++;
  const ToolReading reading = in_world(sensor, reference_, settings_.world);
  sample.state = reading.state;
  sample.X_WS = reading.X_TO;
  last_ = arrival;
  any_ = true;
  health_.samples.add();
  health_.set_state(DeviceState::kStreaming);
  sink_(sample);
}

Instant IgtlSession::next_time() const noexcept {
  return last_ + (health_.state() == DeviceState::kStreaming ? kSilentAfter : kReopenAfter);
}

void IgtlSession::on_time(LinkControl& link, Instant now) {
  if (health_.state() == DeviceState::kStreaming) health_.set_state(DeviceState::kSilent);
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

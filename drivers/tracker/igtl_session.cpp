#include "drivers/tracker/igtl_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace perimap {
namespace {

constexpr Duration kSilentAfter = std::chrono::milliseconds(300);
// A sensor that is sent less often than this, while other messages come, is out of sight. Shorter than kSilentAfter:
// the device is not silent then.
constexpr Duration kAbsentAfter = std::chrono::milliseconds(200);
constexpr Duration kLongestWait = std::chrono::seconds(2);  // for a tool's first pose
constexpr Duration kReopenAfter = std::chrono::seconds(2);
constexpr Duration kListenForOthers = std::chrono::seconds(1);
constexpr unsigned kStatusOk = 1;
constexpr std::size_t kMostNames = 8;  // that are told
// Poses with stamps one after the other, after some without: a server that stamps one now and then does not stamp them.
constexpr int kStampedAgain = 50;
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

IgtlSession::IgtlSession(IgtlSettings settings, TrackerSink sink, DeviceHealth& health, ToolSink tool_sink)
    : settings_(std::move(settings)), sink_(std::move(sink)), tool_sink_(std::move(tool_sink)), health_(health) {
  settings_.world.relative_to_reference = settings_.reference.has_value();
}

void IgtlSession::on_open(LinkControl& link, Instant now) {
  framer_.restart();
  clock_.reset();
  stamps_.restart();
  stamps_told_.clear();  // what is still wrong is told again
  missing_told_ = false;
  health_.set_notice("");
  reference_ = {};
  reference_follows_ = false;
  held_.reset();
  others_told_.assign(1 + settings_.tools.size(), std::nullopt);
  delivered_ = {};
  sensor_seen_ = false;
  reference_seen_ = !settings_.reference;
  last_ = now;
  heard_ = now;
  absent_ = false;
  told_ = false;
  listen_until_ = several_ ? now + kListenForOthers : now;
  server_fault_.clear();
  names_.clear();
  link.send(start_tdata());
}

void IgtlSession::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  const std::uint64_t passed_over = framer_.passed_over();
  framer_.feed(bytes);
  while (auto next = framer_.next()) {
    if (const auto* damaged = std::get_if<IgtlDamaged>(&*next)) {
      health_.damaged.add();
      if (damaged->lost_track) return link.fail(fmt::format("{}; is it an OpenIGTLink server?", damaged->what));
    } else {
      on_message(link, std::get<IgtlMessage>(*next), arrival);
      on_sign_of_life(arrival);
    }
  }
  if (framer_.passed_over() != passed_over) on_sign_of_life(arrival);
}

// Servers that cannot say that a tool is missing leave its messages out; the others' tell that the server goes on.
void IgtlSession::on_sign_of_life(Instant arrival) {
  heard_ = arrival;
  if (!all_seen() || held_ || arrival < listen_until_) return;
  if (delivered_.stamp != 0 && stamps_.wrong()) return;  // there are poses, which nobody can stamp
  if (arrival - std::max(last_, delivered_.arrival) < kAbsentAfter) return;
  absent_ = true;
  give({}, arrival, arrival);
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

// The protocol has no name of the server itself.
void IgtlSession::note_name(const std::string& name) {
  if (names_.size() >= kMostNames || std::find(names_.begin(), names_.end(), name) != names_.end()) return;
  names_.push_back(name);
  health_.set_identity(fmt::format("sends poses of {}", fmt::join(names_, ", ")));
}

std::optional<std::size_t> IgtlSession::other_tool(const std::string& name) const {
  if (settings_.reference && name == *settings_.reference) return 0;
  const auto found = std::find(settings_.tools.begin(), settings_.tools.end(), name);
  if (found == settings_.tools.end()) return std::nullopt;
  return 1 + static_cast<std::size_t>(found - settings_.tools.begin());
}

bool IgtlSession::is_sensor(LinkControl& link, const std::string& name, Instant arrival) {
  if (!settings_.sensor.empty()) return name == settings_.sensor;
  if (other_tool(name)) return false;
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
  if (pose) note_name(message.device);
  const std::optional<std::size_t> other = other_tool(message.device);
  if (!other && !is_sensor(link, message.device, arrival)) return;
  if (!pose) return health_.damaged.add();
  ToolReading reading{ToolState::kOk, *pose};
  for (const auto& [key, value] : message.metadata) {
    if (key == "TransformStatus" && value != "OK") reading = {};
  }
  const Told told{reading, settings_.stamps_by_arrival ? 0 : message.time_stamp, message.time_ns(), arrival,
                  message.time_stamp};
  if (other) on_tool(*other, told);
  if (other && *other > 0) return;
  (other ? reference_seen_ : sensor_seen_) = true;
  return other ? on_reference(told) : on_sensor(told);
}

void IgtlSession::on_tool(std::size_t tool, const Told& told) {
  std::optional<Told>& before = others_told_[tool];
  if (before && repeats(told, *before)) return;
  before = told;
  if (!tool_sink_ || (told.stamp != 0 && stamps_.wrong())) return;
  ToolSample sample;
  sample.tool = tool;
  sample.arrival = told.arrival;
  sample.source_time = stamped(told);
  sample.device_frame = tool_count_++;
  const bool near = tool > 0 && apart(told, reference_) <= kReferenceAge;
  const ToolReading reading =
      tool == 0 ? told.reading : in_world(told.reading, near ? reference_.reading : ToolReading{}, settings_.world);
  sample.state = reading.state;
  sample.X_WS = reading.X_TO;
  sample.error_mm = reading.error_mm;
  tool_sink_(sample);
}

bool IgtlSession::repeats(const Told& told, const Told& before) noexcept {
  return told.sent_stamp != 0 && told.sent_stamp == before.sent_stamp && told.reading.state == before.reading.state &&
         told.reading.X_TO.R == before.reading.X_TO.R && told.reading.X_TO.t == before.reading.X_TO.t;
}

Duration IgtlSession::apart(const Told& a, const Told& b) noexcept {
  if (a.stamp == 0 || b.stamp == 0) return std::chrono::abs(a.arrival - b.arrival);
  // Stamps are any numbers: their difference need not fit.
  const auto [earlier, later] = std::minmax(a.time_ns, b.time_ns);
  return Duration(static_cast<std::int64_t>(std::min<std::uint64_t>(
      static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier), Duration::max().count())));
}

// The sensor's stamps make the clock, which those of the others, a little before or behind, must not move.
Instant IgtlSession::stamped(const Told& told) const noexcept {
  if (told.stamp == 0 || !stamps_.judged() || !clock_.started()) return told.arrival;
  return std::min(clock_.stamp(told.time_ns), told.arrival);
}

void IgtlSession::note_missing_stamp(const Told& sensor) {
  if (settings_.stamps_by_arrival) return;
  if (sensor.sent_stamp != 0) {
    if (!missing_told_ || ++stamped_since_missing_ < kStampedAgain) return;
    missing_told_ = false;
    return health_.set_notice("");
  }
  stamped_since_missing_ = 0;
  if (missing_told_) return;
  missing_told_ = true;
  health_.set_notice(
      "the server sends poses without time stamps: each is stamped by its arrival, later than it was measured by the "
      "server's and the network's delay, which perimap calibrate time measures where it is constant; let the server "
      R"(stamp them, or set tracker.igtl_stamps = "arrival" if that is meant)");
}

bool IgtlSession::stamps_wrong(const Told& sensor) {
  note_missing_stamp(sensor);
  if (sensor.stamp == 0) return false;
  stamps_.observe(sensor.stamp, sensor.arrival);
  if (stamps_.fault() != stamps_told_) {
    stamps_told_ = stamps_.fault();
    clock_.reset();
    // By arrival a server that repeats an old pose would look well.
    const char* or_by_arrival = stamps_.stand_still() ? "" : R"(, or set tracker.igtl_stamps = "arrival")";
    health_.set_reason(stamps_told_.empty() ? server_fault_
                                            : fmt::format("the server's stamps are {}: no pose can be stamped by them; "
                                                          "mend the server{}",
                                                          stamps_told_, or_by_arrival));
  }
  if (!stamps_.wrong()) return false;
  health_.set_state(DeviceState::kSilent);
  held_.reset();
  return true;
}

void IgtlSession::on_sensor(const Told& sensor) {
  const Told& last = held_ ? *held_ : delivered_;
  if (repeats(sensor, last)) return;
  if (stamps_wrong(sensor)) {
    delivered_ = sensor;
    return;
  }
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
  if (repeats(reference, reference_)) return;  // it grows old
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
  std::vector<std::optional<ToolReading>> others(others_told_.size());
  for (const IgtlTool& tool : *tools) {
    note_name(tool.name);
    const ToolReading reading{ToolState::kOk, tool.X_TO};
    if (const auto other = other_tool(tool.name)) {
      others[*other] = reading;
      if (*other > 0) continue;
      reference = reading;
      reference_seen_ = true;
    }
    if (is_sensor(link, tool.name, arrival)) {
      sensor = reading;
      sensor_seen_ = true;
    }
  }
  if (arrival < listen_until_) return;
  const Told told{sensor, settings_.stamps_by_arrival ? 0 : message.time_stamp, message.time_ns(), arrival,
                  message.time_stamp};
  if (repeats(told, delivered_)) return;
  if (stamps_wrong(told)) {
    delivered_ = told;
    return;
  }
  const Told patient{reference, told.stamp, told.time_ns, arrival, told.sent_stamp};
  if (!repeats(patient, reference_)) reference_ = patient;
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (others[i] || others_told_[i]) {
      on_tool(i, {others[i].value_or(ToolReading{}), told.stamp, told.time_ns, arrival, told.sent_stamp});
    }
  }
  deliver(told, reference_);
}

void IgtlSession::deliver(const Told& sensor, const Told& reference) {
  delivered_ = sensor;
  // Not missing: a tool that was never there may have another name.
  if (!all_seen()) return;
  absent_ = false;
  if (sensor.stamp != 0) {
    clock_.observe(sensor.time_ns, sensor.arrival);
    health_.jitter.add(clock_.lateness(sensor.time_ns, sensor.arrival));
  }
  const bool near = apart(sensor, reference) <= kReferenceAge;
  give(in_world(sensor.reading, near ? reference.reading : ToolReading{}, settings_.world), stamped(sensor),
       sensor.arrival);
}

void IgtlSession::give(const ToolReading& reading, Instant source_time, Instant arrival) {
  TrackerSample sample;
  sample.arrival = arrival;
  sample.source_time = source_time;
  sample.device_frame = count_++;
  sample.state = reading.state;
  sample.X_WS = reading.X_TO;
  if (std::exchange(told_, false)) health_.set_reason(server_fault_);  // what was awaited has come
  last_ = arrival;
  health_.samples.add();
  health_.set_state(DeviceState::kStreaming);
  sink_(sample);
}

Instant IgtlSession::next_time() const noexcept {
  Instant next = heard_ + kReopenAfter;
  if (may_fall_silent()) next = std::min(next, last_ + kSilentAfter);
  if (!all_seen() && !told_) next = std::min(next, last_ + kLongestWait);
  return held_ ? std::min(next, held_->arrival + kLongestHold) : next;
}

// While the sensor is out of sight the other messages, which may be rare, are what is listened to.
bool IgtlSession::may_fall_silent() const noexcept { return health_.state() == DeviceState::kStreaming && !absent_; }

void IgtlSession::on_time(LinkControl& link, Instant now) {
  if (held_ && now - held_->arrival >= kLongestHold) {
    reference_follows_ = false;
    deliver(*std::exchange(held_, std::nullopt), reference_);
  }
  if (may_fall_silent() && now - last_ >= kSilentAfter) health_.set_state(DeviceState::kSilent);
  if (now - heard_ >= kReopenAfter) return link.fail(all_seen() ? with_fault("nothing came for 2 s") : awaited());
  if (all_seen() || told_ || now - last_ < kLongestWait) return;
  told_ = true;
  health_.set_reason(awaited());
}

std::string IgtlSession::awaited() const {
  if (names_.empty()) return with_fault("connected, but no pose of any tool in 2 s");
  std::vector<std::string> tools;
  if (!sensor_seen_) {
    tools.push_back(settings_.sensor.empty() ? "for the sensor" : fmt::format("'{}'", settings_.sensor));
  }
  if (!reference_seen_) tools.push_back(fmt::format("'{}'", *settings_.reference));
  return with_fault(fmt::format("no tool {} in 2 s; the server sends {}", fmt::join(tools, " and no tool "),
                                fmt::join(names_, ", ")));
}

// What the server itself complains of is the likelier reason.
std::string IgtlSession::with_fault(std::string why) const {
  return server_fault_.empty() ? why : fmt::format("{}: {}", why, server_fault_);
}

}  // namespace perimap

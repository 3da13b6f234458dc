// What a session makes of the replies once the device tracks.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <utility>

#include "drivers/tracker/ndi_session.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kSilentAfter = milliseconds(300);
constexpr Duration kReopenAfter = seconds(2);
// A pose of the reference that is farther away than this is none of the sensor's frame.
constexpr double kReferenceAge_s = 0.05;
constexpr double kJump_s = 0.5;
constexpr std::uint16_t kHardwareFailure = 0x0010;

}  // namespace

void NdiSession::on_tracking(LinkControl& link, const Expected<NdiTracking>& tracking, Instant arrival) {
  if (!tracking) return on_damage(link, tracking.error().message, arrival);
  answered_ = true;
  retries_ = 0;
  damaged_ = 0;
  if ((tracking->system_status & kHardwareFailure) != 0) return link.fail("the tracker reports a hardware failure");
  reply_refused_ = false;
  // In a BX2 reply the frames come one after the other, each with its tools.
  for (const NdiToolReading& sensor : tracking->tools) {
    if (sensor.handle != sensor_handle_) continue;
    deliver(sensor, settings_.reference ? reference_at(*tracking, sensor.frame) : ToolReading{}, arrival);
  }
  if (settings_.reference) hear_reference(*tracking, arrival);
  if (tool_sink_) deliver_tools(*tracking, arrival);
  // Five questions a frame: a frame is seen at most a fifth of its period after it is there.
  due_ = std::max(arrival, asked_ + from_seconds(0.2 / settings_.frame_rate_hz));
  command_.clear();
}

void NdiSession::hear_reference(const NdiTracking& tracking, Instant arrival) {
  for (const NdiToolReading& tool : tracking.tools) {
    if (tool.handle != reference_handle_) continue;
    reference_ = tool;
    if (tool.reading.state != ToolState::kDisabled) reference_there_ = arrival;
  }
}

// Some devices tell tools of different kinds in frames, or even replies, of their own.
ToolReading NdiSession::reference_at(const NdiTracking& tracking, std::uint32_t frame) const noexcept {
  const auto apart = [frame](const NdiToolReading& tool) {
    return std::min(tool.frame - frame, frame - tool.frame);  // over the count's end, too
  };
  std::optional<NdiToolReading> nearest;
  const auto consider = [&](const NdiToolReading& tool) {
    if (!nearest || apart(tool) < apart(*nearest)) nearest = tool;
  };
  for (const NdiToolReading& tool : tracking.tools) {
    if (tool.handle != reference_handle_) continue;
    // A disabled tool has no frame, and no earlier reading stands for it.
    if (tool.reading.state == ToolState::kDisabled) return tool.reading;
    consider(tool);
  }
  if (reference_.handle == reference_handle_ && reference_.reading.state != ToolState::kDisabled) consider(reference_);
  const bool near = nearest && apart(*nearest) <= kReferenceAge_s * settings_.frame_rate_hz;
  return near ? nearest->reading : ToolReading{};
}

// At the rate, and by the clock, of the sensor's frames, which all tools share; before there are any, by arrival.
void NdiSession::deliver_tools(const NdiTracking& tracking, Instant arrival) {
  if (rate_refused_) return;
  for (const NdiToolReading& told : tracking.tools) {
    const bool is_reference = settings_.reference && told.handle == reference_handle_;
    const auto other =
        std::find_if(others_.begin(), others_.end(), [&](const OtherTool& tool) { return tool.handle == told.handle; });
    if (!is_reference && other == others_.end()) continue;
    OtherTool& tool = is_reference ? reference_told_ : *other;
    const bool disabled = told.reading.state == ToolState::kDisabled && told.frame == 0;
    // A disabled tool has no frame and so no instant; it is told once, then again when it changes.
    if (disabled ? tool.disabled : tool.last_frame == told.frame) continue;
    tool.disabled = disabled;
    tool.last_frame = disabled ? std::nullopt : std::optional(told.frame);
    if (reply_refused_) continue;  // nobody knows its instant either
    ToolSample sample;
    sample.tool = is_reference ? 0 : 1 + static_cast<std::size_t>(other - others_.begin());
    sample.arrival = sample.source_time = arrival;
    if (!disabled && clock_.started()) {
      const std::int64_t count = count_ + static_cast<std::int32_t>(told.frame - static_cast<std::uint32_t>(count_));
      sample.source_time = std::min(clock_.stamp(count), arrival);
    }
    sample.device_frame = told.frame;
    const ToolReading reading =
        is_reference ? told.reading : in_world(told.reading, reference_at(tracking, told.frame), settings_.world);
    sample.state = reading.state;
    sample.X_WS = reading.X_TO;
    sample.error_mm = reading.error_mm;
    tool_sink_(sample);
  }
}

bool NdiSession::expect_rate(std::int64_t count, Instant arrival) {
  rate_.observe(count, arrival);
  if (rate_.wrong() == rate_refused_) return !rate_refused_;
  rate_refused_ = rate_.wrong();
  clock_.reset();
  if (!rate_refused_) {
    health_.set_reason("");
    return true;
  }
  health_.set_reason(fmt::format("{:.1f} frames come a second, and frame_rate_hz says {:.1f}: no pose can be stamped",
                                 rate_.seen_hz(), settings_.frame_rate_hz));
  health_.set_state(DeviceState::kSilent);
  return false;
}

// Back, or on by half a second and more than what has passed, were it at twice the rate.
bool NdiSession::misnumbered(std::int32_t step, Instant arrival) const noexcept {
  if (step <= 0) return step < 0;
  const double passed = to_seconds(arrival - numbered_) * settings_.frame_rate_hz;
  return step > 2.0 * passed + kJump_s * settings_.frame_rate_hz;
}

// When such a frame was measured nobody knows. The count begins anew with it.
void NdiSession::refuse_number(std::uint32_t frame, std::int32_t step, Instant arrival) {
  health_.misnumbered.add();
  const std::uint64_t times = health_.misnumbered.get();
  if (std::has_single_bit(times)) {  // told at the first, and whenever they have doubled
    const std::string often = times == 1 ? "once" : fmt::format("{} times", times);
    jumps_ = fmt::format("frame numbers went back or jumped, {} by now, the last by {:+d}: such a frame gives no pose",
                         often, step);
    tell_notice();
  }
  reply_refused_ = true;
  last_frame_ = frame;
  numbered_ = arrival;
  count_ = frame;
  clock_.reset();
  rate_.restart();
  last_reading_ = arrival;  // the device is there, and a new start would help nobody
  if (arrival - last_pose_ < kSilentAfter) return;
  health_.set_state(DeviceState::kSilent);
  health_.set_reason(jumps_);
  jumps_are_reason_ = true;
}

void NdiSession::deliver(const NdiToolReading& sensor, const ToolReading& reference, Instant arrival) {
  TrackerSample sample;
  sample.arrival = arrival;
  if (sensor.reading.state == ToolState::kDisabled && sensor.frame == 0) {
    // It has no frame and so no instant; it is told once, then again when it changes.
    if (std::exchange(disabled_, true)) return;
    last_frame_.reset();
    sample.source_time = arrival;
  } else {
    if (last_frame_ == sensor.frame) return;  // asked before the next frame was there
    const auto step = last_frame_ ? static_cast<std::int32_t>(sensor.frame - *last_frame_) : 0;
    if (misnumbered(step, arrival)) return refuse_number(sensor.frame, step, arrival);
    if (step > 0) {
      const auto frames = static_cast<std::uint32_t>(step);
      stride_ = stride_ == 0 ? frames : std::min(stride_, frames);
      health_.lost.add(frames / stride_ - 1);
    }
    disabled_ = false;
    last_frame_ = sensor.frame;
    numbered_ = arrival;
    // Over the end of the device's 32 bits the count goes on.
    count_ += static_cast<std::int32_t>(sensor.frame - static_cast<std::uint32_t>(count_));
    if (!expect_rate(count_, arrival)) {
      last_reading_ = arrival;  // the device is there, and a new start would help nobody
      return;
    }
    clock_.observe(count_, arrival - on_line_);
    health_.jitter.add(clock_.lateness(count_, arrival - on_line_));
    sample.source_time = clock_.stamp(count_);
  }
  sample.device_frame = sensor.frame;
  const ToolReading reading = in_world(sensor.reading, reference, settings_.world);
  sample.state = reading.state;
  sample.X_WS = reading.X_TO;
  sample.error_mm = reading.error_mm;
  last_reading_ = last_pose_ = arrival;
  if (std::exchange(jumps_are_reason_, false)) health_.set_reason("");
  health_.samples.add();
  health_.set_state(DeviceState::kStreaming);
  sink_(sample);
}

Instant NdiSession::next_expectation() const noexcept {
  return last_reading_ + (health_.state() == DeviceState::kStreaming ? kSilentAfter : kReopenAfter);
}

bool NdiSession::expect_readings(LinkControl& link, Instant now) {
  if (now - last_reading_ >= kReopenAfter) {
    link.fail(why_no_reading());
    return false;
  }
  // Plugged in again it must be initialised again, which only a new start does.
  if (settings_.reference && now - reference_there_ >= kReopenAfter) {
    link.fail("no reading of the reference tool for 2 s, or it is disabled: is it unplugged?");
    return false;
  }
  if (now - last_reading_ >= kSilentAfter && health_.state() == DeviceState::kStreaming) {
    health_.set_state(DeviceState::kSilent);
  }
  return true;
}

std::string NdiSession::why_no_reading() const {
  if (damaged_ > 0) {
    return fmt::format("no whole reply to {} for 2 s, {} came damaged (the last: {}); a bad line, or another device?",
                       command_, damaged_, damage_);
  }
  if (!command_.empty()) return fmt::format("no answer to {} for 2 s", command_);
  if (disabled_) return "the sensor's tool has been disabled for 2 s: is it unplugged?";
  return "no reading of the sensor's tool for 2 s";
}

}  // namespace perimap

#include "drivers/recording/replay_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include "core/sensors/sample_block.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/sensor_messages.hpp"

namespace perimap {
namespace {

constexpr std::array<std::string_view, 3> kSensorChannels = {channels::kCameraImage, channels::kTrackerPose,
                                                             channels::kEcgSamples};

Expected<TrackerSample> pose_of(const RecordingReader& reader, const RecordedMessage& message) {
  const auto pose = reader.decode<perimap_TrackerPose>(message);
  if (!pose) return tl::unexpected(pose.error());
  auto sample = to_tracker_sample(**pose);
  if (!sample) return reader.wrong(message, sample.error().message);
  sample->arrival = message.arrival;
  return *sample;
}

Expected<std::optional<ReplayEvent>> pose_event(const RecordingReader& reader, const RecordedMessage& message) {
  return pose_of(reader, message).map([](const TrackerSample& sample) { return std::optional<ReplayEvent>(sample); });
}

Expected<std::optional<ReplayEvent>> tool_event(const RecordingReader& reader, const RecordedMessage& message,
                                                ToolRole role) {
  return pose_of(reader, message).map([role](const TrackerSample& sample) {
    return std::optional<ReplayEvent>(ToolPose{role, sample});
  });
}

Expected<std::optional<ReplayEvent>> r_trigger_event(const RecordingReader& reader, const RecordedMessage& message) {
  const auto recorded = reader.decode<perimap_RTriggerPulse>(message);
  if (!recorded) return tl::unexpected(recorded.error());
  RTriggerPulse pulse = to_r_trigger_pulse(**recorded);
  pulse.arrival = message.arrival;
  return pulse;
}

Expected<std::optional<ReplayEvent>> respiration_event(const RecordingReader& reader, const RecordedMessage& message) {
  const auto respiration = reader.decode<perimap_RespirationSamples>(message);
  if (!respiration) return tl::unexpected(respiration.error());
  auto block = to_respiration_block(**respiration);
  if (!block) return reader.wrong(message, block.error().message);
  block->arrival = message.arrival;
  return *block;
}

// Calls `instant` with each instant of an event, and `period` with the time from one of its samples to the next. A kind
// of event that no overload takes does not compile.
template <class OnInstant, class OnPeriod>
struct EachTime {
  OnInstant instant;
  OnPeriod period;

  void operator()(FrameEvent& frame) const {
    instant(frame.stamp.capture);
    instant(frame.stamp.arrival);
  }
  void operator()(TrackerSample& pose) const {
    instant(pose.source_time);
    instant(pose.arrival);
  }
  void operator()(ToolPose& pose) const { (*this)(pose.sample); }
  void operator()(SampleBlock& block) const {  // of the ECG or of respiration
    instant(block.first_sample_time);
    instant(block.arrival);
    period(block.sample_period);
  }
  void operator()(RTriggerPulse& pulse) const {
    instant(pulse.time);
    instant(pulse.arrival);
  }
};
template <class OnInstant, class OnPeriod>
EachTime(OnInstant, OnPeriod) -> EachTime<OnInstant, OnPeriod>;

struct ArrivalOf {
  Instant operator()(const FrameEvent& frame) const noexcept { return frame.stamp.arrival; }
  Instant operator()(const ToolPose& pose) const noexcept { return pose.sample.arrival; }
  template <class Event>
  Instant operator()(const Event& event) const noexcept {
    return event.arrival;
  }
};

}  // namespace

CameraFrame FrameEvent::as_it_came() const noexcept {
  CameraFrame frame;
  frame.stamp = stamp;
  frame.format = format;
  frame.width = width;
  frame.height = height;
  frame.stride = stride;
  frame.bytes = bytes;
  if (bytes.empty()) {
    frame.format = PixelFormat::kGrey;
    frame.stride = static_cast<std::size_t>(width);
    frame.bytes = std::as_bytes(std::span(pixels));
  }
  return frame;
}

Instant arrival_of(const ReplayEvent& event) { return std::visit(ArrivalOf(), event); }

void shift(ReplayEvent& event, Duration offset) {
  std::visit(EachTime{[offset](Instant& t) { t += offset; }, [](Duration& /*period*/) {}}, event);
}

void speed_up(ReplayEvent& event, Instant origin, double speed) {
  const auto faster = [speed](Duration d) { return from_seconds(to_seconds(d) / speed); };
  std::visit(EachTime{[&](Instant& t) { t = origin + faster(t - origin); }, [&](Duration& d) { d = faster(d); }},
             event);
}

std::vector<std::string_view> ReplayReader::sensor_channels(const RecordingReader& reader) {
  std::vector<std::string_view> wanted(kSensorChannels.begin(), kSensorChannels.end());
  for (const RecordedChannel& channel : reader.channels()) {
    for (const std::string_view optional : {channels::kSecondSensor, channels::kPatientTool, channels::kEcgSecondLead,
                                            channels::kRTrigger, channels::kRespirationSamples}) {
      if (channel.name == optional) wanted.push_back(optional);
    }
  }
  return wanted;
}

Expected<ReplayReader> ReplayReader::open(const std::string& path, ReadMode mode) {
  auto reader = RecordingReader::open(path, mode);
  if (!reader) return tl::unexpected(reader.error());
  const auto wanted = sensor_channels(*reader);
  return select(std::move(*reader), wanted);
}

Expected<ReplayReader> ReplayReader::open_with_tools(const std::string& path, ReadMode mode) {
  auto reader = RecordingReader::open(path, mode);
  if (!reader) return tl::unexpected(reader.error());
  std::vector<std::string> tools;
  for (const RecordedChannel& channel : reader->channels()) {
    if (channel.name != channels::kPointer && !channel.name.starts_with(channels::kInstruments)) continue;
    tools.emplace_back(channel.name.substr(channels::kTrackedTools.size()));
  }
  std::vector<std::string> names;
  for (const std::string& tool : tools) names.push_back(std::string(channels::kTrackedTools) + tool);
  auto wanted = sensor_channels(*reader);
  wanted.insert(wanted.end(), names.begin(), names.end());
  auto selected = select(std::move(*reader), wanted);
  if (selected) selected->tools_ = std::move(tools);
  return selected;
}

Expected<ReplayReader> ReplayReader::open(const std::string& path, ReadMode mode,
                                          std::span<const std::string_view> channels) {
  auto reader = RecordingReader::open(path, mode);
  if (!reader) return tl::unexpected(reader.error());
  return select(std::move(*reader), channels);
}

Expected<ReplayReader> ReplayReader::select(RecordingReader reader, std::span<const std::string_view> channels) {
  if (auto selected = reader.select(channels); !selected) return tl::unexpected(selected.error());
  return ReplayReader(std::move(reader));
}

bool ReplayReader::has(std::string_view channel) const {
  const auto all = reader_.channels();
  return std::any_of(all.begin(), all.end(), [&](const RecordedChannel& c) { return c.name == channel; });
}

Expected<std::optional<ReplayEvent>> ReplayReader::frame_event(const RecordedMessage& message) {
  if (const auto read = frame_.read(reader_, message); !read) return tl::unexpected(read.error());
  const auto image = frame_.grey();
  if (!image) {
    if (undecoded_++ == 0) first_undecoded_ = reader_.wrong(message, image.error().message).value();
    return std::optional<ReplayEvent>();
  }
  if (frame_width_ > 0 && (image->width != frame_width_ || image->height != frame_height_)) {
    return reader_.wrong(message, fmt::format("frame of {}x{}, the calibration is for {}x{}", image->width,
                                              image->height, frame_width_, frame_height_));
  }
  FrameEvent event;
  event.stamp = {message.sequence, message.source_time, message.arrival};
  event.width = image->width;
  event.height = image->height;
  event.pixels.resize(static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height));
  for (int y = 0; y < image->height; ++y) {
    std::copy_n(image->row(y), image->width,
                event.pixels.begin() + static_cast<std::ptrdiff_t>(y) * static_cast<std::ptrdiff_t>(image->width));
  }
  if (const ColourImage& colour = frame_.colour(); colour.bgr != nullptr) {
    event.bgr.assign(colour.bgr, colour.row(colour.height));
  }
  if (const CameraFrame& came = frame_.as_it_came(); keeps_frames_ && came.format != PixelFormat::kGrey) {
    event.format = came.format;
    event.stride = came.stride;
    event.bytes.assign(came.bytes.begin(), came.bytes.end());
  }
  return event;
}

// Of both leads at once.
Expected<std::optional<ReplayEvent>> ReplayReader::ecg_event(const RecordedMessage& message) {
  const auto ecg = reader_.decode<perimap_EcgSamples>(message);
  if (!ecg) return tl::unexpected(ecg.error());
  auto block = to_ecg_block(**ecg);
  if (!block) return reader_.wrong(message, block.error().message);
  if (message.channel == channels::kEcgSecondLead) {
    second_lead_ = *block;
    return std::optional<ReplayEvent>();
  }
  block->arrival = message.arrival;
  join_second_lead(second_lead_, *block);
  second_lead_ = {};
  return *block;
}

std::vector<Error> ReplayReader::damage() const {
  std::vector<Error> all = reader_.damage();
  if (undecoded_ > 0) {
    all.push_back({fmt::format("{} frames could not be decoded and are left out, the first: {}", undecoded_,
                               first_undecoded_.message)});
  }
  return all;
}

Expected<std::optional<ReplayEvent>> ReplayReader::other_tool_event(const RecordedMessage& message) {
  const auto pose = pose_of(reader_, message);
  if (!pose) return tl::unexpected(pose.error());
  ToolSample sample{*pose};
  const auto name = std::find(tools_.begin(), tools_.end(), message.channel.substr(channels::kTrackedTools.size()));
  sample.tool = static_cast<std::size_t>(name - tools_.begin());
  return std::optional<ReplayEvent>(sample);
}

Expected<std::optional<ReplayEvent>> ReplayReader::next() {
  for (;;) {
    const auto message = reader_.next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) return std::optional<ReplayEvent>();
    auto event = event_of(**message);
    if (!event || *event) return event;
  }
}

Expected<std::optional<ReplayEvent>> ReplayReader::event_of(const RecordedMessage& m) {
  if (m.arrival < last_arrival_) {
    return reader_.wrong(m, fmt::format("arrival {} ns lies before the message ahead of it", to_ns(m.arrival)));
  }
  if (m.source_time > m.arrival) {
    return reader_.wrong(
        m, fmt::format("arrival {} ns lies before its own source time {} ns", to_ns(m.arrival), to_ns(m.source_time)));
  }
  last_arrival_ = m.arrival;
  return m.channel == channels::kCameraImage                                                ? frame_event(m)
         : m.channel == channels::kTrackerPose                                              ? pose_event(reader_, m)
         : m.channel == channels::kPointer || m.channel.starts_with(channels::kInstruments) ? other_tool_event(m)
         : m.channel == channels::kSecondSensor ? tool_event(reader_, m, ToolRole::kSecondSensor)
         : m.channel == channels::kPatientTool  ? tool_event(reader_, m, ToolRole::kPatient)
         : m.channel == channels::kEcgSamples || m.channel == channels::kEcgSecondLead ? ecg_event(m)
         : m.channel == channels::kRTrigger                                            ? r_trigger_event(reader_, m)
                                                                                       : respiration_event(reader_, m);
}

}  // namespace perimap

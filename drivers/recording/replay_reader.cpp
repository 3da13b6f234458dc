#include "drivers/recording/replay_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/foxglove_image.hpp"

namespace perimap {
namespace {

constexpr std::array<std::string_view, 3> kSensorChannels = {channels::kCameraImage, channels::kTrackerPose,
                                                             channels::kEcgSamples};

std::string at(const std::string& path, const RecordedMessage& message) {
  return fmt::format("{}: byte {}: channel {}", path, message.file_offset, message.channel);
}

Expected<ReplayEvent> frame_event(const RecordingReader& reader, const std::string& path,
                                  const RecordedMessage& message) {
  const auto raw = reader.decode<foxglove_RawImage>(message);
  if (!raw) return tl::unexpected(raw.error());
  const auto image = borrow_grey_image(**raw);
  if (!image) return fail(fmt::format("{}: {}", at(path, message), image.error().message));
  FrameEvent event;
  event.stamp = {message.sequence, message.source_time, message.arrival};
  event.width = image->width;
  event.height = image->height;
  event.pixels.resize(static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height));
  for (int y = 0; y < image->height; ++y) {
    std::copy_n(image->row(y), image->width,
                event.pixels.begin() + static_cast<std::ptrdiff_t>(y) * static_cast<std::ptrdiff_t>(image->width));
  }
  return event;
}

ToolState tool_state(perimap_ToolState state) noexcept {
  switch (state) {
    case perimap_TOOL_OK:
      return ToolState::kOk;
    case perimap_TOOL_MISSING:
      return ToolState::kMissing;
    case perimap_TOOL_OUT_OF_VOLUME:
      return ToolState::kOutOfVolume;
    case perimap_TOOL_DISABLED:
      return ToolState::kDisabled;
  }
  return ToolState::kMissing;
}

Expected<ReplayEvent> pose_event(const RecordingReader& reader, const std::string& path,
                                 const RecordedMessage& message) {
  const auto pose = reader.decode<perimap_TrackerPose>(message);
  if (!pose) return tl::unexpected(pose.error());
  TrackerSample sample;
  sample.source_time = from_ns((*pose)->source_time_ns);
  sample.arrival = message.arrival;
  sample.device_frame = (*pose)->device_frame;
  sample.state = tool_state((*pose)->state);
  if (sample.state == ToolState::kOk) {
    const double(&t)[3] = (*pose)->translation_WS_mm;
    const double(&q)[4] = (*pose)->rotation_WS_wxyz;
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::abs(norm - 1.0) < 1e-3))
      return fail(fmt::format("{}: rotation is not a unit quaternion", at(path, message)));
    sample.X_WS = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), q);
  }
  return sample;
}

Expected<ReplayEvent> ecg_event(const RecordingReader& reader, const std::string& path,
                                const RecordedMessage& message) {
  const auto ecg = reader.decode<perimap_EcgSamples>(message);
  if (!ecg) return tl::unexpected(ecg.error());
  const auto& samples = (*ecg)->ecg_mV;
  if (samples._length > EcgBlock::kCapacity) {
    return fail(fmt::format("{}: {} samples in a block, at most {} can be taken", at(path, message), samples._length,
                            EcgBlock::kCapacity));
  }
  EcgBlock block;
  block.first_sample_time = from_ns((*ecg)->first_sample_time_ns);
  block.arrival = message.arrival;
  block.sample_period = Duration((*ecg)->sample_period_ns);
  block.device_sequence = (*ecg)->device_sequence;
  block.lead_off = (*ecg)->lead_off;
  block.count = samples._length;
  std::copy_n(samples._buffer, samples._length, block.mV.begin());
  return block;
}

}  // namespace

Instant arrival_of(const ReplayEvent& event) noexcept {
  if (const auto* frame = std::get_if<FrameEvent>(&event)) return frame->stamp.arrival;
  if (const auto* pose = std::get_if<TrackerSample>(&event)) return pose->arrival;
  return std::get<EcgBlock>(event).arrival;
}

void shift(ReplayEvent& event, Duration offset) noexcept {
  if (auto* frame = std::get_if<FrameEvent>(&event)) {
    frame->stamp.capture += offset;
    frame->stamp.arrival += offset;
  } else if (auto* pose = std::get_if<TrackerSample>(&event)) {
    pose->source_time += offset;
    pose->arrival += offset;
  } else if (auto* ecg = std::get_if<EcgBlock>(&event)) {
    ecg->first_sample_time += offset;
    ecg->arrival += offset;
  }
}

Expected<ReplayReader> ReplayReader::open(const std::string& path, ReadMode mode) {
  return open(path, mode, kSensorChannels);
}

Expected<ReplayReader> ReplayReader::open(const std::string& path, ReadMode mode,
                                          std::span<const std::string_view> channels) {
  auto reader = RecordingReader::open(path, mode);
  if (!reader) return tl::unexpected(reader.error());
  if (auto selected = reader->select(channels); !selected) return tl::unexpected(selected.error());
  return ReplayReader(std::move(*reader), path);
}

Expected<std::optional<ReplayEvent>> ReplayReader::next() {
  const auto message = reader_.next();
  if (!message) return tl::unexpected(message.error());
  if (!*message) return std::optional<ReplayEvent>();
  const RecordedMessage& m = **message;
  if (m.arrival < last_arrival_) {
    return fail(fmt::format("{}: arrival {} ns lies before the message ahead of it", at(path_, m), to_ns(m.arrival)));
  }
  if (m.source_time > m.arrival) {
    return fail(fmt::format("{}: arrival {} ns lies before its own source time {} ns", at(path_, m), to_ns(m.arrival),
                            to_ns(m.source_time)));
  }
  last_arrival_ = m.arrival;
  auto event = m.channel == channels::kCameraImage   ? frame_event(reader_, path_, m)
               : m.channel == channels::kTrackerPose ? pose_event(reader_, path_, m)
                                                     : ecg_event(reader_, path_, m);
  if (!event) return tl::unexpected(event.error());
  if (const auto* frame = std::get_if<FrameEvent>(&*event);
      frame != nullptr && frame_width_ > 0 && (frame->width != frame_width_ || frame->height != frame_height_)) {
    return fail(fmt::format("{}: frame of {}x{}, the calibration is for {}x{}", at(path_, m), frame->width,
                            frame->height, frame_width_, frame_height_));
  }
  return std::optional<ReplayEvent>(std::move(*event));
}

}  // namespace perimap

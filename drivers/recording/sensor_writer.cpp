#include "drivers/recording/sensor_writer.hpp"

#include <fmt/format.h>

#include <span>
#include <utility>

#include "drivers/file/group_access.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/foxglove_pose.hpp"
#include "drivers/recording/sensor_messages.hpp"

namespace perimap {

Expected<SensorWriter> SensorWriter::create(const std::string& path, const SensorRecordingFacts& facts, Instant begin) {
  auto writer = RecordingWriter::create(path);
  if (!writer) return tl::unexpected(std::move(writer.error()));
  if (!facts.readers.empty()) {
    if (auto shared = let_group_read(path, facts.readers); !shared) return tl::unexpected(std::move(shared.error()));
  }
  SensorWriter sensors(std::move(*writer), facts.world_frame);
  if (auto begun = sensors.begin(facts, begin); !begun) return tl::unexpected(std::move(begun.error()));
  return sensors;
}

template <class Message>
Expected<void> SensorWriter::add_optional(bool wanted, std::string_view name, std::optional<ChannelId>& place) {
  if (!wanted) return {};
  return writer_.add_channel<Message>(name).map([&place](ChannelId id) { place = id; });
}

Expected<void> SensorWriter::add_tools(const std::vector<std::string>& names) {
  tools_.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (auto added = add_optional<perimap_TrackerPose>(!names[i].empty(), names[i], tools_[i]); !added) return added;
  }
  return {};
}

Expected<void> SensorWriter::begin(const SensorRecordingFacts& facts, Instant begin) {
  const auto keep = [](ChannelId& place) { return [&place](ChannelId id) { place = id; }; };
  const auto attach = [this](std::string_view name, std::string_view type, const std::optional<std::string>& text) {
    return text ? writer_.write_attachment(name, type, std::as_bytes(std::span(*text))) : Expected<void>();
  };
  std::string generator = facts.generator;
  std::string description = facts.description;
  std::string world = facts.world_frame;
  const perimap_RecordingInfo info{generator.data(), description.data(), facts.utc_minus_monotonic.count(),
                                   world.data()};
  ChannelId info_channel;
  auto begun =
      writer_.add_channel<perimap_RecordingInfo>(channels::kRecordingInfo)
          .map(keep(info_channel))
          .and_then([&] { return writer_.add_channel<perimap_TrackerPose>(channels::kTrackerPose); })
          .map(keep(tracker_))
          .and_then([&] { return writer_.add_channel<foxglove_PoseInFrame>(channels::kTrackerViewer); })
          .map(keep(viewer_))
          .and_then([&] { return writer_.add_channel<perimap_EcgSamples>(channels::kEcgSamples); })
          .map(keep(ecg_))
          .and_then([&] {
            return add_optional<perimap_EcgSamples>(facts.second_lead, channels::kEcgSecondLead, second_lead_);
          })
          .and_then(
              [&] { return add_optional<perimap_RTriggerPulse>(facts.r_trigger, channels::kRTrigger, r_trigger_); })
          .and_then([&] {
            return add_optional<perimap_RespirationSamples>(facts.respiration, channels::kRespirationSamples,
                                                            respiration_);
          })
          .and_then([&] { return add_tools(facts.tools); })
          .and_then([&] { return attach(attachments::kCalibration, "application/yaml", facts.calibration); })
          .and_then([&] { return attach(attachments::kConfiguration, "application/toml", facts.configuration); })
          .and_then([&] { return attach(attachments::kTurnedScope, "application/json", facts.turned_scope); })
          .and_then([&] { return attach(attachments::kVerification, "application/json", facts.verification); })
          .and_then([&]() -> Expected<void> {
            for (const auto& [tool, text] : facts.tips) {
              const std::string name = std::string(attachments::kTips) + tool + ".json";
              if (auto attached = attach(name, "application/json", text); !attached) return attached;
            }
            return {};
          })
          .and_then([&] { return writer_.write(info_channel, info, begin, begin, 0); });
  // On the disk at once: a crash must not lose what the rest is read by.
  return begun.and_then([this] { return flush(); });
}

Expected<ChannelId> SensorWriter::camera_channel(bool compressed) {
  if (camera_ && compressed != compressed_) return fail("the camera changed between JPEG and raw frames");
  if (camera_) return *camera_;
  auto channel = compressed ? writer_.add_channel<foxglove_CompressedImage>(channels::kCameraImage)
                            : writer_.add_channel<foxglove_RawImage>(channels::kCameraImage);
  if (!channel) return channel;
  camera_ = *channel;
  compressed_ = compressed;
  return channel;
}

Expected<void> SensorWriter::write(const CameraFrame& frame, Instant arrival) {
  const bool compressed = frame.format == PixelFormat::kMjpg;
  const auto channel = camera_channel(compressed);
  if (!channel) return tl::unexpected(channel.error());
  const auto sequence = static_cast<std::uint32_t>(frame.stamp.sequence);
  if (compressed) {
    return writer_.write(*channel, borrow_compressed_image(frame, camera_frame_), arrival, frame.stamp.capture,
                         sequence);
  }
  return writer_.write(*channel, borrow_raw_image(frame, camera_frame_), arrival, frame.stamp.capture, sequence);
}

Expected<void> SensorWriter::write(const TrackerSample& sample, Instant arrival) {
  auto written = writer_.write(tracker_, to_tracker_pose(sample), arrival, sample.source_time, sample.device_frame);
  if (!written || sample.state != ToolState::kOk) return written;
  const auto viewer = borrow_pose_in_frame(sample.X_WS, sample.source_time, world_frame_);
  return writer_.write(viewer_, viewer, arrival, sample.source_time, sample.device_frame);
}

Expected<void> SensorWriter::write(const ToolSample& sample, Instant arrival) {
  if (sample.tool >= tools_.size() || !tools_[sample.tool]) {
    return fail(fmt::format("tool {} came, and the recording has no channel for it", sample.tool));
  }
  return writer_.write(*tools_[sample.tool], to_tracker_pose(sample), arrival, sample.source_time, sample.device_frame);
}

Expected<void> SensorWriter::write(const EcgBlock& block, Instant arrival) {
  if (block.has_second) {
    if (!second_lead_) return fail("a second lead came, and the recording has no channel for one");
    auto written = writer_.write(*second_lead_, borrow_second_lead(block), arrival, block.first_sample_time,
                                 block.device_sequence);
    if (!written) return written;
  }
  return writer_.write(ecg_, borrow_ecg_samples(block), arrival, block.first_sample_time, block.device_sequence);
}

Expected<void> SensorWriter::write(const RTriggerPulse& pulse, Instant arrival) {
  if (!r_trigger_) return fail("an R trigger came, and the recording has no channel for one");
  return writer_.write(*r_trigger_, to_r_trigger_message(pulse), arrival, pulse.time, pulse.device_count);
}

Expected<void> SensorWriter::write(const RespirationBlock& block, Instant arrival) {
  if (!respiration_) return fail("respiration came, and the recording has no channel for it");
  return writer_.write(*respiration_, borrow_respiration_samples(block), arrival, block.first_sample_time,
                       block.device_sequence);
}

}  // namespace perimap

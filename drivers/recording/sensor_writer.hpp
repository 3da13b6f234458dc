// What the devices gave, as it came, into a recording that replays.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/r_trigger_pulse.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/recording/recording_writer.hpp"

namespace perimap {

// What holds for a whole recording.
struct SensorRecordingFacts {
  std::string generator;    // program and version
  std::string description;  // where it comes from
  std::string world_frame;
  std::string readers;  // a group that may read the file beside its owner; empty: none
  Duration utc_minus_monotonic{0};
  std::optional<std::string> calibration;     // the camera's, as OpenCV writes it
  std::optional<std::string> configuration;   // of perimapd, TOML
  std::optional<std::string> turned_scope{};  // where the scope is turned in its camera head, as calibrated
  std::optional<std::string> verification{};  // what perimap verify said last of the set-up, JSON
  bool r_trigger = false;                     // there is a trigger whose pulses may come
  bool respiration = false;                   // there is a respiration channel
  bool second_lead = false;                   // the ECG has two leads
  std::vector<std::string> tools = {};  // channels of other tracked tools, by ToolSample::tool; empty: not recorded
  // Of tools, by their names ("instrument/NAME"): their tips, as `perimap calibrate tool --output` writes them.
  std::vector<std::pair<std::string, std::string>> tips = {};
};

// Not for the real-time path. Messages must be written in order of `arrival`, which a replay keeps to; it is not before
// a sample's own. Errors name the file; after one nothing more is written.
class SensorWriter {
 public:
  [[nodiscard]] static Expected<SensorWriter> create(const std::string& path, const SensorRecordingFacts& facts,
                                                     Instant begin);

  // In the camera's own format: as foxglove::RawImage, or as CompressedImage when it is a JPEG.
  [[nodiscard]] Expected<void> write(const CameraFrame& frame, Instant arrival);
  // Valid poses also for viewers.
  [[nodiscard]] Expected<void> write(const TrackerSample& sample, Instant arrival);
  // Only of a tool that the facts named.
  [[nodiscard]] Expected<void> write(const ToolSample& sample, Instant arrival);
  // A second lead only where the facts named one.
  [[nodiscard]] Expected<void> write(const EcgBlock& block, Instant arrival);
  // Only of a trigger that the facts named.
  [[nodiscard]] Expected<void> write(const RTriggerPulse& pulse, Instant arrival);
  // Only of a channel that the facts named.
  [[nodiscard]] Expected<void> write(const RespirationBlock& block, Instant arrival);

  // What was written so far survives a crash of the process.
  [[nodiscard]] Expected<void> flush() { return writer_.flush(); }
  [[nodiscard]] Expected<void> finish() { return writer_.finish(); }

 private:
  SensorWriter(RecordingWriter writer, std::string world_frame)
      : writer_(std::move(writer)), world_frame_(std::move(world_frame)) {}

  [[nodiscard]] Expected<void> begin(const SensorRecordingFacts& facts, Instant begin);
  [[nodiscard]] Expected<void> add_tools(const std::vector<std::string>& names);
  template <class Message>
  [[nodiscard]] Expected<void> add_optional(bool wanted, std::string_view name, std::optional<ChannelId>& place);
  [[nodiscard]] Expected<ChannelId> camera_channel(bool compressed);

  RecordingWriter writer_;
  std::string camera_frame_ = "camera";
  std::string world_frame_;
  std::optional<ChannelId> camera_;  // its type is known with the first frame
  bool compressed_ = false;
  ChannelId tracker_, viewer_, ecg_;
  std::vector<std::optional<ChannelId>> tools_;  // by ToolSample::tool
  std::optional<ChannelId> second_lead_, r_trigger_, respiration_;
};

}  // namespace perimap

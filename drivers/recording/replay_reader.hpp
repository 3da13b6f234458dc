// The sensors' messages of a recording as the values that sources push into the pipeline, in order of arrival.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/sensors/r_trigger_pulse.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recorded_frame.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

struct FrameEvent {
  FrameStamp stamp;
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  // rows without gaps
  std::vector<std::uint8_t> bgr;     // reduced, rows without gaps; empty in most frames, and without colour in all
  // As the camera gave it, where that is kept and was not in grey.
  PixelFormat format = PixelFormat::kGrey;
  std::size_t stride = 0;
  std::vector<std::byte> bytes;

  [[nodiscard]] GreyImage image() const noexcept { return {pixels.data(), width, height, width}; }
  [[nodiscard]] ColourImage colour() const noexcept {
    if (bgr.empty()) return {};
    return {bgr.data(), reduced_side(width), reduced_side(height),
            static_cast<std::ptrdiff_t>(reduced_row_bytes(width))};
  }
  // In grey where it is not kept.
  [[nodiscard]] CameraFrame as_it_came() const noexcept;
};

using ReplayEvent =
    std::variant<FrameEvent, TrackerSample, ToolPose, EcgBlock, RTriggerPulse, RespirationBlock, ToolSample>;

// A silence of all devices that is longer is a break in the session, however long: a replay goes on after so much of
// it. Of what was known before nothing holds then; a phase is lost within seconds.
inline constexpr Duration kLongestReplayedGap = std::chrono::seconds(60);

[[nodiscard]] Instant arrival_of(const ReplayEvent& event);
// The same event with all its instants moved by `offset`.
void shift(ReplayEvent& event, Duration offset);
// The same event as of clocks that run `speed` times as fast from `origin` on.
void speed_up(ReplayEvent& event, Instant origin, double speed);

// Errors have the form "FILE: byte N: channel NAME: what is wrong". Messages lie in the file in order of arrival; one
// that goes back, or that arrives before it was measured, is an error: replay could not deliver it at its time. A frame
// that cannot be decoded is left out, as it was when it was recorded: a gap in the count.
class ReplayReader {
 public:
  // Fails when the recording has no camera, tracker or ECG channel. Poses of tools that have a role, triggers and
  // breaths are given where there are any.
  [[nodiscard]] static Expected<ReplayReader> open(const std::string& path, ReadMode mode);
  // Those and, of each other tracked tool that has a tip, its readings: ToolSample::tool is its place in tools().
  [[nodiscard]] static Expected<ReplayReader> open_with_tools(const std::string& path, ReadMode mode);
  // Of these of the sensors' channels alone; fails when one of them is not there.
  [[nodiscard]] static Expected<ReplayReader> open(const std::string& path, ReadMode mode,
                                                   std::span<const std::string_view> channels);

  // Whether a trigger was recorded, were it without a pulse; a second sensor or a respiration channel, likewise.
  [[nodiscard]] bool has_r_trigger() const { return has(channels::kRTrigger); }
  [[nodiscard]] bool has_second_sensor() const { return has(channels::kSecondSensor); }
  [[nodiscard]] bool has_respiration() const { return has(channels::kRespirationSamples); }

  // Names of the tools that it was opened with, as those of a live tracker: "pointer", "instrument/NAME".
  [[nodiscard]] const std::vector<std::string>& tools() const noexcept { return tools_; }

  // The next event; nullopt at the end. Channels other than the sensors' are passed over.
  [[nodiscard]] Expected<std::optional<ReplayEvent>> next();

  // From now on frames keep what they came as.
  void keep_frames_as_they_came() noexcept { keeps_frames_ = true; }

  // From now on a frame of another size is an error.
  void require_frame_size(int width, int height) noexcept {
    frame_width_ = width;
    frame_height_ = height;
  }

  // What is damaged, of the file with ReadMode::kWhole and of the frames. Complete once next() has given nullopt.
  [[nodiscard]] std::vector<Error> damage() const;

 private:
  explicit ReplayReader(RecordingReader reader) : reader_(std::move(reader)) {}

  [[nodiscard]] bool has(std::string_view channel) const;
  [[nodiscard]] static std::vector<std::string_view> sensor_channels(const RecordingReader& reader);
  [[nodiscard]] Expected<std::optional<ReplayEvent>> other_tool_event(const RecordedMessage& message);
  [[nodiscard]] static Expected<ReplayReader> select(RecordingReader reader,
                                                     std::span<const std::string_view> channels);
  [[nodiscard]] Expected<std::optional<ReplayEvent>> event_of(const RecordedMessage& message);
  [[nodiscard]] Expected<std::optional<ReplayEvent>> frame_event(const RecordedMessage& message);
  [[nodiscard]] Expected<std::optional<ReplayEvent>> ecg_event(const RecordedMessage& message);

  RecordingReader reader_;
  std::vector<std::string> tools_;
  RecordedFrame frame_;
  EcgBlock second_lead_;  // the last one; it waits for the first lead's
  bool keeps_frames_ = false;
  std::uint64_t undecoded_ = 0;
  Error first_undecoded_;
  Instant last_arrival_;
  int frame_width_ = 0;
  int frame_height_ = 0;
};

}  // namespace perimap

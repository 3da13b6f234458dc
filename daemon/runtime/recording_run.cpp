#include "daemon/runtime/recording_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/runtime/configured_scope.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

// One in which a board is seen by a lens that is yet to be measured has no calibration.
bool is_without_calibration(const std::string& recording) {
  const auto reader = RecordingReader::open(recording, ReadMode::kStrict);
  if (!reader) return false;  // which is said where it is read
  const auto names = reader->attachment_names();
  return std::find(names.begin(), names.end(), attachments::kCalibration) == names.end();
}

}  // namespace

SetupExpected<RecordingBasis> recording_basis(const std::string& configuration_file) {
  auto given = load_configuration(configuration_file);
  if (!given) return wrong_setup(std::move(given.error()));
  const auto& played = given->camera.playback;
  // What is played without a lens is recorded as a camera's frames are of which none is named.
  if (played && (given->camera.calibration || !is_without_calibration(played->string()))) {
    auto recorded = recorded_basis(given->camera.playback->string(), configuration_file, ReadMode::kStrict);
    if (!recorded) return tl::unexpected(std::move(recorded.error()));
    return RecordingBasis{std::move(recorded->configuration), recorded->camera, recorded->turned_scope};
  }
  RecordingBasis basis{std::move(*given), std::nullopt, std::nullopt};
  if (basis.configuration.camera.calibration) {
    auto camera = read_calibration(*basis.configuration.camera.calibration);
    if (!camera) return wrong_setup(told_in(configuration_file, {{"camera.calibration", camera.error().message}}));
    basis.camera = *camera;
    auto scope = configured_scope(basis.configuration, *camera);
    if (!scope) return wrong_setup(told_in(configuration_file, std::move(scope.error())));
    basis.turned_scope = *scope;
  }
  return basis;
}

std::string progress_line(const SessionRecorder& recorder, Duration elapsed) {
  const SessionRecorder::Summary summary = recorder.summary();
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(recorder.file(), error);
  const double megabytes = error ? 0.0 : static_cast<double>(bytes) / 1e6;
  return fmt::format("{:.0f} s: {} messages recorded, {:.0f} MB; not recorded: {} frames, {} others",
                     to_seconds(elapsed), summary.recorded, megabytes, summary.frames_not_recorded,
                     summary.other_not_recorded);
}

void record_until_ended(DeviceFeeder& feeder, StopSignal& stop, std::optional<Duration> limit,
                        const std::function<void(const std::string&)>& tell) {
  constexpr Duration kRecordingTick = std::chrono::milliseconds(100);
  constexpr Duration kReport = std::chrono::seconds(5);
  const Instant start = MonotonicClock::now();
  Instant reported = start;
  while (!stop.wait_for(kRecordingTick) && !feeder.ended()) {
    feeder.tick();
    const Instant now = MonotonicClock::now();
    if (feeder.recorder()->summary().stopped) return;
    if (limit && now - start >= *limit) return;
    if (now - reported < kReport) continue;
    reported = now;
    tell(progress_line(*feeder.recorder(), now - start));
  }
}

}  // namespace perimap

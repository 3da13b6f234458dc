#include "daemon/evaluation/report/samples_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "daemon/evaluation/report/recorded_beats.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

Duration quantile(const std::vector<Duration>& sorted, double q) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

DurationFigures figures_of(std::vector<Duration> durations) {
  if (durations.empty()) return {};
  std::sort(durations.begin(), durations.end());
  return {quantile(durations, 0.50), quantile(durations, 0.99), durations.back()};
}

}  // namespace

Expected<SamplesReport> report_samples(const std::string& recording, const std::string& samples,
                                       const std::string& stream, ReadMode mode, const std::optional<Pose>& X_IW) {
  const auto truth = load_truth(recording, mode, X_IW);
  if (!truth) return tl::unexpected(truth.error());
  if (!*truth) return fail(fmt::format("{}: has no ground truth to compare with", recording));
  auto reader = RecordingReader::open(samples, mode);
  if (!reader) return tl::unexpected(reader.error());
  constexpr std::array<std::string_view, 2> kPublished = {channels::kSurface, channels::kSurfaceModel};
  if (auto selected = reader->select(kPublished); !selected) return tl::unexpected(selected.error());

  auto beats = load_beats(recording, mode);
  if (!beats) return tl::unexpected(std::move(beats.error()));
  Accuracy accuracy((*truth)->truth, (*truth)->camera, (*truth)->captures.begin()->second);
  accuracy.set_beats(*std::move(beats));
  SamplesReport report;
  std::string wanted = stream;
  std::optional<Duration> to_recording;
  std::optional<std::uint64_t> last_sequence;
  std::vector<Duration> from_capture;
  std::vector<Duration> from_release;
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    if ((*message)->channel == channels::kSurfaceModel) {
      const auto model = reader->decode<perimap_SurfaceModel>(**message);
      if (!model) return tl::unexpected(model.error());
      accuracy.add(**model);
      continue;
    }
    const auto sample = reader->decode<perimap_Surface>(**message);
    if (!sample) return tl::unexpected(sample.error());
    const perimap_Surface& surface = **sample;
    if (wanted.empty()) wanted = surface.stream;
    if (wanted != surface.stream) {
      if (!stream.empty()) continue;
      return fail(fmt::format("{}: holds the streams '{}' and '{}': --stream tells which is meant", samples, wanted,
                              surface.stream));
    }
    const Instant receipt = (*message)->arrival;
    ++report.samples;
    if (last_sequence && surface.sample_sequence > *last_sequence + 1) {
      report.missed += surface.sample_sequence - *last_sequence - 1;
    }
    last_sequence = surface.sample_sequence;
    from_capture.push_back(receipt - from_ns(surface.capture_time_ns));
    from_release.push_back(receipt - from_ns(surface.release_time_ns));
    if (surface.reason == perimap_SURFACE_REASON_FRAME_MISSING) ++report.without_frame;
    // A sample of the clock's belongs to the frame that it rests on, so that only its reason tells.
    const bool behind = surface.oldest_shard_frame_sequence < surface.frame_sequence;
    const bool late = behind && surface.reason != perimap_SURFACE_REASON_FRAME_MISSING;
    if (late || surface.reason == perimap_SURFACE_REASON_UPDATE_LATE) ++report.from_late_update;
    if (!to_recording && rests_on_its_frame(surface.reason)) {
      to_recording = (*truth)->to_recording(surface.frame_sequence, from_ns(surface.capture_time_ns));
    }
    accuracy.add(surface);
  }
  if (!to_recording) return fail(fmt::format("{}: holds no surface of a frame of {}", samples, recording));
  report.accuracy = accuracy.report(*to_recording);
  report.capture_to_receipt = figures_of(std::move(from_capture));
  report.release_to_receipt = figures_of(from_release);
  for (Duration& d : from_release) d = std::chrono::abs(d - report.release_to_receipt.p50);
  report.jitter = figures_of(std::move(from_release));
  return report;
}

}  // namespace perimap

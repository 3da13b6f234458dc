#include "daemon/evaluation/report/recorded_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>
#include <vector>

#include "drivers/calibration/calibration_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/standins/truth/truth_messages.hpp"

namespace perimap {

Expected<std::optional<RecordedTruth>> load_truth(const std::string& recording, ReadMode mode,
                                                  const std::optional<Pose>& X_IW) {
  constexpr std::array<std::string_view, 3> kTruth = {channels::kTruthMesh, channels::kTruthMotion,
                                                      channels::kTruthCamera};
  // Of a procedure, and of a motion trace, where there was one.
  constexpr std::array<std::string_view, 3> kSometimes = {channels::kTruthProcedure, channels::kTruthEvent,
                                                          channels::kTruthTrace};
  auto reader = RecordingReader::open(recording, mode);
  if (!reader) return tl::unexpected(reader.error());
  const auto recorded = reader->channels();
  const auto is_there = [&recorded](std::string_view name) {
    return std::any_of(recorded.begin(), recorded.end(), [name](const RecordedChannel& c) { return c.name == name; });
  };
  if (!std::all_of(kTruth.begin(), kTruth.end(), is_there)) return std::optional<RecordedTruth>();
  std::vector<std::string_view> wanted(kTruth.begin(), kTruth.end());
  std::copy_if(kSometimes.begin(), kSometimes.end(), std::back_inserter(wanted), is_there);
  const auto calibration = reader->attachment(attachments::kCalibration);
  if (!calibration) return tl::unexpected(calibration.error());
  const auto camera = parse_calibration(*calibration, fmt::format("{}:{}", recording, attachments::kCalibration));
  if (!camera) return tl::unexpected(camera.error());

  if (auto selected = reader->select(wanted); !selected) return tl::unexpected(selected.error());
  std::optional<HeartMesh> mesh;
  std::optional<HeartMotion> motion;
  std::vector<CameraTruth> cameras;
  std::map<std::uint64_t, Instant> captures;
  std::optional<Sample<perimap_TruthProcedure>> procedure;
  std::vector<RecordedEvent> events;
  SurfaceTrace trace;
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    const RecordedMessage& m = **message;
    if (m.channel == channels::kTruthMesh) {
      const auto sample = reader->decode<perimap_TruthMesh>(m);
      if (!sample) return tl::unexpected(sample.error());
      auto value = heart_mesh(**sample);
      if (!value) return tl::unexpected(value.error());
      mesh = std::move(*value);
    } else if (m.channel == channels::kTruthMotion) {
      const auto sample = reader->decode<perimap_TruthMotion>(m);
      if (!sample) return tl::unexpected(sample.error());
      auto value = heart_motion(**sample);
      if (!value) return tl::unexpected(value.error());
      motion = std::move(*value);
    } else if (m.channel == channels::kTruthProcedure) {
      auto sample = reader->decode<perimap_TruthProcedure>(m);
      if (!sample) return tl::unexpected(sample.error());
      procedure = *std::move(sample);
    } else if (m.channel == channels::kTruthTrace) {
      const auto sample = reader->decode<perimap_TruthTrace>(m);
      if (!sample) return tl::unexpected(sample.error());
      auto value = surface_trace(**sample);
      if (!value) return tl::unexpected(value.error());
      trace = *std::move(value);
    } else if (m.channel == channels::kTruthEvent) {
      const auto sample = reader->decode<perimap_TruthEvent>(m);
      if (!sample) return tl::unexpected(sample.error());
      const perimap_TruthEvent& event = **sample;
      if (event.end_time_ns < event.begin_time_ns) return reader->wrong(m, "the event ends before it begins");
      events.push_back(
          {event.kind, event.words, from_ns(event.begin_time_ns), from_ns(event.end_time_ns), event.hides});
    } else {
      const auto sample = reader->decode<perimap_TruthCamera>(m);
      if (!sample) return tl::unexpected(sample.error());
      const auto value = camera_truth(**sample);
      if (!value) return tl::unexpected(value.error());
      cameras.push_back(*value);
      captures.emplace(m.sequence, value->capture);
    }
  }
  if (!mesh || !motion || cameras.empty()) return fail(fmt::format("{}: its ground truth is not complete", recording));
  if (X_IW) {
    if (procedure || !trace.empty()) {
      return fail(
          fmt::format("{}: is moved by a procedure or a trace in the tracker's frame; expected a registration "
                      "of none",
                      recording));
    }
    mesh = transformed(*X_IW, std::move(*mesh));
    motion->respiration_mm = X_IW->R * motion->respiration_mm;
    for (CameraTruth& seen : cameras) seen.X_WC = *X_IW * seen.X_WC;
  }
  auto truth = GroundTruth::create(std::move(*mesh), std::move(*motion), std::move(cameras));
  if (!truth) return fail(fmt::format("{}: {}", recording, truth.error().message));
  if (const auto good = truth->set_trace(std::move(trace)); !good) {
    return fail(fmt::format("{}: {}", recording, good.error().message));
  }
  if (procedure) {
    if (const auto good = set_procedure(**procedure, *truth); !good) {
      return fail(fmt::format("{}: {}", recording, good.error().message));
    }
  }
  return std::optional<RecordedTruth>(
      RecordedTruth{std::move(*truth), *camera, std::move(captures), std::move(events)});
}

}  // namespace perimap

#include "daemon/evaluation/report/recorded_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "drivers/calibration/calibration_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/standins/truth/truth_messages.hpp"

namespace perimap {

Expected<std::optional<RecordedTruth>> load_truth(const std::string& recording, ReadMode mode) {
  constexpr std::array<std::string_view, 3> kTruth = {channels::kTruthMesh, channels::kTruthMotion,
                                                      channels::kTruthCamera};
  auto reader = RecordingReader::open(recording, mode);
  if (!reader) return tl::unexpected(reader.error());
  const auto recorded = reader->channels();
  for (const std::string_view name : kTruth) {
    const bool there =
        std::any_of(recorded.begin(), recorded.end(), [name](const RecordedChannel& c) { return c.name == name; });
    if (!there) return std::optional<RecordedTruth>();
  }
  const auto calibration = reader->attachment(attachments::kCalibration);
  if (!calibration) return tl::unexpected(calibration.error());
  const auto camera = parse_calibration(*calibration, fmt::format("{}:{}", recording, attachments::kCalibration));
  if (!camera) return tl::unexpected(camera.error());

  if (auto selected = reader->select(kTruth); !selected) return tl::unexpected(selected.error());
  std::optional<HeartMesh> mesh;
  std::optional<HeartMotion> motion;
  std::vector<CameraTruth> cameras;
  std::map<std::uint64_t, Instant> captures;
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
  auto truth = GroundTruth::create(std::move(*mesh), std::move(*motion), std::move(cameras));
  if (!truth) return fail(fmt::format("{}: {}", recording, truth.error().message));
  return std::optional<RecordedTruth>(RecordedTruth{std::move(*truth), *camera, std::move(captures)});
}

}  // namespace perimap

#include "drivers/emulator/played_recording.hpp"

#include <array>
#include <utility>
#include <variant>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

Expected<PlayedRecording> PlayedRecording::read(const std::string& path) {
  PlayedRecording played;
  auto all = ReplayReader::open(path, ReadMode::kStrict);
  if (!all) return tl::unexpected(std::move(all.error()));
  const auto first = all->next();
  if (!first) return tl::unexpected(first.error());
  if (!*first) return fail(path + ": the recording is empty");
  played.first_arrival_ = arrival_of(**first);

  // Without the frames, which are nearly all of it.
  constexpr std::array<std::string_view, 2> kChannels{channels::kTrackerPose, channels::kEcgSamples};
  auto reader = ReplayReader::open(path, ReadMode::kStrict, kChannels);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  for (;;) {
    auto event = reader->next();
    if (!event) return tl::unexpected(std::move(event.error()));
    if (!*event) break;
    if (const auto* sample = std::get_if<TrackerSample>(&**event)) played.tracker_.push_back(*sample);
    if (const auto* block = std::get_if<EcgBlock>(&**event)) played.ecg_.push_back(*block);
  }
  if (played.tracker_.empty() || played.ecg_.empty()) return fail(path + ": holds no poses or no ECG");
  return played;
}

PoseTrack PlayedRecording::poses(Instant start) const {
  return PoseTrack::of_samples(start + (tracker_.front().source_time - first_arrival_), tracker_);
}

EcgWaveform PlayedRecording::ecg(Instant start) const {
  std::vector<float> mV;
  for (const EcgBlock& block : ecg_) mV.insert(mV.end(), block.samples().begin(), block.samples().end());
  const double rate_hz = 1.0 / to_seconds(ecg_.front().sample_period);
  return EcgWaveform(start + (ecg_.front().first_sample_time - first_arrival_), rate_hz, std::move(mV), false);
}

}  // namespace perimap

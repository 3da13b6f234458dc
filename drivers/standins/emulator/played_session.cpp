#include "drivers/standins/emulator/played_session.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/recording/topic.hpp"
#include "drivers/recording/tracker_samples.hpp"

namespace perimap {

Expected<PlayedSession> PlayedSession::read(const std::string& path) {
  PlayedSession played;
  auto all = ReplayReader::open(path, ReadMode::kStrict);
  if (!all) return tl::unexpected(std::move(all.error()));
  const auto first = all->next();
  if (!first) return tl::unexpected(first.error());
  if (!*first) return fail(path + ": the recording is empty");
  played.first_arrival_ = arrival_of(**first);

  // Without the frames, which are nearly all of it.
  std::vector<std::string_view> wanted{channels::kTrackerPose, channels::kEcgSamples};
  if (all->has_respiration()) wanted.push_back(channels::kRespirationSamples);
  auto reader = ReplayReader::open(path, ReadMode::kStrict, wanted);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  for (;;) {
    auto event = reader->next();
    if (!event) return tl::unexpected(std::move(event.error()));
    if (!*event) break;
    if (const auto* sample = std::get_if<TrackerSample>(&**event)) played.tracker_.push_back(*sample);
    if (const auto* block = std::get_if<EcgBlock>(&**event)) played.ecg_.push_back(*block);
    if (const auto* block = std::get_if<RespirationBlock>(&**event)) played.respiration_.push_back(*block);
  }
  if (played.tracker_.empty() || played.ecg_.empty()) return fail(path + ": holds no poses or no ECG");
  if (auto tools = played.read_tools(path); !tools) return tl::unexpected(std::move(tools.error()));
  return played;
}

Expected<void> PlayedSession::read_tools(const std::string& path) {
  auto reader = RecordingReader::open(path);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  for (const RecordedChannel& channel : reader->channels()) {
    if (!channel.name.starts_with(channels::kTrackedTools) || channel.name == channels::kTrackerPose) continue;
    if (channel.type != topic_type<perimap_TrackerPose>().schema_name()) continue;
    const std::string name = channel.name.substr(channels::kTrackedTools.size());
    if (name != "reference") tools_.emplace_back(name, std::vector<TrackerSample>());
  }
  for (auto& [name, samples] : tools_) {
    const std::string channel = std::string(channels::kTrackedTools) + name;
    auto recorded = read_tracker_samples(*reader, channel);
    if (!recorded) return tl::unexpected(std::move(recorded.error()));
    for (const TrackerSample& sample : *recorded) {
      // A track is in order of time.
      if (samples.empty() || sample.source_time > samples.back().source_time) samples.push_back(sample);
    }
  }
  std::erase_if(tools_, [](const auto& tool) { return tool.second.empty(); });
  return {};
}

PlayedSession PlayedSession::of(const Simulation& simulation, const TrackerNoise& noise) {
  PlayedSession played;
  played.first_arrival_ = simulation.arrivals().front().arrival;
  for (std::size_t i = 0; i < simulation.tracker_sample_count(); ++i) {
    played.tracker_.push_back(simulation.tracker_sample(i, noise));
  }
  played.ecg_.assign(simulation.ecg().begin(), simulation.ecg().end());
  played.respiration_.assign(simulation.respiration().begin(), simulation.respiration().end());
  return played;
}

PoseTrack PlayedSession::poses(Instant start) const {
  return PoseTrack::of_samples(start + (tracker_.front().source_time - first_arrival_), tracker_);
}

std::vector<std::pair<std::string, PoseTrack>> PlayedSession::tools(Instant start) const {
  std::vector<std::pair<std::string, PoseTrack>> tracks;
  for (const auto& [name, samples] : tools_) {
    tracks.emplace_back(name, PoseTrack::of_samples(start + (samples.front().source_time - first_arrival_), samples));
  }
  return tracks;
}

EcgDeviceSignals PlayedSession::ecg_device(Instant start) const {
  const Duration offset = start - first_arrival_;
  EcgDeviceSignals signals{SampledWaveform(ecg_, offset)};
  if (std::any_of(ecg_.begin(), ecg_.end(), [](const EcgBlock& block) { return block.has_second; })) {
    signals.second_mV = SampledWaveform::second_lead(ecg_, offset);
  }
  if (!respiration_.empty()) signals.respiration.emplace(respiration_, offset);
  return signals;
}

}  // namespace perimap

#include "daemon/evaluation/replay/replay_publication.hpp"

#include "core/pipeline/pipeline.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {

ReplayPublication::ReplayPublication(const RecordedTruth* truth, const std::vector<RPeak>& beats,
                                     PublicationRecorder* recorder, Publication* dds)
    : recorder_(recorder), dds_(dds), truth_(truth) {
  if (truth == nullptr) return;
  for (std::size_t i = 0; i < kReleaseStreams.size(); ++i) {
    accuracies_.emplace_back(truth->truth, truth->camera, truth->captures.begin()->second).set_beats(beats);
  }
}

void ReplayPublication::judge_tools(const ToolTruths& truths) {
  for (const auto& [tool, truth] : truths) tools_.emplace(tool, truth);
}

std::map<std::string, ToolFigures> ReplayPublication::tools() const {
  std::map<std::string, ToolFigures> all;
  for (const auto& [tool, tally] : tools_) all.emplace(tool, tally.figures());
  return all;
}

void ReplayPublication::surface(const perimap_Surface& sample) {
  if (recorder_ != nullptr) recorder_->surface(sample);
  if (dds_ != nullptr) dds_->surface(sample);
  if (accuracies_.empty()) return;
  if (!to_recording_ && rests_on_its_frame(sample.reason)) {
    to_recording_ = truth_->to_recording(sample.frame_sequence, from_ns(sample.capture_time_ns));
  }
  const bool clock = sample.stream == name_of(ReleaseStream::kClock);
  accuracies_[index_of(clock ? ReleaseStream::kClock : ReleaseStream::kFrame)].add(sample);
}

void ReplayPublication::surface_model(const perimap_SurfaceModel& model) {
  if (recorder_ != nullptr) recorder_->surface_model(model);
  if (dds_ != nullptr) dds_->surface_model(model);
  for (Accuracy& accuracy : accuracies_) accuracy.add(model);
}

void ReplayPublication::surface_mesh(const perimap_SurfaceMesh& mesh) {
  if (recorder_ != nullptr) recorder_->surface_mesh(mesh);
  if (dds_ != nullptr) dds_->surface_mesh(mesh);
}

void ReplayPublication::tool(const perimap_ToolDistance& distance) {
  if (recorder_ != nullptr) recorder_->tool(distance);
  if (dds_ != nullptr) dds_->tool(distance);
  if (const auto tally = tools_.find(distance.tool); tally != tools_.end()) tally->second.add(distance);
}

void ReplayPublication::phase(const perimap_Phase& phase) {
  if (recorder_ != nullptr) recorder_->phase(phase);
  if (dds_ != nullptr) dds_->phase(phase);
}

void ReplayPublication::status(const perimap_Status& status) {
  if (recorder_ != nullptr) recorder_->drain();
  if (dds_ != nullptr) dds_->status(status);
}

std::optional<ProcedureScore> ReplayPublication::procedure(ReleaseStream stream) {
  if (accuracies_.empty() || !to_recording_ || truth_->events.empty()) return std::nullopt;
  const Instant first = truth_->captures.begin()->second;
  const auto since = [first](Instant t) { return to_seconds(t - first); };
  std::vector<ProcedureSpan> events;
  for (const RecordedEvent& event : truth_->events) {
    events.push_back({event.kind, event.words, since(event.begin), since(event.end), event.hides});
  }
  std::vector<double> r_peaks_s;
  for (const Instant r : truth_->truth.motion().r_peaks) r_peaks_s.push_back(since(r));
  return score_procedure(accuracies_[index_of(stream)].judged(*to_recording_), events, r_peaks_s);
}

std::optional<AccuracyReport> ReplayPublication::report(ReleaseStream stream) {
  if (accuracies_.empty() || !to_recording_) return std::nullopt;
  return accuracies_[index_of(stream)].report(*to_recording_);
}

}  // namespace perimap

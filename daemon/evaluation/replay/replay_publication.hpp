// What a replay publishes, on its way to all who want it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/phase/r_peak.hpp"
#include "core/pipeline/release_stream.hpp"
#include "daemon/evaluation/procedure/procedure_score.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "daemon/evaluation/tool/tool_figures.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/publication_recorder.hpp"

namespace perimap {

// Takes what is published to the accuracy report, to the file of samples and to DDS, whichever are there.
class ReplayPublication final : public Publication {
 public:
  // None of what is not null may go before this. `beats`: of the recording, for the accuracy's tail.
  ReplayPublication(const RecordedTruth* truth, const std::vector<RPeak>& beats, PublicationRecorder* recorder,
                    Publication* dds);

  // Tools are judged in virtual time alone. `truths` must outlive this.
  void judge_tools(const ToolTruths& truths);

  void surface(const perimap_Surface& sample) override;
  void surface_model(const perimap_SurfaceModel& model) override;
  void surface_mesh(const perimap_SurfaceMesh& mesh) override;
  void tool(const perimap_ToolDistance& distance) override;
  void phase(const perimap_Phase& phase) override;
  void status(const perimap_Status& status) override;

  // After every thread that publishes has ended; none without a truth.
  [[nodiscard]] std::optional<AccuracyReport> report(ReleaseStream stream);
  // Likewise; none without a procedure.
  [[nodiscard]] std::optional<ProcedureScore> procedure(ReleaseStream stream);
  // Likewise; by name.
  [[nodiscard]] std::map<std::string, ToolFigures> tools() const;

 private:
  PublicationRecorder* recorder_;
  Publication* dds_;
  const RecordedTruth* truth_;
  std::vector<Accuracy> accuracies_;        // by ReleaseStream; none without a truth
  std::map<std::string, ToolTally> tools_;  // by name; none but in judge_tools()
  std::optional<Duration> to_recording_;
};

}  // namespace perimap

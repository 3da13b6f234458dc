// How far published positions are from the truth of a simulated heart.
#pragma once

#include <perimap.h>

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "drivers/simulator/ground_truth.hpp"

namespace perimap {

// Distribution of errors, mm. Zeros when there are none.
struct ErrorFigures {
  std::size_t count = 0;
  double median_mm = 0.0;
  double p95_mm = 0.0;
  double max_mm = 0.0;
};

// Of a stretch of the recording.
struct ErrorSpan {
  double begin_s = 0.0;  // from the first frame
  double end_s = 0.0;
  ErrorFigures error;
  std::size_t converged = 0;  // features in state converged in the last sample of the stretch
};

struct FeaturePath {
  std::uint32_t id = 0;
  ErrorFigures error;               // since it was first published as converged
  std::vector<Vector3d> published;  // over the last whole second of the recording, mm, W
  std::vector<Vector3d> truth;      // at the same instants
};

struct AccuracyReport {
  std::size_t samples = 0;
  std::size_t features_published = 0;
  std::size_t features_converged = 0;      // ever
  std::size_t converged_by_15_s = 0;       // ever converged within the first 15 s
  std::size_t converged_at_15_s = 0;       // in state converged in the last sample of the first 15 s
  std::size_t features_without_truth = 0;  // converged, but the ray of their first view misses the true surface
  ErrorFigures settled;                    // 15 s to the end, every feature from its first converged sample on
  double mean_nees = 0.0;                  // e' P^-1 e / 3 over the same; 1 is consistent
  double share_above_3_mm = 0.0;
  std::vector<ErrorSpan> seconds;
  std::vector<ErrorSpan> cycles;   // from R peak to R peak
  std::vector<FeaturePath> paths;  // in order of id
};

// The true position of a feature is that of the material point which the ray of its first detection meets, seen from
// the true camera. A feature counts from the first sample that calls it converged, and from then on always, whatever
// its state becomes, short of invalid: a feature that goes wrong after it was called good is an error, not an absence.
class Accuracy {
 public:
  // `first_frame`: capture of the recording's first frame, the zero of all spans.
  Accuracy(const GroundTruth& truth, const CameraModel& camera, Instant first_frame);

  // What was published, in order. One thread may add surfaces while another adds models.
  void add(const perimap_Surface& sample);
  void add(const perimap_SurfaceModel& model);

  // Published instants are brought to the recording's clock by adding `to_recording`.
  [[nodiscard]] AccuracyReport report(Duration to_recording) const;

 private:
  struct Published {
    std::uint32_t id = 0;
    bool converged = false;
    Vector3d p_W_mm;
    Matrix3d P_mm2;
  };
  struct SampleRange {
    Instant valid_time;
    std::size_t begin = 0;  // in published_
    std::size_t end = 0;
  };
  struct Origin {
    Instant first_observed;
    Vector2d px;
  };

  [[nodiscard]] std::map<std::uint32_t, SurfacePoint> resolve_origins(Duration to_recording) const;

  const GroundTruth& truth_;
  CameraModel camera_;
  Instant first_frame_;
  std::vector<SampleRange> samples_;  // with published_, touched by add(Surface) alone
  std::vector<Published> published_;
  std::map<std::uint32_t, Origin> origins_;  // touched by add(SurfaceModel) alone
};

}  // namespace perimap

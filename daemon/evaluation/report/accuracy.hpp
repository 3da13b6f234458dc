// How far published positions are from the truth of a simulated heart.
#pragma once

#include <perimap.h>

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/phase/r_peak.hpp"
#include "core/sensors/measured_frame_rate.hpp"
#include "core/time/instant.hpp"
#include "daemon/evaluation/report/judged_surface.hpp"
#include "daemon/publishing/use_text.hpp"
#include "drivers/standins/truth/ground_truth.hpp"

namespace perimap {

// A figure of nothing: it is within no limit.
inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

// Distribution of errors, mm. No figures when there are no errors.
struct ErrorFigures {
  std::size_t count = 0;
  double rms_mm = kNoFigure;
  double median_mm = kNoFigure;
  double p95_mm = kNoFigure;
  double max_mm = kNoFigure;
};

// Of a stretch of the recording.
struct ErrorSpan {
  double begin_s = 0.0;  // from the first frame
  double end_s = 0.0;
  ErrorFigures error;
  double mean_nees = kNoFigure;  // as AccuracyReport::mean_nees
  std::size_t converged = 0;     // features in state converged in the last sample of the stretch
};

struct FeaturePath {
  std::uint32_t id = 0;
  ErrorFigures error;               // since it was first published as converged
  std::vector<Vector3d> published;  // over the last whole second of the recording, mm, W
  std::vector<Vector3d> truth;      // at the same instants
};

// Positions of converged features in surfaces of state good, and those of them that are off by more than 3 mm. An
// ectopic beat moves the heart before it can be known: those released from the beginning of the cycle that a premature
// beat ends until a frame after that beat was known are counted apart.
struct GoodPositions {
  std::size_t count = 0;
  std::size_t premature_beats = 0;
  std::size_t off_before_known = 0;
  std::size_t off = 0;  // all others
  std::size_t features_off = 0;
  double largest_before_known_mm = kNoFigure;
  double largest_mm = kNoFigure;
  double rms_mm = kNoFigure;     // of all
  double mean_nees = kNoFigure;  // of all, as AccuracyReport::mean_nees
};

// Positions of converged features that may be used so: in a surface whose state for the use is good, and within the
// use's bound by their own covariance.
struct UsedPositions {
  double within_mm = 0.0;    // the bound, within which 95 % of errors are to be; 0: not told
  std::size_t surfaces = 0;  // whose state for the use is good
  std::size_t count = 0;
  std::size_t off = 0;  // by more than the bound
};

// Features that were first seen from 5 s on, when there is a map of others.
struct NewFeatures {
  std::size_t published = 0;
  std::size_t converged = 0;
  double to_published_s = kNoFigure;  // from first sight, the middle one of those that were
  double to_converged_s = kNoFigure;  // likewise
  ErrorFigures young;                 // called converged, until 5 s after they were first seen
  double young_nees = kNoFigure;      // as AccuracyReport::mean_nees
};

struct AccuracyReport {
  std::size_t samples = 0;
  std::size_t features_published = 0;
  std::size_t features_converged = 0;      // ever
  std::size_t converged_by_15_s = 0;       // ever converged within the first 15 s
  std::size_t converged_at_15_s = 0;       // in state converged in the last sample of the first 15 s
  std::size_t features_without_truth = 0;  // converged, but the ray of their first view misses the true surface
  ErrorFigures settled;                    // 15 s to the end, every feature from its first converged sample on
  double mean_nees = kNoFigure;            // e' P^-1 e / 3 over the same; 1 is consistent
  double share_above_3_mm = kNoFigure;
  std::size_t degraded = 0;  // surfaces of that state, and of state invalid, from 15 s on; and of any
  std::size_t invalid = 0;
  std::size_t settled_samples = 0;
  GoodPositions good;
  std::array<UsedPositions, 3> uses;  // display, measure, contact
  NewFeatures new_features;
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

  // The beats that the pipeline could know of, on the recording's clock, in order of time; without them no release
  // counts as one before an ectopic beat was known.
  void set_beats(std::vector<RPeak> beats) { beats_ = std::move(beats); }

  // Published instants are brought to the recording's clock by adding `to_recording`.
  [[nodiscard]] AccuracyReport report(Duration to_recording) const;

  // Each surface by itself, likewise. Features without a truth are left out.
  [[nodiscard]] std::vector<JudgedSurface> judged(Duration to_recording) const;

 private:
  struct Published {
    std::uint32_t id = 0;
    bool converged = false;
    Vector3d p_W_mm;
    Matrix3d P_mm2;
  };
  struct SampleRange {
    Instant valid_time;
    Instant released;
    perimap_SurfaceState state = perimap_SURFACE_INVALID;
    perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
    ToldUses uses{};
    std::size_t begin = 0;  // in published_
    std::size_t end = 0;
  };
  struct Origin {
    Instant first_observed;
    Vector2d px;
  };

  [[nodiscard]] std::map<std::uint32_t, SurfacePoint> resolve_origins(Duration to_recording) const;
  // Whether what was released then (on the recording's clock) came before a premature beat could be known.
  [[nodiscard]] bool before_premature_beat_is_known(Instant released) const;

  const GroundTruth& truth_;
  CameraModel camera_;
  Instant first_frame_;
  std::vector<RPeak> beats_;
  MeasuredFrameRate frames_;  // with samples_ and published_, touched by add(Surface) alone
  std::vector<SampleRange> samples_;
  std::vector<Published> published_;
  std::map<std::uint32_t, Origin> origins_;  // touched by add(SurfaceModel) alone
};

}  // namespace perimap

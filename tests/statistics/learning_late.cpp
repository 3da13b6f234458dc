// What learning late brings: a match is held until its cardiac cycle is complete and is learnt with the phase that is
// known then, not at once with the phase that the ECG's clock predicts. Two sets of the pipeline's own filters learn
// the same matches of one simulated heart from the same start, one each way. The heart beats to a real ECG, which goes
// through detector, classer and predictor as it arrives. Nothing is rendered, the camera's pose is exact and which
// match is whose is known: what differs is the phase, and what is known of the cycle that will not teach.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/estimation/batch_start.hpp"
#include "core/phase/r_peak_smoother.hpp"
#include "core/pipeline/ecg_intake.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/feature_life.hpp"
#include "core/pipeline/feature_stages.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/image_phase.hpp"
#include "daemon/evaluation/experiment/accuracy_figures.hpp"
#include "daemon/evaluation/experiment/scene.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "goals.hpp"
#include "motion_laws.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap::test {
namespace {

constexpr std::size_t kFeatures = 24;
constexpr double kGoal = 1.0 / 3.0;
// Of a match, per axis: that of the other goals, and the least that the pipeline supposes.
constexpr double kDeviations_px[] = {0.7, 0.3};
// That the learners are told of the camera's pose, which is exact: no frame tells the phase with none.
constexpr double kPoseDeviation_mm = 0.01;
constexpr double kPoseDeviation_rad = 1e-5;

// ---- what is seen

// Frames, phases and poses of the session, and no features yet.
Scene scene_of(const Simulation& simulation) {
  Scene scene;
  scene.settings.seed = simulation.settings().seed;
  scene.model =
      PixelModel{CameraModel{.width = 1280, .height = 720, .fx = 700.0, .fy = 700.0, .cx = 639.5, .cy = 359.5}};
  scene.layout = {static_cast<int>(simulation.truth().mesh().harmonics), 0};
  for (const Simulation::Frame& frame : simulation.frames()) {
    SceneFrame known;
    known.time_s = to_seconds(frame.stamp.capture - simulation.start());
    known.phase_rad = simulation.truth().phase(frame.stamp.capture).phase_rad;
    known.X_CW = known.X_CW_true = frame.X_WC.inverse();
    scene.frames.push_back(known);
  }
  return scene;
}

// Independent sequences of random numbers; those of the features' matches come after the last.
enum Stream : std::uint64_t { kPlace = 1'000, kMatches };

// Points of the heart that the first picture shows near its middle, so that most stay in view.
void find_features(const Simulation& simulation, Scene& scene) {
  const CameraModel& camera = std::get<PixelModel>(scene.model).camera;
  const HeartMesh& mesh = simulation.truth().mesh();
  const Simulation::Frame& first = simulation.frames().front();
  const SurfaceView view = simulation.truth().view(first.X_WC, first.stamp.capture);
  const CounterNoise place(scene.settings.seed, kPlace);
  const Eigen::Index n = scene.layout.state_size();
  for (std::uint64_t i = 0; scene.features.size() < kFeatures; ++i) {
    constexpr double kReach_px = 200.0;
    const Vector2d px(camera.cx + place.uniform(2 * i, -kReach_px, kReach_px),
                      camera.cy + place.uniform(2 * i + 1, -kReach_px, kReach_px));
    Vector3d ray_C;
    if (!camera.unproject(px, ray_C)) continue;
    const std::optional<SurfacePoint> point = view.first_hit(ray_C);
    if (!point) continue;
    StateVector x = StateVector::Zero(n);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Eigen::Index vertex = mesh.triangles[3 * std::size_t{point->triangle} + corner];
      x += point->barycentric[corner] * Eigen::Map<const Eigen::VectorXd>(mesh.coefficients_mm.data() + n * vertex, n);
    }
    scene.features.push_back({x, {}});
  }
}

// The same draw for any deviation.
void look(double deviation_px, Scene& scene) {
  const CameraModel& camera = std::get<PixelModel>(scene.model).camera;
  scene.settings.deviation = deviation_px;
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    SceneFeature& feature = scene.features[i];
    feature.sightings.clear();
    const CounterNoise noise(scene.settings.seed, kMatches + i);
    for (std::size_t f = 0; f < scene.frames.size(); ++f) {
      Sighting sighting;
      sighting.frame = static_cast<int>(f);
      const Vector3d p_C = scene.frames[f].X_CW * scene.true_position(feature, scene.frames[f]);
      if (camera.project(p_C, sighting.z) != ProjectionStatus::kOk || !camera.contains(sighting.z)) continue;
      sighting.z += deviation_px * Vector2d(noise.normal(2 * f), noise.normal(2 * f + 1));
      feature.sightings.push_back(sighting);
    }
  }
}

// ---- who learns it

using Matches = std::array<const Vector2d*, kFeatures>;  // null: not in the picture

enum class Learning : std::uint8_t { kLate, kAtOnce };

// What is known at once of whether the cycle will teach.
bool may_teach(const PhaseEstimate& phase) { return phase.state == PhaseState::kLocked && !phase.ectopic; }

// Filters of all features with the frames as they know them: what the mapper does once a frame's matches are found.
class Learner {
 public:
  Learner(const PipelineSettings& settings, Learning learning)
      : settings_(settings),
        learning_(learning),
        model_{settings.camera},
        history_(std::make_unique<FrameHistory>(settings.estimator.layout)),
        bank_({.layout = settings.estimator.layout, .features = static_cast<int>(kFeatures)},
              settings.estimator.precision),
        slots_(kFeatures) {
    static_assert(kFeatures % kLanes == 0);
    for (int g = 0; g < bank_.groups(); ++g) {
      groups_.emplace_back(bank_, g, std::span(slots_).subspan(static_cast<std::size_t>(g) * kLanes, kLanes));
    }
    for (FeatureSlot& slot : slots_) {
      slot.state = SlotState::kTracked;
      slot.match_agrees = true;
    }
    begun_.fill(learning == Learning::kLate);
  }

  void take(const Simulation::Frame& seen, const CardiacClock& clock, const Matches& matches) {
    FrameJob job;
    job.frame = &append(seen, clock);
    job.history = history_.get();
    job.about_capture = bases_about(settings_.estimator.layout, job.frame->phase, job.frame->respiration);
    for (FeatureGroup& group : groups_) group.sweep(job);
    for (std::size_t i = 0; i < kFeatures; ++i) {
      FeatureSlot& slot = slots_[i];
      slot.match = {};
      if (matches[i] == nullptr) continue;
      slot.match.state = MatchState::kFound;
      slot.match.px = *matches[i];
      slot.last_found_frame = slot.last_told_frame = job.frame->index;
      hold_match(slot, job);
    }
    if (learning_ == Learning::kLate) {
      const ImagePhaseAnswer shown = image_phase_.observe(groups_, *job.frame, model_, settings_.estimator).cardiac;
      if (shown.outcome == ImagePhaseOutcome::kObserved) r_peaks_.add(shown.observed);
    }
    for (FeatureGroup& group : groups_) {
      group.learn(model_, settings_.estimator);
      for (std::size_t lane = 0; lane < group.slots().size(); ++lane) {
        const int feature = group.feature(lane);
        if (!begun_[static_cast<std::size_t>(feature)]) continue;
        FeatureSlot& slot = group.slots()[lane];
        if (advance(slot, bank_, feature, job, model_, settings_) == LifeEvent::kStartRequested) start(slot);
      }
    }
  }

  // Takes over what the other has started since, with the matches after those that the start was made of. Between two
  // frames.
  void begin_with(const Learner& other) {
    for (std::size_t i = 0; i < kFeatures; ++i) {
      const FeatureSlot& theirs = other.slots_[i];
      if (begun_[i] || theirs.state != SlotState::kStarting) continue;
      begun_[i] = true;
      const std::uint64_t last = theirs.held[static_cast<std::uint32_t>(theirs.start.count - 1)].frame_index;
      FeatureSlot& slot = slots_[i];
      std::uint32_t used = 0;
      while (used < slot.held.size() && slot.held[used].frame_index <= last) ++used;
      slot.start.count = static_cast<int>(used);
      if (used > 0) slot.start.captures[used - 1] = history_->find(last)->stamp.capture;
      slot.start.outcome = theirs.start.outcome;
      slot.start.adopt_at_frame = theirs.start.adopt_at_frame;
      slot.start.due = true;
      slot.state = SlotState::kStarting;
    }
  }

  // The clock with the R peaks that it has learnt by.
  [[nodiscard]] CardiacClock learnt_by(const CardiacClock& clock) const { return r_peaks_.moved(clock); }

  // Nothing when the feature has no map.
  [[nodiscard]] std::optional<FeatureEstimate> estimate(std::size_t feature) const {
    if (slots_[feature].state != SlotState::kMapped) return std::nullopt;
    FeatureEstimate estimate;
    bank_.get(static_cast<int>(feature), estimate);
    return estimate;
  }

 private:
  const FrameRecord& append(const Simulation::Frame& seen, const CardiacClock& clock) {
    if (learning_ == Learning::kLate && clock.beats() != beats_) {
      r_peaks_.on_beat(clock);
      history_->refresh_phases(r_peaks_.moved(clock), {});
    }
    beats_ = clock.beats();
    FrameRecord& frame = history_->append(seen.stamp);
    CameraPose pose;
    pose.state = CameraPose::State::kInterpolated;
    pose.X_WC = seen.X_WC;
    pose.position_variance_mm2 = kPoseDeviation_mm * kPoseDeviation_mm;
    pose.rotation_variance_rad2 = kPoseDeviation_rad * kPoseDeviation_rad;
    FrameHistory::set_pose(frame, pose);
    history_->set_phase(frame, clock, {});
    if (learning_ == Learning::kAtOnce) {
      // Learnt from as a completed cycle's is, but as uncertain as the clock says.
      frame.phase.exact = true;
      frame.phase.teaches = may_teach(frame.phase);
    }
    return frame;
  }

  void start(FeatureSlot& slot) const {
    const std::span<const Observation> observations(slot.start.observations.data(),
                                                    static_cast<std::size_t>(slot.start.count));
    const EstimatorSettings& estimator = settings_.estimator;
    slot.start.outcome = batch_start(observations, model_, estimator.layout, estimator.prior, estimator.batch);
    slot.start.due = true;
  }

  const PipelineSettings& settings_;
  Learning learning_;
  PixelModel model_;
  std::unique_ptr<FrameHistory> history_;
  MapBank bank_;
  std::vector<FeatureSlot> slots_;
  std::vector<FeatureGroup> groups_;
  ImagePhase image_phase_;
  RPeakSmoother r_peaks_;
  std::array<bool, kFeatures> begun_{};  // the first start is made, or is the learner's own to make
  std::uint64_t beats_ = 0;
};

// ---- what comes of it

double phase_error_s(const PhaseEstimate& told, double true_rad) {
  return std::remainder(told.phase_rad - true_rad, 2.0 * std::numbers::pi) / told.rate_rad_per_s;
}

// One way of learning, over features and sessions.
struct Sums {
  std::vector<double> errors_mm;  // infinite without a map
  double square_error_mm2 = 0.0;  // of the maps that there are, here and below
  double nees = 0.0;
  int maps = 0;
  double square_phase_error_s2 = 0.0;  // of the frames learnt from
  int phases = 0;

  void add(const PhaseEstimate& phase, double true_rad) {
    square_phase_error_s2 += std::pow(phase_error_s(phase, true_rad), 2);
    ++phases;
  }
  [[nodiscard]] double median_mm() const { return quantile(errors_mm, 0.5); }
  [[nodiscard]] double rms_mm() const { return std::sqrt(square_error_mm2 / maps); }
  [[nodiscard]] double mean_nees() const { return nees / maps; }
  [[nodiscard]] double phase_ms() const { return 1e3 * std::sqrt(square_phase_error_s2 / phases); }
  [[nodiscard]] std::size_t without_map() const { return errors_mm.size() - static_cast<std::size_t>(maps); }
};

struct Cell {
  Sums late;
  Sums at_once;
  std::vector<double> bounds_mm;  // path errors of an estimator that knows the phase and reaches its bound

  [[nodiscard]] double bound_mm() const { return quantile(bounds_mm, 0.5); }
};

void add_maps(const Scene& scene, const PipelineSettings& settings, const Learner& late, const Learner& at_once,
              Cell& cell) {
  const BasisLayout& layout = settings.estimator.layout;
  const auto frames = static_cast<int>(scene.frames.size());
  for (std::size_t i = 0; i < kFeatures; ++i) {
    const SceneFeature& feature = scene.features[i];
    // Some leave the picture.
    if (static_cast<double>(feature.sightings.size()) < 0.6 * frames) continue;
    const FeatureEstimate bound = cramer_rao_bound(scene, feature, layout, settings.estimator.prior, frames);
    constexpr int kDraws = 20;
    const auto drawn = drawn_path_errors_mm(bound, layout, kDraws, cell.bounds_mm.size());
    cell.bounds_mm.insert(cell.bounds_mm.end(), drawn.begin(), drawn.end());
    for (const auto& [learner, sums] : {std::pair{&late, &cell.late}, {&at_once, &cell.at_once}}) {
      const std::optional<FeatureEstimate> estimate = learner->estimate(i);
      if (!estimate) {
        sums->errors_mm.push_back(INFINITY);
        continue;
      }
      const double error_mm = path_error_mm(*estimate, layout, scene, feature);
      sums->errors_mm.push_back(error_mm);
      sums->square_error_mm2 += error_mm * error_mm;
      sums->nees += normalised_squared_error(*estimate, layout, scene, feature);
      ++sums->maps;
    }
  }
}

// By how much the detector's R peaks are later than those that the heart beats by, s: the median of what is learnt
// from. Within the QRS complex either has its own place, from which the phase counts; no motion can tell them apart.
double r_peaks_late_s(const Simulation& simulation, const Scene& scene, PhaseLaw law) {
  PipelineSettings settings = settings_for(simulation, {});
  settings.clock.law.law = law;
  EcgClockCells cells;
  const auto counters = std::make_unique<PipelineCounters>();
  EcgIntake intake({settings.clock, {}}, cells, *counters);
  std::vector<double> late_s;
  std::size_t open = 0;
  for (const EcgBlock& block : simulation.ecg()) {
    intake.push(block);
    cells.mapper.update();
    const CardiacClock& clock = cells.mapper.front();
    for (; open < scene.frames.size() && simulation.frames()[open].stamp.capture < clock.anchor(); ++open) {
      const PhaseEstimate told = clock.at(simulation.frames()[open].stamp.capture);
      if (told.teaches) late_s.push_back(-phase_error_s(told, scene.frames[open].phase_rad));
    }
  }
  return quantile(std::move(late_s), 0.5);
}

void add_session(const Simulation& simulation, const Scene& scene, double offset_s, PhaseLaw told, Cell& cell) {
  PipelineSettings settings = settings_for(simulation, {});
  settings.camera = std::get<PixelModel>(scene.model).camera;
  settings.estimator.pixel_deviation_px = scene.settings.deviation;
  settings.clock.law.law = told;
  EcgClockCells cells;
  const auto counters = std::make_unique<PipelineCounters>();
  EcgIntake intake({settings.clock, {}}, cells, *counters);
  Learner late(settings, Learning::kLate);
  Learner at_once(settings, Learning::kAtOnce);
  std::array<std::size_t, kFeatures> next{};  // sighting of each feature
  std::size_t open = 0;                       // the first frame of which the cycle is not complete
  for (const Simulation::Arrival& arrival : simulation.arrivals()) {
    if (arrival.source == Simulation::Source::kEcg) {
      EcgBlock block = simulation.ecg()[arrival.index];
      block.first_sample_time -= from_seconds(offset_s);
      intake.push(block);
    }
    if (arrival.source != Simulation::Source::kCamera) continue;
    const Simulation::Frame& frame = simulation.frames()[arrival.index];
    Matches matches{};
    for (std::size_t i = 0; i < kFeatures; ++i) {
      const auto& sightings = scene.features[i].sightings;
      if (next[i] == sightings.size() || sightings[next[i]].frame != static_cast<int>(arrival.index)) continue;
      matches[i] = &sightings[next[i]++].z;
    }
    cells.mapper.update();
    const CardiacClock clock = cells.mapper.front().as_of(frame.stamp.arrival);
    late.take(frame, clock, matches);
    at_once.begin_with(late);
    at_once.take(frame, clock, matches);

    const PhaseEstimate now = clock.at(frame.stamp.capture);
    if (may_teach(now)) cell.at_once.add(now, scene.frames[arrival.index].phase_rad);
    for (; open < arrival.index && simulation.frames()[open].stamp.capture < clock.anchor(); ++open) {
      const PhaseEstimate then = late.learnt_by(clock).at(simulation.frames()[open].stamp.capture);
      if (then.teaches) cell.late.add(then, scene.frames[open].phase_rad);
    }
  }
  add_maps(scene, settings, late, at_once, cell);
}

void print(const std::string& title, const Cell& cell) {
  const Sums& late = cell.late;
  const Sums& at_once = cell.at_once;
  GoalReport::line_of(
      fmt::format("{}; no map {}, {} of {}", title, late.without_map(), at_once.without_map(), late.errors_mm.size()),
      {late.median_mm(), at_once.median_mm(), cell.bound_mm(), late.rms_mm(), at_once.rms_mm(), late.mean_nees(),
       at_once.mean_nees(), late.phase_ms(), at_once.phase_ms()});
}

// Of NEES/3 over all features. Those of a session share the errors of its R peaks, so few sessions say little; the
// short form leaves room for another seed.
struct CovarianceLimits {
  double low;
  double high;
};
constexpr CovarianceLimits kLongLimits{0.9, 1.1};
constexpr CovarianceLimits kShortLimits{0.8, 1.25};

struct Scale {
  int sessions;
  int duration_s;
  CovarianceLimits limits;
};

// `consistent`: the covariance is asked to be true.
void judge(const Cell& cell, bool consistent, const CovarianceLimits& limits, GoalReport& report) {
  const double ratio = cell.late.median_mm() / cell.at_once.median_mm();
  const double bound = cell.bound_mm() / cell.at_once.median_mm();
  const std::string what = "  medians, late / at once";
  // However it learns, no map is better than the matches' own noise allows, and near that chance decides.
  constexpr double kRoom = 0.75;
  if (bound > kRoom * kGoal) {
    report.shown(what, fmt::format("(<= {:.3f})", kGoal), ratio, bound);
  } else {
    report.at_most(what, kGoal, ratio, bound);
  }
  if (consistent) {
    report.within("  NEES/3, late", limits.low, limits.high, cell.late.mean_nees());
  } else {
    report.shown("  NEES/3, late", fmt::format("({:g}..{:g})", limits.low, limits.high), cell.late.mean_nees());
  }
}

void learning_late(std::string_view record, MotionLaw law, const Scale& scale, std::uint64_t seed, GoalReport& report) {
  double late_s = 0.0;  // the mean of the sessions
  std::array<Cell, std::size(kDeviations_px)> cells;
  Cell mistaken;
  for (int session = 0; session < scale.sessions; ++session) {
    SimulationSettings settings;
    settings.seed = 700'000 * seed + static_cast<std::uint64_t>(session);
    settings.duration = std::chrono::seconds(scale.duration_s);
    settings.ecg_record = record;
    settings.law = law;
    // No picture is made.
    settings.width = 64;
    settings.height = 64;
    const Simulation simulation = simulation_of(settings);
    Scene scene = scene_of(simulation);
    find_features(simulation, scene);
    const double offset_s = r_peaks_late_s(simulation, scene, law_of(law));
    late_s += offset_s / scale.sessions;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      look(kDeviations_px[i], scene);
      add_session(simulation, scene, offset_s, law_of(law), cells[i]);
      if (i == 0 && law != MotionLaw::kLinear) add_session(simulation, scene, offset_s, PhaseLaw::kLinear, mistaken);
    }
  }
  GoalReport::heading(
      fmt::format("{}, {}, {} s; R peaks {:.1f} ms late", record, name_of(law_of(law)), scale.duration_s, 1e3 * late_s),
      {"median", "at once", "bound", "RMS mm", "at once", "NEES/3", "at once", "phase ms", "at once"});
  for (std::size_t i = 0; i < cells.size(); ++i) {
    print(fmt::format("{:g} px", kDeviations_px[i]), cells[i]);
    // Where matches are sharp what is stated of the R peaks' deviations shows, and that is a little too much.
    const bool sharp = i > 0;
    judge(cells[i], !sharp, scale.limits, report);
  }
  if (law != MotionLaw::kLinear) print(fmt::format("{:g} px, told linear", kDeviations_px[0]), mistaken);
}

}  // namespace

void learning_late(const Extent& extent, const HeartMesh& /*heart*/, GoalReport& report) {
  const Scale scale = extent.whole ? Scale{10, 60, kLongLimits} : Scale{3, 30, kShortLimits};
  std::vector<MotionLaw> laws{MotionLaw::kLinear};
  if (extent.whole) laws = {MotionLaw::kLinear, MotionLaw::kWarped, MotionLaw::kTimeLocked};
  for (const std::string_view record : {"100", "123", "119", "03700181"}) {
    for (const MotionLaw law : laws) learning_late(record, law, scale, extent.seed, report);
  }
}

}  // namespace perimap::test

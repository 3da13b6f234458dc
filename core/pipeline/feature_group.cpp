#include "core/pipeline/feature_group.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/pipeline/match_covariance.hpp"
#include "core/pipeline/phase_spread.hpp"

namespace perimap {
namespace {

// A linear law makes 0.3 to 1 mm of a warped heart, as the lengths of its cycles vary.
constexpr double kDoubt_mm = 1.0;
constexpr Duration kRefusedBeforeRelock = std::chrono::milliseconds(333);
// How much a feature's breathing differs from the common one, first harmonic, and by how much its mean is off that was
// learnt while the phase was not known.
constexpr double kBreathDeviation_mm = 2.0;
constexpr double kBreathMeanDeviation_mm = 1.5;
// What a period that is off by half a percent makes of the first breath that is learnt by it; and by how much all
// variances grow besides, so that what was learnt hardly counts beside the same matches, learnt once more.
constexpr double kFirstBreath_mm = 0.4;
constexpr double kForgotten = 4.0;
static_assert(kBreathHarmonics == kMaxRespiratoryHarmonics);
constexpr std::uint64_t kNoFrame = std::numeric_limits<std::uint64_t>::max();

// The oldest frame after `after` (or the oldest of all) that a mapped slot holds a match of.
std::uint64_t next_held_frame(std::span<const FeatureSlot> slots, std::uint64_t after) noexcept {
  std::uint64_t next = kNoFrame;
  for (const FeatureSlot& slot : slots) {
    if (slot.state != SlotState::kMapped) continue;
    for (std::uint32_t i = 0; i < slot.held.size(); ++i) {
      const std::uint64_t frame = slot.held[i].frame_index;
      if (after != kNoFrame && frame <= after) continue;
      next = std::min(next, frame);
      break;
    }
  }
  return next;
}

// A frame teaches nothing when it has left the history, when it lost its phase because the next beat showed that its
// cycle was none, or when its cycle had an ectopic beat.
void drop_what_can_not_be_learnt(FeatureSlot& slot, const FrameHistory& history) noexcept {
  while (slot.held.size() > 0) {
    const FrameRecord* frame = history.find(slot.held[0].frame_index);
    if (frame != nullptr && frame->measurable && (!frame->phase.exact || frame->phase.teaches)) return;
    slot.held.drop(1);
  }
}

// Not where the poses' errors have much in common: that is followed in order of time.
bool take_back(FeatureSlot& slot) noexcept {
  if (slot.slow_error != nullptr) return false;
  slot.held.take_back();
  return true;
}

void count_update(FeatureSlot& slot, bool accepted, const FrameRate& held_rate) noexcept {
  if (!accepted) {
    const bool long_enough = ++slot.refused_in_a_row % held_rate.frames(kRefusedBeforeRelock) == 0;
    slot.follows_something_else = long_enough || slot.follows_something_else;
    return;
  }
  slot.refused_in_a_row = 0;
  ++slot.updates;
}

}  // namespace

void FeatureGroup::plan(const FrameJob& job) noexcept {
  plan_.phases.clear();
  plan_.learnt.fill(nullptr);
  plan_.capture = -1;
  bool mapped = false;
  for (FeatureSlot& slot : slots_) {
    if (slot.state != SlotState::kMapped) continue;
    mapped = true;
    drop_what_can_not_be_learnt(slot, *job.history);
  }
  if (!mapped) return;

  std::uint64_t held = kNoFrame;
  while (plan_.phases.learnt() < kLearnPerFrame && (held = next_held_frame(slots_, held)) != kNoFrame) {
    const FrameRecord* frame = job.history->find(held);
    if (frame == nullptr || !frame->measurable) continue;
    if (!frame->phase.exact) break;
    if (!frame->phase.teaches) continue;
    const int k = plan_.phases.add_learnt(frame->b, frame->b_rate, frame->phase.rate_rad_per_s);
    plan_.learnt[static_cast<std::size_t>(k)] = frame;
  }
  const FrameRecord& now = *job.frame;
  plan_.capture = plan_.phases.add_predicted(now.b, now.b_rate, now.phase.rate_rad_per_s);
  for (std::size_t i = job.plan.begin; i < job.plan.end; ++i) {
    plan_.evaluated[i] = plan_.phases.add_predicted(job.evaluated_b[i], Basis());
  }
}

void FeatureGroup::sweep(const FrameJob& job) noexcept {
  plan(job);
  if (plan_.capture < 0) return;
  bank_.sweep(index_, plan_.phases);
  bank_.motion(index_, plan_.phases, plan_.capture, at_capture_);
  SweepPhase<double> at;
  at.set(job.about_capture.earlier, Basis(), 0.0, 0.0);
  bank_.motion_near(index_, plan_.phases, plan_.capture, at, earlier_);
  at.set(job.about_capture.later, Basis(), 0.0, 0.0);
  bank_.motion_near(index_, plan_.phases, plan_.capture, at, later_);
}

MapPrediction FeatureGroup::prediction(std::size_t lane) const noexcept {
  if (plan_.capture < 0 || slots_[lane].state != SlotState::kMapped) return {};
  const auto l = static_cast<int>(lane);
  const Vector3d p = at_capture_.position_of(l);
  return {true, p, at_capture_.covariance_of(l) + phase_spread(p, earlier_.position_of(l), later_.position_of(l))};
}

bool is_asked(const FeatureSlot& slot, Asked asked) noexcept {
  // In a window of innovations that are too high the deviation grows before anything else is said of a feature.
  constexpr double kWellKnown_mm = 2.0;
  constexpr int kFewestUpdates = 30;
  if (slot.state != SlotState::kMapped) return false;
  if (asked == Asked::kMapped) return true;
  if (slot.pressed) return false;
  if (slot.converged) return true;
  return asked == Asked::kWellKnown && slot.updates >= kFewestUpdates && slot.largest_deviation_mm <= kWellKnown_mm;
}

void FeatureGroup::collect(const SweepPhase<double>& at, const SweepPhase<double>* breath, Asked asked,
                           double pixel_deviation_px, const PixelMap& picture, std::vector<CommonMatch>& matches,
                           std::vector<FeatureSlot*>& owners) noexcept {
  if (plan_.capture < 0) return;
  LaneMotions<double> motions;
  LaneMotions<double> breathing;
  bank_.motion_near(index_, plan_.phases, plan_.capture, at, motions);
  if (breath != nullptr) bank_.motion_near(index_, plan_.phases, plan_.capture, *breath, breathing);
  for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
    FeatureSlot& slot = slots_[lane];
    if (slot.state != SlotState::kMapped || slot.match.state != MatchState::kFound) continue;
    if (!is_asked(slot, asked)) continue;
    const auto l = static_cast<int>(lane);
    CommonMatch match;
    match.z = picture.to_lens(slot.match.px);
    match.R = match_covariance(picture.covariance_to_lens(slot.match.covariance_px2), pixel_deviation_px);
    match.p_WF = motions.position_of(l);
    match.S = motions.covariance_of(l);
    match.D.resize(3, breath != nullptr ? 2 : 1);
    match.D.col(0) = motions.velocity_of(l);
    if (breath != nullptr) match.D.col(1) = breathing.velocity_of(l);
    matches.push_back(match);
    owners.push_back(&slot);
  }
}

void FeatureGroup::begin_breath(const BreathWave& wave, bool again) noexcept {
  for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
    if (slots_[lane].state != SlotState::kMapped) continue;
    begin_breath(lane, wave);
    if (again) take_back(slots_[lane]);
  }
}

void FeatureGroup::begin_breath(std::size_t lane, const BreathWave& wave) noexcept {
  const BasisLayout& layout = bank_.layout();
  const int n = layout.size();
  const int first = 1 + 2 * layout.cardiac_harmonics;
  FeatureEstimate estimate;
  bank_.get(feature(lane), estimate);
  for (int axis = 0; axis < 3; ++axis) {
    estimate.P(axis * n, axis * n) += kBreathMeanDeviation_mm * kBreathMeanDeviation_mm;
    for (int k = 0; k < layout.respiratory_harmonics; ++k) {
      const double deviation_mm = kBreathDeviation_mm / ((k + 1) * (k + 1));
      for (const int i : {axis * n + first + k, axis * n + first + layout.respiratory_harmonics + k}) {
        estimate.P.row(i).setZero();
        estimate.P.col(i).setZero();
        estimate.P(i, i) = deviation_mm * deviation_mm;
      }
      estimate.x(axis * n + first + k) = wave.a[k](axis);
      estimate.x(axis * n + first + layout.respiratory_harmonics + k) = wave.b[k](axis);
    }
  }
  bank_.set(feature(lane), estimate);
}

void FeatureGroup::learn_again() noexcept {
  for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
    FeatureSlot& slot = slots_[lane];
    if (slot.state != SlotState::kMapped || !take_back(slot)) continue;
    FeatureEstimate estimate;
    bank_.get(feature(lane), estimate);
    estimate.P *= kForgotten;
    bank_.set(feature(lane), estimate);
    bank_.diffuse(feature(lane), kFirstBreath_mm);
    slot.repeated = {};
  }
}

void FeatureGroup::doubt() noexcept {
  for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
    if (slots_[lane].state == SlotState::kMapped) diffuse(lane, kDoubt_mm);
  }
}

void FeatureGroup::diffuse(std::size_t lane, double deviation_mm) noexcept {
  bank_.diffuse(feature(lane), deviation_mm);
  slots_[lane].repeated.fade(slots_[lane].largest_deviation_mm, deviation_mm);
}

void FeatureGroup::evaluate(const FrameJob& job, ShardSnapshot& publisher, ShardSnapshot& model) noexcept {
  if (plan_.capture < 0) return;
  const auto [begin, end] = std::pair(job.plan.begin, job.plan.end);
  std::array<LaneMotions<double>, kCovariances> evaluated;
  for (std::size_t i = begin; i < end; ++i) {
    bank_.motion(index_, plan_.phases, plan_.evaluated[i], evaluated[i]);
  }
  FeatureSnapshot snapshot;
  for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
    if (slots_[lane].state != SlotState::kMapped) continue;
    describe(slots_[lane], job.frame->stamp.capture, job.doubts, snapshot);
    bank_.get(feature(lane), snapshot.x);
    for (std::size_t i = begin; i < end; ++i) {
      snapshot.covariances_W_mm2[i] =
          slots_[lane].repeated.factor() * evaluated[i].covariance_of(static_cast<int>(lane));
      if (const auto& slow_error = slots_[lane].slow_error) {
        snapshot.covariances_W_mm2[i] += slow_error->position_covariance(job.evaluated_b[i]);
      }
    }
    publisher.features.push_back(snapshot);
    model.features.push_back(snapshot);
  }
}

// The updates at learnt phase k, with the covariances that their matches were given.
void FeatureGroup::follow_slow_errors(const PixelModel& model, int k, const LaneOutcomes<double>& outcomes,
                                      const std::array<Matrix2d, kLanes>& R) noexcept {
  const FrameRecord& frame = *plan_.learnt[static_cast<std::size_t>(k)];
  LaneMotions<double> learnt;
  bool any = false;
  PoseNoiseTerm term;
  for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
    const FeatureSlot& slot = slots_[lane];
    if (slot.slow_error == nullptr || (outcomes.considered >> lane & 1) == 0) continue;
    slot.slow_error->pass(to_seconds(frame.stamp.capture - slot.last_learnt));
    if ((outcomes.accepted >> lane & 1) == 0) continue;
    if (!std::exchange(any, true)) bank_.motion(index_, plan_.phases, k, learnt);
    if (!describe_pose_noise(model, frame.X_CW, frame.pose, learnt.position_of(static_cast<int>(lane)), term)) continue;
    term.b = frame.b;
    term.R = R[lane];
    bank_.position_gain(feature(lane), plan_.phases, k, term.M);
    slot.slow_error->add(term);
  }
}

void FeatureGroup::judge(std::size_t lane, double nis, bool accepted, double common,
                         const FrameRate& held_rate) noexcept {
  FeatureSlot& slot = slots_[lane];
  if (slot.health.add(nis, accepted, common, held_rate) == HealthAction::kInflate) {
    diffuse(lane, kInflation_mm);
  }
  count_update(slot, accepted, held_rate);
}

void FeatureGroup::learn(const PixelModel& model, const EstimatorSettings& settings) noexcept {
  for (int k = 0; k < plan_.phases.learnt(); ++k) {
    const FrameRecord& frame = *plan_.learnt[static_cast<std::size_t>(k)];
    LaneMotions<double> motions;
    bank_.motion(index_, plan_.phases, k, motions);
    LaneObservations<double> observations;
    std::array<Matrix2d, kLanes> R;
    std::array<Matrix2d, kLanes> own;  // px^2, of each match without its pose and phase
    const double alike = matches_alike(frame.held_rate);
    std::array<double, kLanes> common{};
    std::array<bool, kLanes> again{};  // learnt before, and judged then
    for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
      FeatureSlot& slot = slots_[lane];
      if (slot.state != SlotState::kMapped || slot.held.size() == 0 || slot.held[0].frame_index != frame.index)
        continue;
      const HeldMatch held = slot.held[0];
      slot.held.drop(1);
      again[lane] = frame.stamp.capture <= slot.last_learnt;
      const auto l = static_cast<int>(lane);
      const Vector3d p_WF = motions.position_of(l);
      Vector2d predicted_px;
      Matrix23d J_C;
      if (model.camera.project(frame.X_CW * p_WF, predicted_px, &J_C) != ProjectionStatus::kOk) {
        if (!again[lane]) judge(lane, 0.0, false, 0.0, frame.held_rate);
        continue;
      }
      const Matrix23d J_p = J_C * frame.X_CW.R;
      const Vector2d phase_spread = J_p * motions.velocity_of(l) * frame.phase.deviation_s;
      R[lane] = match_covariance(held, frame, p_WF, J_p, settings.pixel_deviation_px, alike) +
                phase_spread * phase_spread.transpose();
      // All of a cycle's phases err with its R peaks.
      common[lane] = phase_spread.dot(R[lane].inverse() * phase_spread);
      const double since_rad = to_seconds(frame.stamp.capture - slot.last_learnt) * frame.phase.rate_rad_per_s;
      if (!again[lane]) {
        if (frame.phase.phase_rad < slot.last_learnt_rad || since_rad > 2.0 * std::numbers::pi) {
          slot.health.begin_cycle();
        }
        slot.last_learnt_rad = frame.phase.phase_rad;
      }
      own[lane] = alike * held.covariance_px2;
      observations.set(l, held.px, R[lane]);
    }
    LaneOutcomes<double> outcomes;
    bank_.update(index_, plan_.phases, k, frame.X_CW, model, observations, settings.update, outcomes);
    follow_slow_errors(model, k, outcomes, R);
    for (std::size_t lane = 0; lane < slots_.size(); ++lane) {
      if ((outcomes.considered >> lane & 1) == 0) continue;
      const bool accepted = (outcomes.accepted >> lane & 1) != 0;
      if (accepted) slots_[lane].repeated.add(own[lane], R[lane], kMatchesAlike / alike);
      if (again[lane]) continue;
      judge(lane, outcomes.normalised_innovation_squared[lane], accepted, common[lane], frame.held_rate);
      FeatureSlot& slot = slots_[lane];
      if (accepted) slot.aside.add(frame.pose);
      if (slot.health.process_noise() > 0.0 && frame.stamp.capture > slot.last_learnt) {
        const double elapsed_s = to_seconds(frame.stamp.capture - slot.last_learnt);
        diffuse(lane, slot.health.process_noise() * std::sqrt(elapsed_s));
      }
      slot.last_learnt = std::max(slot.last_learnt, frame.stamp.capture);
    }
  }
}

}  // namespace perimap

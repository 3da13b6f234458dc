#include "core/pipeline/feature_life.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "core/pipeline/feature_stages.hpp"
#include "core/pipeline/match_covariance.hpp"

namespace perimap {
namespace {

constexpr Duration kRefusedBeforeLost = std::chrono::seconds(3);
constexpr Duration kUnobservedBeforeLost = std::chrono::seconds(30);
// Of a feature whose estimate is so uncertain the map can not tell where to search: its slot serves better.
constexpr double kVagueDeviations = 3.0;  // of a converged feature's largest
constexpr Duration kUnobservedVagueBeforeLost = std::chrono::seconds(1);
// Of one that is followed without being learnt from, and has no estimate that would gain by its next good view.
constexpr Duration kUntoldBeforeLost = std::chrono::seconds(2);
constexpr int kFailedStartsBeforeLost = 3;
// What is pressed or pulled at for longer than an instrument does is otherwise than it was.
constexpr Duration kPressedBeforeAnew = std::chrono::seconds(15);
constexpr Duration kConvergenceCheck = std::chrono::milliseconds(500);
constexpr double kSamePhase_rad = 0.01;         // of a breath
constexpr std::uint32_t kFewestOnSurface = 20;  // matches, so that they can contradict it
constexpr int kUpdatesBeforeConverged = 30;     // beyond the start, so that the innovation statistic means something

// Fills slot.start from the first `count` held matches. False when one of them can not be used (its frame has left the
// history or has no phase any more, or its pixel has no ray); the held matches up to it are then dropped.
bool prepare_start(FeatureSlot& slot, std::uint32_t count, const FrameJob& job, const PixelModel& model,
                   const EstimatorSettings& settings) noexcept {
  const auto& depths = settings.batch.start_depths_mm;
  const double depth_mm = depths[depths.size() / 2];  // only scales the pose noise; the start finds the true depth
  slot.start.count = 0;
  slot.start.repeated = {};
  slot.start.law = job.law;
  for (std::uint32_t k = 0; k < count; ++k) {
    const HeldMatch& held = slot.held[k];
    const FrameRecord* frame = job.history->find(held.frame_index);
    Vector3d ray_C;
    Vector2d px;
    Matrix23d J_C;
    // A frame can lose its phase after its match was held, when the next beat shows that the cycle was none.
    if (frame == nullptr || !frame->measurable || !model.camera.unproject(held.px, ray_C) ||
        model.camera.project(depth_mm * ray_C, px, &J_C) != ProjectionStatus::kOk) {
      slot.held.drop(k + 1);
      return false;
    }
    Observation& observation = slot.start.observations[k];
    observation.z = held.px;
    observation.X_CW = frame->X_CW;
    observation.b = frame->b;
    observation.b_deviation = frame->b_rate * (frame->phase.rate_rad_per_s * frame->phase.deviation_s);
    const double alike = matches_alike(rate_of_starts(frame->held_rate));
    observation.R = match_covariance(held, *frame, frame->pose.X_WC * (depth_mm * ray_C), J_C * frame->X_CW.R,
                                     settings.pixel_deviation_px, alike);
    slot.start.repeated.add(alike * held.covariance_px2, observation.R, kMatchesAlike / alike);
    slot.start.captures[k] = frame->stamp.capture;
    slot.start.cycles[k] = {frame->cycle, frame->respiration};
    slot.start.poses[k] = frame->pose;
    ++slot.start.count;
  }
  return true;
}

// The life of one slot in one frame.
class Step {
 public:
  Step(FeatureSlot& slot, MapBank& bank, int feature, const FrameJob& job, const PixelModel& model,
       const PipelineSettings& settings) noexcept
      : slot_(slot), bank_(bank), feature_(feature), job_(job), model_(model), settings_(settings) {}

  LifeEvent tracked() noexcept {
    if (now() - slot_.last_found_frame > rate().frames(kCarriedUnseen)) return give_up(LifeEvent::kLostUnseen);
    if (now() - slot_.last_told_frame > rate().frames(kUntoldBeforeLost)) return give_up(LifeEvent::kLostUnseen);
    slot_.held.drop_if([this](const HeldMatch& held) {
      const FrameRecord* frame = job_.history->find(held.frame_index);
      return frame == nullptr || (frame->phase.exact && !frame->phase.teaches);
    });
    const auto wanted = static_cast<std::uint32_t>(settings_.estimator.start_observations);
    const bool surface = job_.surface_there && !slot_.starts_alone;
    // The start waits for the end of the last observation's cycle, as all learning does.
    if (slot_.held.size() >= wanted && is_told(wanted - 1)) {
      return request_start(wanted, surface ? StartAsked::kOnSurfaceOrAlone : StartAsked::kAlone);
    }
    if (!surface || slot_.surface_asked || slot_.held.size() < kFewestOnSurface || !is_told(kFewestOnSurface - 1)) {
      return LifeEvent::kNone;
    }
    std::uint32_t told = kFewestOnSurface;
    while (told < std::min(slot_.held.size(), wanted) && is_told(told)) ++told;
    return request_start(told, StartAsked::kOnSurface);
  }

  LifeEvent starting() noexcept {
    if (now() < slot_.start.adopt_at_frame) return LifeEvent::kNone;
    if (!slot_.start.due) {
      return now() == slot_.start.adopt_at_frame ? LifeEvent::kAdoptionLate : LifeEvent::kNone;
    }
    if (slot_.forgotten) return give_up(LifeEvent::kNone);
    // By a law that has been taken since, or that is certain now, the same matches tell more; and by breathing that has
    // been found.
    const BelievedLaws before = slot_.start.law.laws();
    const BelievedLaws now_believed = job_.law.laws();
    const bool law_told = before.told != now_believed.told || (before.undecided() && !now_believed.undecided());
    const FrameRecord* first = job_.history->find(slot_.held[0].frame_index);
    const RespiratoryPhase& breath_before = slot_.start.cycles[0].respiration;
    const bool breath_told =
        first != nullptr && first->respiration.known &&
        (!breath_before.known || std::abs(std::remainder(first->respiration.phase_rad - breath_before.phase_rad,
                                                         2.0 * std::numbers::pi)) > kSamePhase_rad);
    const auto used = static_cast<std::uint32_t>(slot_.start.count);
    if (first != nullptr && (law_told || breath_told)) return request_start(used, slot_.start.asked);
    const bool asked_surface = slot_.start.asked != StartAsked::kAlone;
    const bool begun_on_surface = asked_surface && slot_.start.on_surface == SurfaceStartKind::kStarted;
    const bool contradicts = asked_surface && slot_.start.on_surface == SurfaceStartKind::kContradicts;
    slot_.starts_alone = slot_.starts_alone || contradicts;
    if (slot_.start.asked == StartAsked::kOnSurface && !begun_on_surface) {
      slot_.surface_asked = true;
      slot_.state = SlotState::kTracked;
      return contradicts ? LifeEvent::kOffSurface : LifeEvent::kNone;
    }
    if (!slot_.start.outcome.ok()) {
      // What no start explains is a highlight or an instrument; but not where hardly any feature can be started.
      const bool tried_enough = ++slot_.failed_starts >= kFailedStartsBeforeLost;
      if (tried_enough && !job_.starts_fail_alike) return give_up(LifeEvent::kLostUnstarted);
      slot_.held.drop(used / 2);
      slot_.state = SlotState::kTracked;
      return LifeEvent::kStartFailed;
    }
    slot_.held.drop(used);
    bank_.set(feature_, slot_.start.outcome.estimate);
    const Instant last = slot_.start.captures[used - 1];
    slot_.map({.last_observed = last,
               .last_learnt = last,
               .repeated = slot_.start.repeated,
               .began_on_surface = begun_on_surface});
    // It is not worth what its covariance says: what is seen from now on shall win.
    if (slot_.start.outcome.contradicted()) {
      bank_.diffuse(feature_, kInflation_mm);
      slot_.repeated = {};
    }
    for (std::uint32_t i = 0; i < used; ++i) slot_.aside.add(slot_.start.poses[i]);
    check_convergence();
    if (begun_on_surface) return LifeEvent::kBegunOnSurface;
    return contradicts ? LifeEvent::kOffSurface : LifeEvent::kNone;
  }

  LifeEvent mapped() noexcept {
    // Refusals come up to a cycle late; what the map and this frame's match say of each other is newer.
    const bool refused_long = slot_.refused_in_a_row >= job_.frame->held_rate.frames(kRefusedBeforeLost);
    const bool refused = refused_long && !slot_.match_agrees;
    const bool vague = slot_.largest_deviation_mm > kVagueDeviations * settings_.estimator.converged_deviation_mm;
    if (slot_.last_told_frame == now()) {
      slot_.unseen_frames = 0;
    } else if (job_.frame->measurable && !slot_.shed) {
      ++slot_.unseen_frames;
    }
    const std::uint64_t allowed = rate().frames(vague ? kUnobservedVagueBeforeLost : kUnobservedBeforeLost);
    if (refused) return give_up(LifeEvent::kLostRefused);
    if (slot_.unseen_frames > allowed) return give_up(LifeEvent::kLostUnseen);
    if (slot_.follows_something_else) {
      slot_.follows_something_else = false;
      if (!slot_.match_agrees) let_go(slot_, *job_.frame);
    }
    // Spread over the frames by id, so that no frame pays for all features.
    if ((now() + slot_.id) % rate().frames(kConvergenceCheck) == 0) check_convergence();
    if (slot_.health.state() == HealthState::kFailed || pressed_long()) return start_anew();
    if (slot_.health.state() == HealthState::kInconsistent) slot_.converged = false;
    return LifeEvent::kNone;
  }

 private:
  [[nodiscard]] std::uint64_t now() const noexcept { return job_.frame->index; }
  [[nodiscard]] const FrameRate& rate() const noexcept { return job_.frame->rate; }

  // Whether the phase of that held match is known for good; and where it has none any more, or its frame has left the
  // history, which prepare_start() deals with.
  [[nodiscard]] bool is_told(std::uint32_t held) const noexcept {
    const FrameRecord* frame = job_.history->find(slot_.held[held].frame_index);
    return frame == nullptr || !frame->measurable || frame->phase.exact;
  }

  [[nodiscard]] bool pressed_long() const noexcept {
    return slot_.pressed && job_.frame->stamp.capture - slot_.pressed_since > kPressedBeforeAnew;
  }

  // Of the first `count` matches that are held, if all their frames are there.
  LifeEvent request_start(std::uint32_t count, StartAsked asked) noexcept {
    slot_.state = SlotState::kTracked;
    if (!prepare_start(slot_, count, job_, model_, settings_.estimator)) return LifeEvent::kNone;
    slot_.start.asked = asked;
    slot_.start.adopt_at_frame = now() + rate().frames(settings_.adoption_delay);
    // Relaxed: housekeeping touches the flag only after it has popped this slot's request, and the ring orders that.
    slot_.start.ready.store(false, std::memory_order_relaxed);
    slot_.start.due = false;
    slot_.state = SlotState::kStarting;
    return LifeEvent::kStartRequested;
  }

  LifeEvent give_up(LifeEvent why) noexcept {
    slot_.clear();
    bank_.clear(feature_);
    return why;
  }

  // The estimate explains nothing any more: gather the observations of a new start. The feature keeps its patch and its
  // id.
  LifeEvent start_anew() noexcept {
    slot_.gather_anew();
    slot_.starts_alone = true;
    bank_.clear(feature_);
    return LifeEvent::kStartedAnew;
  }

  void check_convergence() noexcept {
    FeatureEstimate estimate;
    bank_.get(feature_, estimate);
    add_lasting_errors(slot_, estimate.P);
    slot_.largest_deviation_mm =
        largest_deviation_mm(estimate, settings_.estimator.layout, 16, job_.frame->respiration.known);
    const InnovationMonitor& monitor = slot_.health.monitor();
    const bool recalled = slot_.recalled_converged && monitor.verdict() == InnovationVerdict::kTooFew;
    // From one place the images say nothing of the depth, but updates by a map that is not right yet make its deviation
    // small all the same.
    slot_.converged = slot_.largest_deviation_mm <= settings_.estimator.converged_deviation_mm &&
                      slot_.updates >= kUpdatesBeforeConverged && slot_.aside.known() &&
                      (monitor.consistent() || recalled);
  }

  FeatureSlot& slot_;
  MapBank& bank_;
  int feature_;
  const FrameJob& job_;
  const PixelModel& model_;
  const PipelineSettings& settings_;
};

}  // namespace

LifeEvent advance(FeatureSlot& slot, MapBank& bank, int feature, const FrameJob& job, const PixelModel& model,
                  const PipelineSettings& settings) noexcept {
  Step step(slot, bank, feature, job, model, settings);
  switch (slot.state) {
    case SlotState::kEmpty:
      return LifeEvent::kNone;
    case SlotState::kTracked:
      return step.tracked();
    case SlotState::kStarting:
      return step.starting();
    case SlotState::kMapped:
      return step.mapped();
  }
  return LifeEvent::kNone;
}

}  // namespace perimap

#include "core/pipeline/batch_starter.hpp"

#include <algorithm>
#include <utility>

#include "core/pipeline/pose_noise.hpp"
#include "core/pipeline/try_laws.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

// Features with which the laws are tried, of those that may start at the same beat: each takes as long as another
// start, and starts that wait are adopted late.
constexpr std::size_t kTrials = 40;

}  // namespace

BatchStarter::BatchStarter(const PipelineSettings& settings, std::span<FeatureSlot> slots, SurfaceMaker& surfaces)
    : model_{settings.camera},
      layout_(settings.estimator.layout),
      prior_(settings.estimator.prior),
      batch_(settings.estimator.batch),
      slots_(slots),
      surfaces_(surfaces),
      trial_stride_((slots.size() + kTrials - 1) / kTrials) {
  for (int i = 0; i < settings.workers; ++i) lanes_.push_back(std::make_unique<Lane>(slots.size()));
}

void BatchStarter::request(int worker, int slot) noexcept {
  Lane& lane = *lanes_[static_cast<std::size_t>(worker)];
  if (!lane.ring.push(slot)) return;
  ++lane.requested;
  go_.post();
}

void BatchStarter::serve() noexcept {
  for (;;) {
    go_.wait();
    if (dismissed_.load(std::memory_order_relaxed)) return;
    // One post, one request; which lane it came from is found by looking.
    int slot = 0;
    for (auto& lane : lanes_) {
      if (!lane->ring.pop(slot)) continue;
      solve(slots_[static_cast<std::size_t>(slot)]);
      break;
    }
  }
}

void BatchStarter::dismiss() noexcept {
  dismissed_.store(true, std::memory_order_relaxed);
  go_.post();
}

void BatchStarter::wait_until_done() noexcept {
  const NamedWait wait;
  std::uint64_t requested = 0;
  for (const auto& lane : lanes_) requested += lane->requested;
  for (; waited_for_ < requested; ++waited_for_) solved_.wait();
}

void BatchStarter::solve(FeatureSlot& slot) noexcept {
  const std::span<const Observation> observations(slot.start.observations.data(),
                                                  static_cast<std::size_t>(slot.start.count));
  const StartAsked asked = slot.start.asked;
  slot.start.on_surface = SurfaceStartKind::kNotThere;
  if (asked != StartAsked::kAlone) start_on_newest_surface(slot.start, observations);
  const bool alone = asked != StartAsked::kOnSurface && slot.start.on_surface != SurfaceStartKind::kStarted;
  if (alone) slot.start.outcome = batch_start(observations, model_, layout_, prior_, batch_);
  slot.start.trial.reset();
  const auto number = static_cast<std::size_t>(&slot - slots_.data());
  // A tracker's slow error is no noise that a wrong law could be told from.
  if (alone && slot.start.law.laws().undecided() && slot.slow_error == nullptr && number % trial_stride_ == 0) {
    slot.start.trial = try_laws(slot.start, model_, layout_, prior_, batch_);
  }
  if (slot.slow_error != nullptr && slot.start.outcome.ok()) begin_slow_error(slot);
  // Release: the outcome is complete before the worker can see the flag (pairs with the acquire in feature_life).
  slot.start.ready.store(true, std::memory_order_release);
  solved_.post();
}

// In lockstep, that which was adopted when the start was asked for: the mapper waits for the starts of each frame.
void BatchStarter::start_on_newest_surface(BatchStartExchange& start, std::span<const Observation> observations) {
  const std::shared_ptr<const MadeSurface> made = surfaces_.newest();
  if (made == nullptr || !made->surface) return;
  SurfaceStart begun = start_on_surface(*made->surface, observations, model_, batch_);
  start.on_surface = begun.kind;
  start.outcome = std::move(begun.outcome);
}

void BatchStarter::begin_slow_error(FeatureSlot& slot) const noexcept {
  const BatchStartExchange& start = slot.start;
  const FeatureEstimate& estimate = start.outcome.estimate;
  slot.slow_error->reset();
  PoseNoiseTerm term;
  Instant last = start.captures.front();
  for (std::size_t i = 0; i < static_cast<std::size_t>(start.count); ++i) {
    const Observation& observation = start.observations[i];
    slot.slow_error->pass(to_seconds(start.captures[i] - last));
    last = start.captures[i];
    if (start.outcome.inlier[i] == 0 ||
        !describe_pose_noise(model_, observation.X_CW, start.poses[i], estimate.position(observation.b), term)) {
      continue;
    }
    term.b = observation.b;
    term.R = start.outcome.R[i];
    term.M = position_gain(estimate.P, observation.b);
    slot.slow_error->add_of_batch(term);
  }
}

}  // namespace perimap

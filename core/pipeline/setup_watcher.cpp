#include "core/pipeline/setup_watcher.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/pipeline/match_covariance.hpp"
#include "core/pipeline/phase_basis.hpp"

namespace perimap {
namespace {

// From one round's beginning to the next's: until something is known, and then.
constexpr Duration kRoundEveryAtFirst = std::chrono::milliseconds(1500);
constexpr Duration kRoundEvery = std::chrono::seconds(3);
// From a round's beginning to its adoption.
constexpr Duration kRoundTakes = std::chrono::milliseconds(700);
// Where there is too little for a round yet, until it is looked for again.
constexpr Duration kLookAgain = std::chrono::milliseconds(300);
// What follows is evidence, and counted: equations against unknowns. The window takes a frame in 50 ms, so that it is
// the same at every frame rate from 20 on.
constexpr std::size_t kFewestFrames = 80;  // told ones, before a round
constexpr std::size_t kFewestFeatures = 6;
// A feature's, of those in the window; below, its own motion takes up what it tells.
constexpr std::size_t kFewestMatches = 40;

}  // namespace

SetupWatcher::SetupWatcher(const PipelineSettings& settings)
    : camera_(settings.camera),
      layout_(settings.estimator.layout),
      motion_(settings.estimator.prior),
      pixel_deviation_px_(settings.estimator.pixel_deviation_px),
      error_correlation_s_(to_seconds(settings.pose.error_correlation)),
      hand_over_(settings.lockstep),
      window_(static_cast<std::size_t>(settings.features.maximum)),
      seen_(static_cast<std::size_t>(settings.features.maximum)),
      round_(std::make_unique<Round>()) {
  chosen_.reserve(seen_.size());
}

void SetupWatcher::keep(const FrameHistory& history, std::span<const FeatureSlot> slots, const MapBank& bank) noexcept {
  const FrameRecord& frame = *history.newest();
  window_.tell(history);
  window_.add(frame, slots);
  if (!first_capture_) first_capture_ = frame.stamp.capture;
  if (hand_over_.under_way() || frame.index < next_round_at_) return;
  next_round_at_ = frame.index + frame.rate.frames(kLookAgain);
  // What was judged already tells nothing new: a tool that is hidden, a phase that is lost.
  const std::uint64_t newest_told = window_.newest_told();
  if (newest_told == judged_frame_ || window_.told() < kFewestFrames || !choose_features(slots)) return;
  copy_window(bank, frame.rate);
  if (round_->frame_count < kFewestFrames) return;
  judged_frame_ = newest_told;
  discarded_ = false;
  adopted_at_ = frame.index + frame.rate.frames(kRoundTakes);
  const SetupState told = belief_.told().state;
  const bool known = told == SetupState::kConsistent || told == SetupState::kDoubted;
  next_round_at_ = frame.index + frame.rate.frames(known ? kRoundEvery : kRoundEveryAtFirst);
  hand_over_.begin();
}

void SetupWatcher::adopt(const FrameRecord& frame) noexcept {
  // What is void is not waited for.
  if ((frame.index < adopted_at_ && !discarded_) || !hand_over_.finish()) return;
  if (std::exchange(discarded_, false)) {
    // The same frames tell anew, as they are told now.
    judged_frame_ = 0;
    next_round_at_ = frame.index;
    return;
  }
  belief_.add(verdict_, frame.stamp.capture - *first_capture_);
  status_.write(belief_);
}

const SetupBelief& SetupWatcher::status_belief() noexcept {
  status_.update();
  return status_.front();
}

void SetupWatcher::retell_phases(const CardiacClock& clock) noexcept {
  window_.retell_phases(clock);
  discarded_ = hand_over_.under_way();
}

void SetupWatcher::retell_respiration(const RespiratoryClock& respiration) noexcept {
  window_.retell_respiration(respiration);
  discarded_ = hand_over_.under_way();
}

void SetupWatcher::disown_poses(std::uint64_t since_frame) noexcept {
  window_.disown(since_frame);
  discarded_ = hand_over_.under_way();
}

void SetupWatcher::begin_window_anew() noexcept {
  window_.clear();
  discarded_ = hand_over_.under_way();
}

// Those with most matches in frames that are told, of the features that are mapped now.
bool SetupWatcher::choose_features(std::span<const FeatureSlot> slots) noexcept {
  for (std::size_t slot = 0; slot < slots.size(); ++slot) seen_[slot] = {slots[slot].id, 0, kNotChosen};
  for (std::uint64_t number = window_.begin(); number != window_.end(); ++number) {
    if (window_.frame(number).state != WindowFrame::State::kTold) continue;
    for (const WindowMatch& match : window_.matches(number)) {
      seen_[match.slot].matches += match.id == seen_[match.slot].id ? 1 : 0;
    }
  }
  chosen_.clear();
  for (std::size_t slot = 0; slot < slots.size(); ++slot) {
    if (slots[slot].state == SlotState::kMapped && seen_[slot].matches >= kFewestMatches) chosen_.push_back(slot);
  }
  if (chosen_.size() < kFewestFeatures) return false;
  const std::size_t count = std::min(chosen_.size(), kFeatures);
  std::partial_sort(chosen_.begin(), chosen_.begin() + static_cast<std::ptrdiff_t>(count), chosen_.end(),
                    [this](std::size_t a, std::size_t b) {
                      return seen_[a].matches > seen_[b].matches || (seen_[a].matches == seen_[b].matches && a < b);
                    });
  chosen_.resize(count);
  for (std::size_t i = 0; i < count; ++i) seen_[chosen_[i]].number = i;
  return true;
}

void SetupWatcher::copy_window(const MapBank& bank, const FrameRate& rate) noexcept {
  Round& round = *round_;
  round.feature_count = chosen_.size();
  for (std::size_t i = 0; i < chosen_.size(); ++i) bank.get(static_cast<int>(chosen_[i]), round.x[i]);
  round.frame_count = 0;
  round.rate = rate;
  for (std::uint64_t number = window_.begin(); number != window_.end(); ++number) {
    const WindowFrame& frame = window_.frame(number);
    if (frame.state != WindowFrame::State::kTold) continue;
    std::size_t& count = round.counts[round.frame_count];
    count = 0;
    for (const WindowMatch& match : window_.matches(number)) {
      const Seen& seen = seen_[match.slot];
      if (seen.number == kNotChosen || seen.id != match.id) continue;
      WindowMatch& copied = round.matches[round.frame_count][count++];
      copied = match;
      copied.slot = seen.number;
    }
    if (count >= kFewestFeatures) round.frames[round.frame_count++] = frame;
  }
}

void SetupWatcher::recall(const SetupMemory& memory) noexcept {
  belief_.recall(memory);
  status_.write(belief_);
}

void SetupWatcher::tell(FrameDoubts& doubts, double bound_mm) const noexcept {
  doubts.setup_doubted = belief_.doubted();
  doubts.setup_widening_mm = belief_.widening_mm();
  doubts.converged_within_mm = belief_.within_mm(bound_mm);
}

void SetupWatcher::serve() noexcept {
  hand_over_.serve([this] { judge(); });
}

void SetupWatcher::dismiss() noexcept { hand_over_.dismiss(); }

void SetupWatcher::judge() noexcept {
  const Round& round = *round_;
  const double alike = matches_alike(FrameRate(std::min(round.rate.per_s(), 1.0 / to_seconds(MatchWindow::kEvery))));
  WatchedWindow window;
  window.error_correlation_s = error_correlation_s_;
  window.features.assign(round.x.begin(), round.x.begin() + static_cast<std::ptrdiff_t>(round.feature_count));
  for (std::size_t f = 0; f < round.frame_count; ++f) {
    const WindowFrame& from = round.frames[f];
    WatchedFrame& frame = window.frames.emplace_back();
    frame.t_s = to_seconds(from.capture - round.frames.front().capture);
    frame.X_WC = from.X_WC;
    frame.twist = from.twist;
    frame.lever_W_mm = from.lever_W_mm;
    // What is not known of breathing moves all alike, as an error of the position does.
    frame.position_variance_mm2 =
        from.tracker_variance_mm2 + from.respiration.deviation_mm * from.respiration.deviation_mm;
    frame.rotation_variance_rad2 = from.rotation_variance_rad2;
    frame.b = basis_at(layout_, from.phase.phase_rad, from.respiration);
    frame.b_rate = basis_rate(layout_, from.phase.phase_rad) * from.phase.rate_rad_per_s;
    frame.phase_deviation_s = from.phase.deviation_s;
    for (std::size_t i = 0; i < round.counts[f]; ++i) {
      const WindowMatch& match = round.matches[f][i];
      frame.matches.push_back(
          {static_cast<int>(match.slot), match.px, match_covariance(match.covariance_px2, pixel_deviation_px_, alike)});
    }
  }
  SetupFitSettings settings;
  settings.motion = motion_;
  verdict_ = judge_setup(fit_setup(window, camera_, layout_, settings));
}

}  // namespace perimap

#include "core/estimation/feature_health.hpp"

#include <algorithm>
#include <limits>

namespace perimap {

FeatureHealth::FeatureHealth(const FeatureHealthSettings& settings) noexcept
    : settings_(settings), fast_(settings.fast), slow_(settings.slow) {}

void FeatureHealth::reset() noexcept {
  fast_.reset();
  set_level(0);
  high_in_a_row_ = 0;
  since_inflation_ = -1;
  failed_ = false;
}

void FeatureHealth::set_level(std::size_t level) noexcept {
  level_ = level;
  since_change_ = 0;
  slow_.reset();
}

HealthAction FeatureHealth::add(double nis, bool accepted, double common, const FrameRate& rate) noexcept {
  const auto updates = [&rate](Duration time) { return static_cast<int>(rate.frames(time)); };
  constexpr int kCountLimit = 1'000'000;
  // To the fast one it makes no difference why the phase is wrong.
  fast_.add(accepted ? nis : std::numeric_limits<double>::infinity());
  if (accepted) slow_.add(nis, common);
  since_change_ = std::min(since_change_ + 1, kCountLimit);
  if (since_inflation_ >= 0) since_inflation_ = std::min(since_inflation_ + 1, kCountLimit);

  const std::size_t most = settings_.process_noise.size() - 1;
  high_in_a_row_ = fast_.high() ? std::min(high_in_a_row_ + 1, kCountLimit) : 0;
  if (fast_.high()) {
    if (high_in_a_row_ < updates(settings_.before_inflation)) return HealthAction::kNone;
    if (since_inflation_ < 0) {
      since_inflation_ = 0;
      high_in_a_row_ = 0;
      fast_.reset();
      set_level(most);
      return HealthAction::kInflate;
    }
    if (since_inflation_ < updates(settings_.after_inflation) || failed_) return HealthAction::kNone;
    failed_ = true;
    return HealthAction::kStartAnew;
  }
  if (since_inflation_ >= updates(settings_.before_less) && fast_.consistent()) since_inflation_ = -1;
  const bool drifts = slow_.verdict() == InnovationVerdict::kElevated || slow_.high();
  if (drifts && level_ < most && since_change_ >= updates(settings_.before_more)) {
    set_level(level_ + 1);
  } else if (level_ > 0 && since_change_ >= updates(settings_.before_less) && !slow_.above(settings_.calm_below)) {
    set_level(level_ - 1);
  }
  return HealthAction::kNone;
}

HealthState FeatureHealth::state() const noexcept {
  if (failed_) return HealthState::kFailed;
  if (since_inflation_ >= 0 && !fast_.consistent()) return HealthState::kInconsistent;
  if (fast_.verdict() == InnovationVerdict::kTooFew) return HealthState::kUndecided;
  if (fast_.high()) return HealthState::kInconsistent;
  return level_ > 0 ? HealthState::kDrifting : HealthState::kConsistent;
}

}  // namespace perimap

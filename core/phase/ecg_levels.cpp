#include "core/phase/ecg_levels.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr int kQuietRecompute = 5;       // steps: each 0.1 s; it does not change faster
constexpr double kNoiseRise_s = 1000.0;  // tense muscles and a patient who moves are noisy for minutes
constexpr int kFewWindows = 3;           // fewer are no distribution: the largest of all counts
constexpr int kOfLate = 3;               // windows: where none of them reaches what was usual, the gain has fallen

}  // namespace

void EcgLevels::restart() noexcept {
  quiet_count_ = 0;
  in_window_ = false;
  energy_ = 0.0;
  sharpness_ = 0.0;
}

void EcgLevels::forget() noexcept {
  restart();
  quiet_level_ = 0.0;
  noise_level_ = 0.0;
  noise_known_ = false;
  rough_level_ = 0.0;
  energies_.clear();
  sharpnesses_.clear();
  kept_energies_.clear();
  kept_sharpnesses_.clear();
}

void EcgLevels::forget_top(bool keep) noexcept {
  if (keep) {
    kept_energies_ = energies_;
    kept_sharpnesses_ = sharpnesses_;
  }
  const double energy = energies_.count() > 0 ? energies_.newest() : 0.0;
  const double sharpness = sharpnesses_.count() > 0 ? sharpnesses_.newest() : 0.0;
  energies_.clear();
  sharpnesses_.clear();
  if (!(energy > 0.0)) return;
  energies_.push(energy);
  sharpnesses_.push(sharpness);
}

void EcgLevels::recall_top() noexcept {
  if (kept_energies_.count() == 0) return;
  energies_ = kept_energies_;
  sharpnesses_ = kept_sharpnesses_;
  kept_energies_.clear();
  kept_sharpnesses_.clear();
}

void EcgLevels::follow(const EcgFilter& filter, double beat_slope, bool burst) noexcept {
  follow_quiet(filter);
  follow_roughness(filter, beat_slope);
  follow_top(filter, burst);
}

void EcgLevels::follow_quiet(const EcgFilter& filter) noexcept {
  if (filter.at(filter.now()).time < rough_until_) return;
  if (filter.now() % filter.samples_in(settings_.quiet_step) != 0) return;
  quiet_[static_cast<std::size_t>(quiet_count_ % kQuietHistory)] = filter.at(filter.now()).energy;
  ++quiet_count_;
  if (quiet_count_ % kQuietRecompute != 0) return;
  auto sorted = quiet_;
  const auto count = std::min<std::int64_t>(quiet_count_, kQuietHistory);
  const auto quantile =
      sorted.begin() + static_cast<std::int64_t>(settings_.quiet_quantile * static_cast<double>(count));
  std::nth_element(sorted.begin(), quantile, sorted.begin() + count);
  quiet_level_ = *quantile;
  follow_noise();
}

// What the line is never quieter than. As with roughness, a burst does not become the usual.
void EcgLevels::follow_noise() noexcept {
  if (quiet_count_ < kQuietHistory) {
    if (!noise_known_) noise_level_ = quiet_level_;
    return;
  }
  const double step_s = to_seconds(kQuietRecompute * settings_.quiet_step);
  const double risen = noise_level_ * (1.0 + step_s / kNoiseRise_s);
  noise_level_ = noise_known_ ? std::min(quiet_level_, risen) : quiet_level_;
  noise_known_ = noise_level_ > 0.0;
}

// The largest of each window, but of those in which nothing can be seen.
void EcgLevels::follow_top(const EcgFilter& filter, bool burst) noexcept {
  const EcgSample& sample = filter.at(filter.now());
  if (burst || sample.time < rough_until_) {
    in_window_ = false;
    energy_ = 0.0;
    sharpness_ = 0.0;
    return;
  }
  if (!in_window_) {
    in_window_ = true;
    window_began_ = sample.time;
  }
  energy_ = std::max(energy_, sample.energy);
  sharpness_ = std::max(sharpness_, sample.sharpness);
  if (sample.time - window_began_ < settings_.window) return;
  energies_.push(energy_);
  sharpnesses_.push(sharpness_);
  energy_ = 0.0;
  sharpness_ = 0.0;
  window_began_ = sample.time;
}

double EcgLevels::top(const RecentValues<kWindows>& windows, double current) noexcept {
  if (windows.count() == 0) return current;
  const double usual = windows.median();
  if (windows.count() < kFewWindows) return std::max(usual, current);
  return std::min(usual, std::max(current, windows.largest_of_last(kOfLate)));
}

// Electrosurgery, chewing, a loose cable: as strong as the beats and too fast to be any. The usual roughness (mains
// hum) is followed slowly upward, so that a burst does not become the usual.
void EcgLevels::follow_roughness(const EcgFilter& filter, double beat_slope) noexcept {
  const EcgSample& sample = filter.at(filter.now());
  const double rough = sample.rough;
  if (!filter.filled()) {
    smooth_at_ = usual_at_ = sample.time;
    rougher_ = false;
    return;
  }
  const double risen = rough_level_ * (1.0 + to_seconds(filter.period()) / settings_.rough_rise_s);
  rough_level_ = rough_level_ > 0.0 ? std::min(rough, risen) : rough;
  if (rough < settings_.rough * rough_level_) usual_at_ = sample.time;
  rougher_ = sample.time - usual_at_ > settings_.rough_at_least;
  if (!(beat_slope > 0.0)) {
    smooth_at_ = sample.time;
    return;
  }
  const double limit = std::max(settings_.rough * rough_level_, settings_.rough_to_beats * beat_slope);
  if (rough < (sample.time < rough_until_ ? settings_.rough_hysteresis * limit : limit)) smooth_at_ = sample.time;
  if (sample.time - smooth_at_ < settings_.rough_at_least) return;
  if (sample.time > rough_until_) rough_since_ = smooth_at_ - settings_.rough_before;
  rough_until_ = sample.time + settings_.rough_after;
}

}  // namespace perimap

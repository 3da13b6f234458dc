#include "core/phase/respiratory_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

// Random walks, per second: phase 0.02 rad (0.3 % of a breath), rate 0.003 rad/s.
constexpr double kPhaseWalk_rad2_per_s = 0.02 * 0.02;
constexpr double kRateWalk_rad2_per_s3 = 0.003 * 0.003;
// Of a displacement that a map tells that is not good yet.
constexpr double kDisplacementDeviation_mm = 2.0;
// What a breath may differ from the one before in how the surface goes with the channel.
constexpr double kLeastChannelDeviation_rad = 0.1;
constexpr double kGate = 13.8;  // chi-squared, 1 degree: 99.98 %
// Shares of the displacement that breathing explains.
constexpr double kSuspected = 0.2;
constexpr double kConfirmed = 0.5;
constexpr int kSuspectedInARow = 2;  // searches: what a young map gets wrong comes and goes
// A heart that beats irregularly moves a young map's displacement more than breathing does. What looks like breathing
// in it for some seconds has no period that stays; that of a ventilator does.
constexpr double kPersistentExplained = 0.4;
constexpr double kPersistentDeviation_rad = 0.4;
constexpr double kSamePeriod = 0.015;  // share
constexpr Duration kPersists = std::chrono::seconds(10);
constexpr Duration kSuspicionLasts = std::chrono::seconds(15);
// Sooner where so many searches in a row, in which a pause of some seconds has no room, find that little of the wave in
// the last breaths.
constexpr double kGone = 0.5;  // of what is suspected
constexpr int kGoneInARow = 4;
constexpr Duration kLongestTold = std::chrono::milliseconds(200);  // by one frame
constexpr Duration kContradictedBeforeSearch = std::chrono::milliseconds(1500);
constexpr Duration kSilentBeforeSearch = std::chrono::seconds(15);
// Of a phase to go on from: beyond it the wave is no straight line, and the images may agree with a wrong phase.
constexpr double kLargestRecalledDeviation_rad = 0.5;

RespirationSearchSettings search_settings(const RespirationSettings& settings) noexcept {
  RespirationSearchSettings search = settings.search;
  // A suspicion needs neither phase nor period so well, and the search is then everybody's.
  if (!settings.enabled) search.seconds_left_out = 0;
  return search;
}

}  // namespace

RespiratoryTracker::RespiratoryTracker(const RespirationSettings& settings) noexcept
    : settings_(settings), search_(search_settings(settings)) {
  clock_.state = settings.enabled ? RespirationState::kSearching : RespirationState::kOff;
  clock_.unknown_displacement_mm = settings.displacement_mm;
}

void RespiratoryTracker::add_displacement(Instant t, const Eigen::Vector3d& displacement_mm,
                                          double cardiac_phase_rad) noexcept {
  if (!displacement_mm.allFinite()) return;
  if (clock_.state != RespirationState::kLocked) {
    search_.add(t, displacement_mm, cardiac_phase_rad);
    return;
  }
  // Where the surface is displaced along the wave, the phase is.
  const double phase_rad = clock_.at(t).phase_rad;
  const Eigen::Vector3d slope = wave_.slope_at(phase_rad);
  const double square = slope.squaredNorm();
  if (!(square > 0.0)) return;
  add_phase(t, phase_rad + std::clamp(displacement_mm.dot(slope) / square, -1.0, 1.0),
            kDisplacementDeviation_mm / std::sqrt(square));
}

void RespiratoryTracker::search(Instant now) noexcept {
  if (clock_.state == RespirationState::kLocked) {
    if (now - last_told_ > kSilentBeforeSearch) lose();
    return;
  }
  FoundBreath found;
  const bool by_channel = channel_known_ && clock_.state == RespirationState::kSearching;
  const double channel_rate_rad_per_s = by_channel ? kTwoPi / to_seconds(channel_.period) : 0.0;
  const bool there = by_channel ? search_.find_at(channel_rate_rad_per_s, found) : search_.find(found);
  if (clock_.state == RespirationState::kOff) {
    suspect(found, now);
    return;
  }
  if (!there && !persists(found, now)) return;
  // The coefficients that the map has learnt count from where the phase was zero then.
  double turn_rad = locks_ > 0 ? alignment(found.wave, wave_) : 0.0;
  if (by_channel) {
    const double channel_rad = channel_.phase_at(found.time);
    if (!offset_known_) offset_rad_ = locks_ > 0 ? -turn_rad - channel_rad : 0.0;
    offset_known_ = true;
    turn_rad = -(channel_rad + offset_rad_);
    const double rate_deviation = channel_rate_rad_per_s * to_seconds(channel_.deviation) / to_seconds(channel_.period);
    found.rate_variance_rad2_per_s2 = rate_deviation * rate_deviation;
  }
  wave_ = found.wave.shifted(turn_rad);
  clock_.state = RespirationState::kLocked;
  clock_.source = by_channel ? RespirationSource::kChannel : RespirationSource::kImage;
  clock_.time = found.time;
  clock_.phase_rad = std::remainder(-turn_rad, kTwoPi);
  clock_.rate_rad_per_s = found.rate_rad_per_s;
  clock_.phase_variance_rad2 = found.phase_variance_rad2;
  clock_.covariance_rad2_per_s = found.covariance_rad2_per_s;
  clock_.rate_variance_rad2_per_s2 = found.rate_variance_rad2_per_s2;
  clock_.slope_mm_per_rad = wave_.slope_mm_per_rad() / std::numbers::sqrt3;
  last_agreed_ = last_told_ = now;
  ++locks_;
  first_breath_ = clock_.period();
  told_for_ = Duration(0);
  candidate_period_s_ = 0.0;
  search_.clear();
}

bool RespiratoryTracker::persists(const FoundBreath& found, Instant now) noexcept {
  const bool candidate = found.reaches(kPersistentExplained, settings_.search.least_rms_mm, kPersistentDeviation_rad);
  const double period_s = candidate ? kTwoPi / found.rate_rad_per_s : 0.0;
  if (!candidate || !(std::abs(period_s - candidate_period_s_) <= kSamePeriod * candidate_period_s_)) {
    candidate_period_s_ = period_s;
    candidate_since_ = now;
    return false;
  }
  return now - candidate_since_ >= kPersists;
}

void RespiratoryTracker::track_signal(const BreathSignal& signal, Instant now) noexcept {
  if (!settings_.enabled) return;
  const bool breathed = channel_known_;
  const bool another = signal.onsets != channel_.onsets;
  channel_ = signal;
  channel_known_ = signal.known(now);
  if (clock_.state != RespirationState::kLocked) return;
  clock_.source = channel_known_ && offset_known_ ? RespirationSource::kChannel : RespirationSource::kImage;
  if (!channel_known_) {
    if (breathed && signal.heard(now)) lose();
    return;
  }
  if (!another) return;
  if (!offset_known_) {
    offset_rad_ = clock_.at(now).phase_rad - signal.phase_at(now);
    offset_known_ = true;
    return;
  }
  hear(now, signal.phase_at(now) + offset_rad_,
       std::max(kLeastChannelDeviation_rad, kTwoPi * to_seconds(signal.deviation) / to_seconds(signal.period)), true);
}

// A map without breathing follows it in part, which leaves a weak trace of it. That is enough to reckon with its
// displacement; the map then stands still, and breathing shows clearly or not at all. Of a map that was young the
// displacement may look like two or three breaths, which half a minute remembers: the last breaths must show them too.
void RespiratoryTracker::suspect(const FoundBreath& found, Instant now) noexcept {
  const auto is_there = [this](const FoundBreath& wave, double least_explained) {
    return wave.wave.rms_mm() >= settings_.suspected_rms_mm && wave.explained >= least_explained;
  };
  const bool there = is_there(found, clock_.suspected ? kConfirmed : kSuspected) &&
                     is_there(search_.lately(found.rate_rad_per_s), kSuspected);
  in_a_row_ = there ? in_a_row_ + 1 : 0;
  if (in_a_row_ >= kSuspectedInARow) {
    clock_.suspected = true;
    last_agreed_ = now;
    suspected_rad_per_s_ = found.rate_rad_per_s;
  }
  const bool gone = search_.lately(suspected_rad_per_s_).wave.rms_mm() < kGone * settings_.suspected_rms_mm;
  gone_in_a_row_ = clock_.suspected && suspected_rad_per_s_ > 0.0 && gone ? gone_in_a_row_ + 1 : 0;
  if (gone_in_a_row_ >= kGoneInARow || now - last_agreed_ > kSuspicionLasts) {
    clock_.suspected = false;
    suspected_rad_per_s_ = 0.0;
    gone_in_a_row_ = 0;
  }
}

void RespiratoryTracker::predict(Instant t) noexcept {
  const double dt = to_seconds(t - clock_.time);
  if (!(dt > 0.0)) return;
  clock_.time = t;
  clock_.phase_rad = std::remainder(clock_.phase_rad + clock_.rate_rad_per_s * dt, kTwoPi);
  // The rate's walk, once and twice integrated, matters after a restart, when dt is seconds.
  const double rate_walk = dt * kRateWalk_rad2_per_s3;
  clock_.phase_variance_rad2 +=
      dt * (2.0 * clock_.covariance_rad2_per_s + dt * (clock_.rate_variance_rad2_per_s2 + rate_walk / 3.0) +
            kPhaseWalk_rad2_per_s);
  clock_.covariance_rad2_per_s += dt * (clock_.rate_variance_rad2_per_s2 + rate_walk / 2.0);
  clock_.rate_variance_rad2_per_s2 += rate_walk;
}

bool RespiratoryTracker::rate_is_possible() const noexcept {
  const double fastest = kTwoPi / to_seconds(settings_.search.shortest_period);
  const double slowest = kTwoPi / to_seconds(settings_.search.longest_period);
  return clock_.rate_rad_per_s < 1.5 * fastest && clock_.rate_rad_per_s > slowest / 1.5;
}

// A clock that was not corrected yet has taught the map nothing that could be gone on from as if it were true.
RespirationMemory RespiratoryTracker::memory() const noexcept {
  RespirationMemory memory{locks_ > 0, wave_, clock_, offset_known_, offset_rad_};
  if (memory.clock.state == RespirationState::kLocked && !clock_.corrected) {
    memory.clock.state = RespirationState::kSearching;
  }
  return memory;
}

void RespiratoryTracker::recall(const RespirationMemory& memory, Instant now) noexcept {
  last_agreed_ = last_told_ = now;
  if (!settings_.enabled) {
    clock_.suspected = memory.clock.suspected;
    return;
  }
  if (!memory.found) return;
  locks_ = 1;
  wave_ = memory.wave;
  offset_known_ = memory.offset_known;
  offset_rad_ = memory.offset_rad;
  if (memory.clock.state != RespirationState::kLocked) return;
  const double unknown_displacement_mm = clock_.unknown_displacement_mm;
  clock_ = memory.clock;
  clock_.corrected = true;
  clock_.source = RespirationSource::kImage;
  clock_.slope_mm_per_rad = wave_.slope_mm_per_rad() / std::numbers::sqrt3;
  clock_.unknown_displacement_mm = unknown_displacement_mm;
  clock_.suspected = false;
  predict(now);
  constexpr double kLargestVariance_rad2 = kLargestRecalledDeviation_rad * kLargestRecalledDeviation_rad;
  if (!(clock_.phase_variance_rad2 < kLargestVariance_rad2) || !rate_is_possible()) lose();
}

void RespiratoryTracker::add_phase(Instant t, double phase_rad, double deviation_rad) noexcept {
  if (clock_.state != RespirationState::kLocked) return;
  const Duration since = t - last_agreed_;
  hear(t, phase_rad, deviation_rad, clock_.corrected || told_for_ >= first_breath_);
  if (last_agreed_ != t || clock_.state != RespirationState::kLocked) return;
  told_for_ += std::min(since, kLongestTold);
  if (told_for_ >= first_breath_ + clock_.period() / 2) clock_.corrected = true;
}

void RespiratoryTracker::hear(Instant t, double phase_rad, double deviation_rad, bool corrects) noexcept {
  predict(t);
  last_told_ = t;
  const double innovation = std::remainder(phase_rad - clock_.phase_rad, kTwoPi);
  const double variance = clock_.phase_variance_rad2 + deviation_rad * deviation_rad;
  if (innovation * innovation > kGate * variance) {
    add_contradiction(t);
    return;
  }
  last_agreed_ = t;
  if (!corrects) return;
  const double K_phase = clock_.phase_variance_rad2 / variance;
  const double K_rate = clock_.covariance_rad2_per_s / variance;
  clock_.phase_rad += K_phase * innovation;
  clock_.rate_rad_per_s += K_rate * innovation;
  clock_.rate_variance_rad2_per_s2 -= K_rate * clock_.covariance_rad2_per_s;
  clock_.covariance_rad2_per_s *= 1.0 - K_phase;
  clock_.phase_variance_rad2 *= 1.0 - K_phase;
  if (!rate_is_possible()) lose();
}

void RespiratoryTracker::add_contradiction(Instant t) noexcept {
  if (clock_.state == RespirationState::kLocked && t - last_agreed_ > kContradictedBeforeSearch) lose();
}

void RespiratoryTracker::lose() noexcept {
  clock_.state = RespirationState::kSearching;
  clock_.source = RespirationSource::kNone;
  candidate_period_s_ = 0.0;
  search_.clear();
}

}  // namespace perimap

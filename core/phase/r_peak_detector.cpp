#include "core/phase/r_peak_detector.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Where no other reason stands beside it, a number was chosen so that the five records of docs/evidence/ecg.md, plain
// and with the disturbances tabled there, lose the fewest beats by one set of numbers.

// ---- the signal

constexpr Duration kJitter = std::chrono::microseconds(1500);  // of stamps that are rounded to a millisecond
constexpr Duration kPadding = milliseconds(200);  // more than the filters' delay and the stretch behind a QRS complex
constexpr Duration kFlatAfter = seconds(1);       // a converter repeats itself for a fraction of that in diastole
constexpr double kHardly = 0.03;  // of the beats' excursions: a bit or two of an amplifier at its limit,
constexpr Duration kHardlyAfter = milliseconds(2500);  // for longer than a diastole lasts at 30 beats a minute
constexpr Duration kForgetAfter = seconds(30);         // of interruption: by then the electrode sits elsewhere

// ---- maxima of the energy

constexpr Duration kConfirm = milliseconds(50);  // a maximum is one when nothing exceeded it for so long,
constexpr double kConfirmFall = 0.75;            // or when the energy has fallen to this share of it
constexpr double kRiseAgain = 1.5;               // the next one begins when the energy has risen by this factor: ripple

// ---- the matched filter

constexpr Duration kShapeStep = milliseconds(5);  // averages of 20 ms pass little above 50 Hz: four points a period
// Half of a wide (ventricular) QRS complex and its onset, and no more after the peak than the delay allows. Not round:
// at the usual rates a whole number of steps would be one more or less by the last digit of the sample period.
constexpr Duration kShapeBefore = milliseconds(91);
constexpr Duration kShapeAfter = milliseconds(49);
constexpr Duration kFitReach = milliseconds(60);  // a maximum of the energy and a fit so far apart are one complex
constexpr Duration kFitAwait = milliseconds(30);  // how long a maximum of the energy waits for a fit after its middle
constexpr int kFitConfirm = 3;                    // steps after which a maximum of the correlation is one
constexpr double kFamiliar = 0.8;                 // correlation of a beat in the noise that the averages let through
constexpr double kAlike = 0.6;                    // enough to be a candidate in noise, which the rhythm then decides
constexpr double kSurelyFamiliar = 0.85;          // as alike as beats are that share a template
constexpr double kLeastGain = 0.4;                // of a familiar beat, to its template: P and T waves are smaller
constexpr double kSureGain = 0.6;                 // a smaller one must be the more alike:
constexpr double kSureCorrelation = 0.9;          // so much
constexpr double kCutOffCorrelation = 0.95;       // of a complex that the end of the signal cuts off: half is made up
constexpr double kMostGain = 3.0;                 // ectopic beats exceed the usual ones by less
constexpr double kSameGain = 0.3;  // logarithm: two beats in a row so much alike tell that the gain has changed

// ---- the peak and its time

constexpr Duration kPeakWindow = milliseconds(80);     // each side of the complex's middle: wide complexes take 160 ms
constexpr Duration kFitPeakWindow = milliseconds(15);  // as far as peaks of one shape are displaced (qrs_shape)
constexpr Duration kBaselineBefore = milliseconds(200);  // so that the complex is the smaller part of the stretch
constexpr Duration kParabola = milliseconds(10);         // each side of the peak: an R wave is a parabola so far
constexpr double kOpposite = 2.0;  // a beat points the other way when its other excursion is larger by this factor
constexpr double kPolarityHysteresis = 1.3;  // an RS complex of equal parts must not change sides with each beat
constexpr double kPolarityMemory = 8.0;      // beats, as the levels
constexpr double kDeviationFloor_s = 0.001;  // clean beats scatter by that about their peaks (docs/evidence/ecg.md)
constexpr double kDeviationCap_s = 0.020;    // where there is no vertex: uniform over the complex's top
// Of an unfamiliar beat in noise that is taken because one is due: it may be noise beside the true one, anywhere within
// the 150 ms of a match. Uniform over that makes 87 ms; twelve such beats of the records have 85 ms RMS.
constexpr double kDoubtfulDeviation_s = 0.087;

// ---- the quiet level

constexpr Duration kQuietStep = milliseconds(20);  // the energy is a mean of 80 ms: nothing is missed
constexpr int kQuietRecompute = 5;                 // steps: each 0.1 s; it does not change faster
constexpr double kQuietQuantile = 0.3;             // of the last 2.5 s: diastole even at 180 beats a minute
constexpr double kStandOut = 3.5;                  // times the quiet level; bare noise reaches it about once a minute
constexpr double kFamiliarStandOut = 1.5;          // a known shape needs less, but noise alone may resemble it
constexpr double kQuanta = 2.0;                    // times the converter's resolution; a single step of it reaches 0.75

// ---- roughness

constexpr double kRough = 4.0;            // times the usual roughness,
constexpr double kRoughToBeats = 0.5;     // and this share of the beats' slope over 20 ms: nothing can be seen
constexpr double kRoughHysteresis = 0.5;  // a burst fluctuates about its limit
constexpr double kRoughRise_s = 30.0;     // longer than a burst lasts, shorter than hum that comes to stay
constexpr Duration kRoughAtLeast = milliseconds(200);  // a QRS complex is rough for less
constexpr Duration kRoughBefore = milliseconds(100);   // the burst begins before its mean is rough,
constexpr Duration kRoughAfter = milliseconds(150);    // and the filters ring after it

// ---- learning

constexpr Duration kLearning = seconds(2);                // holds two beats at 60 a minute,
constexpr Duration kLearningWindow = milliseconds(3500);  // and this at 35
constexpr Duration kLearningAtMost = seconds(6);          // then what stands out will do, recurring or not
constexpr double kRecurringEnergy = 0.4;        // of the strongest: T waves and most ectopic beats' neighbours are out,
constexpr int kRecurringDisplaced = 3;          // steps; the peaks of unknown shapes are found so far apart,
constexpr double kRecurringShare = 0.4;         // of those of its size: in bigeminy every other one is like it
constexpr Duration kRelearnAfter = seconds(3);  // without a beat: longer than a compensatory pause,
constexpr double kRelearnCycles = 3.0;          // and usual cycles
constexpr double kSameEnergy = 2.0;             // factor within which two disturbing candidates are of one size
constexpr double kThreshold = 0.3;              // of the way from noise level to beat level
constexpr double kNoiseMemory = 8.0;            // candidates; as Pan & Tompkins

// ---- which candidate is a beat

constexpr Duration kRefractory = milliseconds(200);       // of the ventricles (Pan & Tompkins)
constexpr Duration kAfterUnfamiliar = milliseconds(100);  // a familiar beat so soon after an unfamiliar one counts
constexpr double kOutshines = 3.0;   // or after one of less than a third of its energy: that was a P wave
constexpr double kTWave = 0.45;      // s / sqrt(cycle in s), the end of the T wave (Bazett 1920): before it, what has
constexpr double kTWaveSlope = 0.5;  // less than this share of the last beat's slope is its T wave;
constexpr double kTWaveLevel = 0.8;  // the last one may have been small: at least this share of the usual slope
constexpr double kUnfamiliarStrength = 0.5;         // an ectopic beat is rarely smaller; P and T waves are
constexpr double kUnfamiliarMost = 6.0;             // times the usual energy: a disturbance, or another gain
constexpr double kDisturbance = 0.33;               // size from which on what is no beat says that there is noise
constexpr Duration kNoisyFor = seconds(2);          // after a disturbance: they come in trains
constexpr Duration kStepReach = milliseconds(100);  // each side, outside the complex
constexpr double kStep = 0.85;           // change of level to the excursions, from which on the electrode has moved
constexpr double kVeryLike = 0.93;       // a held candidate so much alike is a beat whatever the rhythm
constexpr double kOtherStrength = 0.45;  // of a beat that is of a rare template: such as the P wave's,
constexpr double kEstablishedStrength = 0.3;    // and of a frequent one
constexpr double kDoubtfulStrength = 0.4;       // in quiet, a small beat of this size is decided
constexpr Duration kDoubt = milliseconds(250);  // after so long, when a P wave's own QRS complex would have come
constexpr double kMissed = 1.45;                // usual cycles between two familiar beats: there was one in between
constexpr double kInRhythm = 0.15;  // of the cycle: a beat in time after an unfamiliar one shows that as noise

// ---- search back

constexpr double kHeldOverdue = 1.5;     // usual cycles after which the held candidate is taken
constexpr double kSearchBackLike = 0.7;  // where the beats' shape is known: with this correlation and size,
constexpr double kSearchBackSize = 0.35;
constexpr double kSearchBackVeryLike = 0.88;  // or with these
constexpr double kSearchBackLeastSize = 0.2;
constexpr double kTimely = 0.2;       // of the usual cycle: standard deviation within which a held candidate is in time
constexpr double kUntimely = 0.1;     // weight of one at any other time,
constexpr double kLeastLike = 0.2;    // and correlation that an unlike one counts with: neither excludes a beat
constexpr double kSearchBack = 1.66;  // cycles without a beat after which a weaker candidate is taken (Pan & Tompkins),
constexpr double kSearchBackThreshold = 0.5;             // above this share of the threshold (likewise)
constexpr Duration kSearchBackWait = milliseconds(300);  // longer than a PR interval: a P wave's QRS complex has come
constexpr double kRhythmAtStart_s = 1.2;  // until an interval is known: slow, so that nothing is sought too early
constexpr double kSlowestRhythm_s = 2.0;  // a block must not make the search back wait for ever
constexpr double kDeafness_s = 1.0;       // that threshold falls by e in this time: the gain may have changed

// ---- trust: how sure each way to a beat is, before resemblance and noise lower the confidence

constexpr double kTrustFamiliar = 1.0;
constexpr double kTrustNew = 0.8;            // while no shape is known
constexpr double kTrustUnfamiliar = 0.7;     // in quiet
constexpr double kTrustBetween = 0.5;        // in noise or weak, but the rhythm has a gap there
constexpr double kTrustOverdue = 0.4;        // in noise, because one is due
constexpr double kLearnt = 0.7;              // from this trust on a beat teaches rhythm and shapes
constexpr double kUnlike = 0.5;              // correlation at which a familiar beat's confidence would be 0,
constexpr double kAsAlikeAsAny = 0.4;        // and what above it makes it 1
constexpr double kUnknownResemblance = 0.7;  // of a shape that has not been seen: that alone is no reason to disbelieve

}  // namespace

RPeakDetector::RPeakDetector() noexcept {
  forget();
  restart_signal();
}

void RPeakDetector::forget() noexcept {
  period_ = Duration::zero();
  quiet_level_ = 0.0;
  filter_.forget();
  noise_level_ = 0.0;
  rough_level_ = 0.0;
  other_gain_ = 0.0;
  beat_energy_.clear();
  beat_slope_.clear();
  rr_s_.clear();
  templates_.clear();
  learning_ = true;
  learnt_for_ = Duration::zero();
  learnt_count_ = 0;
  upward_ = 0.0;
  downward_ = 0.0;
}

void RPeakDetector::restart_signal() noexcept {
  filter_.restart(period_);
  rate_.interrupt();
  started_ = false;
  first_count_ = 0;
  rising_ = true;
  crest_ = 0.0;
  crest_at_ = 0;
  trough_ = 0.0;
  crest_count_ = 0;
  fit_count_ = 0;
  best_fit_.of = -1;
  quiet_count_ = 0;
  // What has been learnt from so far stands, but for what was taken for a beat.
  const auto end = std::remove_if(learnt_.begin(), learnt_.begin() + learnt_count_,
                                  [&](const Candidate& c) { return !learning_ || too_soon(c); });
  learnt_count_ = static_cast<int>(end - learnt_.begin());
  has_last_ = false;
  has_passed_over_ = false;
  has_held_ = false;
}

void RPeakDetector::interrupt(Instant t, EcgSignal reason) noexcept {
  interruption_ = reason;
  if (interrupted_) return;
  interrupted_ = true;
  ++interruptions_;
  interrupted_at_ = t;
  restart_signal();
}

void RPeakDetector::lead_off(Instant t) noexcept {
  newest_ = std::max(newest_, t);
  interrupt(newest_, EcgSignal::kLeadOff);
}

EcgSignal RPeakDetector::signal() const noexcept {
  if (interrupted_) return interruption_;
  if (learning_) return EcgSignal::kLearning;
  return newest_ < noisy_until_ ? EcgSignal::kNoisy : EcgSignal::kGood;
}

std::optional<RPeak> RPeakDetector::push(Instant t, float mV) noexcept {
  const bool first = !started_ && !interrupted_ && first_count_ == 0;
  if (!std::isfinite(mV)) {
    if (first || t - newest_ > kBridged) lead_off(t);
    return pop();
  }
  if (!first && t <= newest_) return pop();
  if (!first && !interrupted_ && t - newest_ > kBridged) interrupt(newest_, EcgSignal::kLeadOff);
  if (stands_still(t, mV, first || (interrupted_ && interruption_ != EcgSignal::kFlat))) {
    newest_ = t;
    newest_mV_ = mV;
    interrupt(std::min(changed_at_, left_at_), EcgSignal::kFlat);
    return pop();
  }
  if (interrupted_) {
    interrupted_ = false;
    if (t - interrupted_at_ > kForgetAfter) {
      forget();
      rate_ = SampleRate();
    }
  }
  const Instant before = newest_;
  const float before_mV = newest_mV_;
  newest_ = t;
  newest_mV_ = mV;
  rate_.push(t);
  if (period_ > Duration::zero() && rate_.contradicts(period_)) {
    ++interruptions_;
    forget();
    restart_signal();
  }
  if (period_ == Duration::zero()) {
    learn_rate(t, mV);
    return pop();
  }
  if (started_) bridge(before, before_mV, t, mV);
  take_sample(t, mV, false);
  return pop();
}

// The value has not changed for a second, or hardly, by the beats' measure, for longer. `anew`: what was before is
// gone.
bool RPeakDetector::stands_still(Instant t, float mV, bool anew) noexcept {
  const double value_mV = static_cast<double>(mV);
  if (anew || mV != newest_mV_) changed_at_ = t;
  if (anew || std::abs(value_mV - level_mV_) > kHardly * (upward_ + downward_)) {
    left_at_ = t;
    level_mV_ = value_mV;
  }
  return t - changed_at_ >= kFlatAfter || t - left_at_ >= kHardlyAfter;
}

// The samples between two, where some are missing.
void RPeakDetector::bridge(Instant from, float from_mV, Instant to, float to_mV) noexcept {
  const Duration step = to - from;
  if (step <= period_ + kJitter) return;
  const auto steps = static_cast<int>((step + period_ / 2) / period_);
  for (int i = 1; i < steps; ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(steps);
    take_sample(from + i * step / steps, from_mV + share * (to_mV - from_mV), true);
  }
}

void RPeakDetector::take_sample(Instant t, float mV, bool made_up) noexcept {
  if (period_ < EcgFilter::kShortestPeriod || period_ > EcgFilter::kLongestPeriod) return;
  if (!started_) {
    start_ = t;
    started_ = true;
  }
  learnt_for_ += period_;
  filter_.push(t, static_cast<double>(mV), made_up);
  watch_quiet_level();
  watch_roughness();
  if (follow_energy() && crest_count_ < kPending) crests_[static_cast<std::size_t>(crest_count_++)] = crest_at_;
  if (filter_.now() % step_ == 0) follow_templates();
  decide_crests();
  if (learning_ && learnt_for_ > kLearning && t > rough_until_) finish_learning();
  resolve_overdue();
}

// The signal is taken to stand still after its end, so that what is on its way through the filters comes out.
std::optional<RPeak> RPeakDetector::flush() noexcept {
  if (started_) {
    const Instant end = newest_;
    const float value = newest_mV_;
    const int padding = filter_.samples_in(kPadding);
    ending_ = true;
    for (int i = 1; i <= padding; ++i) take_sample(end + i * period_, value, true);
    ending_ = false;
    if (learning_) finish_learning();
    restart_signal();
  }
  return pop();
}

std::optional<RPeak> RPeakDetector::pop() noexcept {
  if (queue_count_ == 0) return std::nullopt;
  const RPeak peak = queue_[static_cast<std::size_t>(queue_begin_)];
  queue_begin_ = (queue_begin_ + 1) % kQueue;
  --queue_count_;
  return peak;
}

// The samples that tell the rate are taken once it is known.
void RPeakDetector::learn_rate(Instant t, float mV) noexcept {
  if (first_count_ < static_cast<int>(first_times_.size())) {
    first_times_[static_cast<std::size_t>(first_count_)] = t;
    first_values_[static_cast<std::size_t>(first_count_)] = mV;
    ++first_count_;
  }
  if (rate_.period() == Duration::zero()) return;
  set_rate(rate_.period());
  for (int i = 0; i < first_count_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (i > 0) bridge(first_times_[at - 1], first_values_[at - 1], first_times_[at], first_values_[at]);
    take_sample(first_times_[at], first_values_[at], false);
  }
}

void RPeakDetector::set_rate(Duration sample_period) noexcept {
  period_ = sample_period;
  filter_.restart(period_);
  if (period_ < EcgFilter::kShortestPeriod || period_ > EcgFilter::kLongestPeriod) return;
  step_ = filter_.samples_in(kShapeStep);
  points_before_ = static_cast<int>(kShapeBefore / (step_ * period_));
  points_ = points_before_ + static_cast<int>(kShapeAfter / (step_ * period_)) + 1;
}

void RPeakDetector::watch_quiet_level() noexcept {
  if (filter_.now() % filter_.samples_in(kQuietStep) != 0) return;
  quiet_[static_cast<std::size_t>(quiet_count_ % kQuietHistory)] = filter_.at(filter_.now()).energy;
  ++quiet_count_;
  if (quiet_count_ % kQuietRecompute != 0) return;
  auto sorted = quiet_;
  const auto count = std::min<std::int64_t>(quiet_count_, kQuietHistory);
  const auto quantile = sorted.begin() + static_cast<std::int64_t>(kQuietQuantile * static_cast<double>(count));
  std::nth_element(sorted.begin(), quantile, sorted.begin() + count);
  quiet_level_ = *quantile;
}

// Electrosurgery, chewing, a loose cable: as strong as the beats and too fast to be any. The usual roughness (mains
// hum) is followed slowly upward, so that a burst does not become the usual.
void RPeakDetector::watch_roughness() noexcept {
  const double rough = filter_.at(filter_.now()).rough;
  const double risen = rough_level_ * (1.0 + to_seconds(period_) / kRoughRise_s);
  rough_level_ = rough_level_ > 0.0 ? std::min(rough, risen) : rough;
  if (beat_slope_.count() == 0) {
    smooth_at_ = newest_;
    return;
  }
  const double limit = std::max(kRough * rough_level_, kRoughToBeats * beat_slope_.median());
  if (rough < (newest_ < rough_until_ ? kRoughHysteresis * limit : limit)) smooth_at_ = newest_;
  if (newest_ - smooth_at_ < kRoughAtLeast) return;
  if (newest_ > rough_until_) rough_since_ = smooth_at_ - kRoughBefore;
  rough_until_ = newest_ + kRoughAfter;
  noisy_until_ = std::max(noisy_until_, newest_ + kNoisyFor);
  has_held_ = false;
  has_passed_over_ = false;
}

// True when a local maximum of the energy, at crest_at_, has just been confirmed.
bool RPeakDetector::follow_energy() noexcept {
  const double energy = filter_.at(filter_.now()).energy;
  if (!rising_) {
    trough_ = std::min(trough_, energy);
    if (energy <= kRiseAgain * trough_) return false;
    rising_ = true;
    crest_ = energy;
    crest_at_ = filter_.now();
    return false;
  }
  if (energy > crest_) {
    crest_ = energy;
    crest_at_ = filter_.now();
  }
  const bool confirmed = energy < kConfirmFall * crest_ || filter_.now() - crest_at_ >= filter_.samples_in(kConfirm);
  if (!confirmed || !(crest_ > 0.0)) return false;
  rising_ = false;
  trough_ = energy;
  return true;
}

// Of no points while its end is not known.
QrsShape RPeakDetector::shape_at(std::int64_t centre) const noexcept {
  QrsShape shape;
  const std::int64_t first = centre + filter_.slope_delay() - points_before_ * step_;
  if (first + (points_ - 1) * step_ > filter_.now()) return shape;
  shape.points = points_;
  for (int i = 0; i < points_; ++i) {
    shape.slope[static_cast<std::size_t>(i)] = static_cast<float>(filter_.at(first + i * step_).slope);
  }
  return shape;
}

// The matched filter at the newest instant whose surroundings are known.
void RPeakDetector::follow_templates() noexcept {
  Fit fit;
  fit.at = filter_.now() - filter_.slope_delay() - (points_ - 1 - points_before_) * step_;
  if (fit.at < 0) return;
  const QrsShape shape = shape_at(fit.at);
  for (int i = 0; i < ShapeTemplates::kTemplates; ++i) {
    if (!templates_.usable(i)) continue;
    const ShapeMatch m = templates_.match_with(i, shape);
    if (m.correlation <= fit.correlation) continue;
    fit.correlation = m.correlation;
    fit.gain = m.gain;
    fit.of = i;
  }
  fits_[static_cast<std::size_t>(fit_count_ % kFits)] = fit;
  ++fit_count_;
  if (fit.correlation >= kAlike && (best_fit_.of < 0 || fit.correlation > best_fit_.correlation)) {
    best_fit_ = fit;
  } else if (best_fit_.of >= 0 && fit.at - best_fit_.at >= kFitConfirm * step_) {
    decide_familiar(best_fit_);
    best_fit_.of = -1;
  }
}

void RPeakDetector::decide_crests() noexcept {
  const int await = filter_.slope_delay() + (points_ - 1 - points_before_) * step_ + filter_.samples_in(kFitAwait);
  while (crest_count_ > 0) {
    const std::int64_t crest = crests_[0];
    if (filter_.now() < crest - filter_.energy_delay() + await) return;
    std::copy(crests_.begin() + 1, crests_.begin() + crest_count_, crests_.begin());
    --crest_count_;
    const Candidate candidate = measure(crest);
    if (candidate.peak.time < rough_until_ && candidate.peak.time > rough_since_) continue;
    if (learnt_count_ == kLearningCapacity) {
      std::copy(learnt_.begin() + 1, learnt_.end(), learnt_.begin());
      --learnt_count_;
    }
    learnt_[static_cast<std::size_t>(learnt_count_++)] = candidate;
    if (!learning_) decide(candidate);
  }
}

RPeakDetector::Candidate RPeakDetector::measure(std::int64_t energy_peak) const noexcept {
  Candidate candidate;
  candidate.energy = filter_.at(energy_peak).energy;
  for (int k = 0; k < filter_.energy_width(); ++k) {
    candidate.slope = std::max(candidate.slope, std::abs(filter_.at(energy_peak - k).slope));
  }
  const std::int64_t centre = std::max<std::int64_t>(energy_peak - filter_.energy_delay(), 0);
  std::int64_t top = 0;
  std::int64_t bottom = 0;
  measure_excursions(centre, candidate, top, bottom);
  candidate.points_up = candidate.upward >= candidate.downward;
  if (upward_ > 0.0 || downward_ > 0.0) {
    candidate.points_up = points_up_ ? candidate.downward < kOpposite * candidate.upward
                                     : candidate.upward >= kOpposite * candidate.downward;
  }
  const std::int64_t peak = candidate.points_up ? top : bottom;
  refine_peak(peak, candidate);
  candidate.peak.shape = shape_at(peak);
  measure_step(peak, candidate);
  const int reach = filter_.samples_in(kFitReach);
  for (std::int64_t i = std::max<std::int64_t>(fit_count_ - kFits, 0); i < fit_count_; ++i) {
    const Fit& fit = fits_[static_cast<std::size_t>(i % kFits)];
    if (std::abs(fit.at - peak) > reach || fit.correlation <= candidate.correlation) continue;
    candidate.correlation = fit.correlation;
    candidate.gain = fit.gain;
    candidate.of = fit.of;
  }
  return candidate;
}

RPeakDetector::Candidate RPeakDetector::measure_fit(const Fit& fit) const noexcept {
  Candidate candidate;
  candidate.correlation = fit.correlation;
  candidate.gain = fit.gain;
  candidate.of = fit.of;
  candidate.points_up = templates_.upward(fit.of);
  const std::int64_t middle = fit.at + filter_.energy_delay();
  const int reach = filter_.energy_width() / 2;
  for (std::int64_t i = std::max<std::int64_t>(middle - reach, 0); i <= std::min(middle + reach, filter_.now()); ++i) {
    candidate.energy = std::max(candidate.energy, filter_.at(i).energy);
  }
  candidate.peak.shape = shape_at(fit.at);
  for (int i = 0; i < candidate.peak.shape.points; ++i) {
    candidate.slope = std::max(candidate.slope,
                               std::abs(static_cast<double>(candidate.peak.shape.slope[static_cast<std::size_t>(i)])));
  }
  std::int64_t top = 0;
  std::int64_t bottom = 0;
  measure_excursions(fit.at, candidate, top, bottom);
  const auto value = [&](std::int64_t i) {
    return filter_.at(std::min(i + filter_.despiked_delay(), filter_.now())).despiked;
  };
  std::int64_t peak = fit.at;
  const int window = filter_.samples_in(kFitPeakWindow);
  for (std::int64_t i = std::max<std::int64_t>(fit.at - window, 0); i <= fit.at + window; ++i) {
    if (candidate.points_up ? value(i) > value(peak) : value(i) < value(peak)) peak = i;
  }
  measure_step(peak, candidate);
  refine_peak(peak, candidate);
  return candidate;
}

// Whether the signal comes back after the complex; when the lead comes off it goes to another level and stays there.
void RPeakDetector::measure_step(std::int64_t peak, Candidate& candidate) const noexcept {
  const auto level = [&](std::int64_t i) {
    return filter_.at(std::clamp<std::int64_t>(i + filter_.smooth_delay(), 0, filter_.now())).smooth;
  };
  const int reach = filter_.samples_in(kStepReach);
  const double excursions = std::max(candidate.upward + candidate.downward, filter_.quantum_mV());
  candidate.step = std::abs(level(peak + reach) - level(peak - reach)) / excursions;
}

// The largest excursions from the baseline around sample `centre`, and where they are.
void RPeakDetector::measure_excursions(std::int64_t centre, Candidate& candidate, std::int64_t& top,
                                       std::int64_t& bottom) const noexcept {
  const int delay = filter_.smooth_delay();
  const std::int64_t first = std::max<std::int64_t>(centre - filter_.samples_in(kPeakWindow), 0);
  const std::int64_t last = std::max(std::min(centre + filter_.samples_in(kPeakWindow), filter_.now() - delay), first);

  // The baseline is the median of a stretch of which the complex is the smaller part.
  std::array<double, EcgFilter::kHistory / 2> stretch{};
  auto end = stretch.begin();
  for (std::int64_t i = std::max<std::int64_t>(centre - filter_.samples_in(kBaselineBefore), 0); i <= last; ++i) {
    *end++ = filter_.at(i).mV;
  }
  const double baseline = upper_median(stretch.begin(), end);

  top = first;
  bottom = first;
  const auto smooth_at = [&](std::int64_t i) { return filter_.at(std::min(i + delay, filter_.now())).smooth; };
  for (std::int64_t i = first; i <= last; ++i) {
    if (smooth_at(i) > smooth_at(top)) top = i;
    if (smooth_at(i) < smooth_at(bottom)) bottom = i;
  }
  candidate.upward = std::max(smooth_at(top) - baseline, 0.0);
  candidate.downward = std::max(baseline - smooth_at(bottom), 0.0);
}

// Parabola a + b u + c u^2 by least squares, fitted again around its own vertex once.
void RPeakDetector::refine_peak(std::int64_t peak, Candidate& candidate) const noexcept {
  const double step_s = to_seconds(period_);
  const int reach = filter_.samples_in(kParabola);
  const int delay = filter_.despiked_delay();
  double vertex_s = 0.0;
  double deviation_s = kDeviationCap_s;
  for (int pass = 0; pass < 2; ++pass) {
    const std::int64_t from = std::max<std::int64_t>(peak - reach, 0);
    const std::int64_t to = std::min(peak + reach, filter_.now() - delay);
    if (peak - from != to - peak) break;  // too close to an end of the signal
    // Centred and evenly spaced, so that b separates from a and c.
    const double offset = filter_.at(peak + delay).despiked;
    double n = 0.0;
    double sum_y = 0.0;
    double sum_uy = 0.0;
    double sum_u2 = 0.0;
    double sum_u2y = 0.0;
    double sum_u4 = 0.0;
    for (std::int64_t i = from; i <= to; ++i) {
      const double u = static_cast<double>(i - peak) * step_s;
      const double y = filter_.at(i + delay).despiked - offset;
      n += 1.0;
      sum_y += y;
      sum_uy += u * y;
      sum_u2 += u * u;
      sum_u2y += u * u * y;
      sum_u4 += u * u * u * u;
    }
    const double b = sum_uy / sum_u2;
    const double c = (n * sum_u2y - sum_u2 * sum_y) / (n * sum_u4 - sum_u2 * sum_u2);
    const double a = (sum_y - c * sum_u2) / n;
    if (candidate.points_up ? c >= 0.0 : c <= 0.0) break;
    const double limit = static_cast<double>(reach) * step_s;
    vertex_s = std::clamp(-b / (2.0 * c), -limit, limit);
    double squares = 0.0;
    for (std::int64_t i = from; i <= to; ++i) {
      const double u = static_cast<double>(i - peak) * step_s;
      const double residual = filter_.at(i + delay).despiked - offset - (a + b * u + c * u * u);
      squares += residual * residual;
    }
    const double noise = std::max(std::sqrt(squares / std::max(n - 3.0, 1.0)), quiet_level_);
    deviation_s = noise / (2.0 * std::abs(c) * std::sqrt(sum_u2));
    const auto shift = static_cast<std::int64_t>(std::lround(vertex_s / step_s));
    if (pass == 0 && shift != 0) {
      peak += shift;
      vertex_s = 0.0;
    } else {
      break;
    }
  }
  int made_up = 0;
  for (std::int64_t i = peak - reach; i <= peak + reach; ++i) made_up += filter_.at(i).made_up ? 1 : 0;
  // Where the peak lies among samples that are missing: uniform.
  if (!ending_) deviation_s = std::hypot(deviation_s, made_up * step_s / std::sqrt(12.0));
  candidate.peak.time = filter_.at(peak).time + from_seconds(vertex_s);
  candidate.peak.deviation = from_seconds(std::min(std::hypot(deviation_s, kDeviationFloor_s), kDeviationCap_s));
}

// Learning lasts until something stands out and comes again; only the last seconds count.
void RPeakDetector::finish_learning() noexcept {
  const Candidate* const strongest = strongest_recurring();
  if (strongest == nullptr) return;
  learning_ = false;
  searching_since_ = newest_;
  noise_level_ = quiet_level_;
  beat_energy_.clear();
  beat_slope_.clear();
  beat_energy_.push(strongest->energy);
  beat_slope_.push(strongest->slope);
  if (strongest->correlation >= kSurelyFamiliar) {
    templates_.scale(strongest->gain);
  } else {
    templates_.distrust();
  }
  for (int i = 0; i < learnt_count_; ++i) {
    const Candidate& candidate = learnt_[static_cast<std::size_t>(i)];
    if (!too_soon(candidate)) decide_new(candidate);
  }
}

// Of the last seconds' candidates the strongest, when it stands out and a good part of those of its size are like it;
// after some time without such, when it stands out.
const RPeakDetector::Candidate* RPeakDetector::strongest_recurring() noexcept {
  const Instant oldest = newest_ - kLearningWindow;
  const auto end = std::remove_if(learnt_.begin(), learnt_.begin() + learnt_count_,
                                  [&](const Candidate& c) { return c.peak.time < oldest; });
  learnt_count_ = static_cast<int>(end - learnt_.begin());
  const auto strongest = std::max_element(learnt_.begin(), end,
                                          [](const Candidate& a, const Candidate& b) { return a.energy < b.energy; });
  if (strongest == end || !stands_out(*strongest, kStandOut)) return nullptr;
  if (newest_ - std::max(start_, searching_since_) > kLearningAtMost) return &*strongest;
  int large = 0;
  int alike = 0;
  for (auto c = learnt_.begin(); c != end; ++c) {
    if (c->energy < kRecurringEnergy * strongest->energy) continue;
    ++large;
    if (best_match(c->peak.shape, strongest->peak.shape, kRecurringDisplaced).correlation > kFamiliar) ++alike;
  }
  return alike >= 2 && alike >= kRecurringShare * large ? &*strongest : nullptr;
}

// Before the last beat, or while the ventricles cannot contract again.
bool RPeakDetector::too_soon(const Candidate& candidate) const noexcept {
  return has_last_ && candidate.peak.time - last_.peak.time < kRefractory;
}

// A maximum of the energy.
void RPeakDetector::decide(const Candidate& candidate) noexcept {
  if (too_soon(candidate)) return;
  if (templates_.any_usable()) {
    decide_unfamiliar(candidate);
  } else {
    decide_new(candidate);
  }
}

// While the beats' shape is not known.
void RPeakDetector::decide_new(const Candidate& candidate) noexcept {
  const bool t_wave = is_t_wave(candidate);
  if (!t_wave && stands_out(candidate, kStandOut) && candidate.energy > beat_threshold()) {
    accept(candidate, kTrustNew);
    return;
  }
  noise_level_ += (candidate.energy - noise_level_) / kNoiseMemory;
  if (!t_wave) pass_over(candidate);
}

void RPeakDetector::decide_unfamiliar(const Candidate& candidate) noexcept {
  if (candidate.correlation >= kFamiliar && candidate.gain >= kLeastGain) return;  // the matched filter decides on it
  if (is_t_wave(candidate)) return;
  const double size = strength(candidate);
  const Instant t = candidate.peak.time;
  if (size < kUnfamiliarStrength || candidate.energy > kUnfamiliarMost * beat_energy_.median() ||
      !stands_out(candidate, kStandOut)) {
    noise_level_ += (candidate.energy - noise_level_) / kNoiseMemory;
    if (size > kDisturbance) noisy_until_ = t + kNoisyFor;
    if (candidate.energy > kUnfamiliarMost * beat_energy_.median() && large_recur(candidate)) {
      learning_ = true;
      searching_since_ = newest_;
      return;
    }
    pass_over(candidate);
    return;
  }
  if (candidate.step > kStep) {
    noisy_until_ = t + kNoisyFor;
    return;
  }
  if (t >= noisy_until_) {
    accept(candidate, kTrustUnfamiliar);
    return;
  }
  noisy_until_ = t + kNoisyFor;
  hold(candidate);
}

void RPeakDetector::hold(const Candidate& candidate) noexcept {
  // A familiar shape is a beat on a step.
  if ((candidate.step > kStep && candidate.correlation < kFamiliar) ||
      (has_held_ && likelihood(candidate) <= likelihood(held_)))
    return;
  held_ = candidate;
  held_until_ = Instant::max();
  has_held_ = true;
}

// How likely a candidate in noise is a beat, against others: by shape, and by how near it is to where one is due.
double RPeakDetector::likelihood(const Candidate& candidate) const noexcept {
  const double shape = std::max(candidate.correlation, kLeastLike);
  if (!has_last_) return shape;
  const double off = (to_seconds(candidate.peak.time - last_.peak.time) / rhythm_s() - 1.0) / kTimely;
  return shape * (kUntimely + std::exp(-0.5 * off * off));
}

// A candidate far larger than the beats is like another one of the last seconds: the gain has risen.
bool RPeakDetector::large_recur(const Candidate& candidate) const noexcept {
  for (int i = 0; i < learnt_count_; ++i) {
    const Candidate& other = learnt_[static_cast<std::size_t>(i)];
    if (candidate.peak.time - other.peak.time < kRefractory || newest_ - other.peak.time > kLearningWindow) continue;
    if (other.energy * kSameEnergy > candidate.energy && other.energy < kSameEnergy * candidate.energy &&
        best_match(candidate.peak.shape, other.peak.shape, kRecurringDisplaced).correlation > kSurelyFamiliar) {
      return true;
    }
  }
  return false;
}

void RPeakDetector::decide_familiar(const Fit& fit) noexcept {
  const Candidate candidate = measure_fit(fit);
  const Instant t = candidate.peak.time;
  const Duration since = has_last_ ? t - last_.peak.time : Duration::max();
  const bool outshines = has_last_ && candidate.energy > kOutshines * last_.energy;
  if (since < (last_familiar_ && !outshines ? kRefractory : kAfterUnfamiliar)) return;
  if (!stands_out(candidate, kFamiliarStandOut) || is_t_wave(candidate)) return;
  if (candidate.gain < kLeastGain || (candidate.gain > kMostGain && candidate.correlation < kSurelyFamiliar)) {
    pass_over(candidate);
    return;
  }
  const bool sure = candidate.correlation >= kSureCorrelation;
  if ((ending_ && candidate.correlation < kCutOffCorrelation) || (t < rough_until_ && !sure)) return;
  if (learning_) {
    if (!sure || candidate.gain < kSureGain) return;
    learning_ = false;
  }
  const bool noisy = t < noisy_until_;
  if (candidate.correlation < kFamiliar || (noisy && !templates_.established(candidate.of))) {
    if (noisy) hold(candidate);
    return;
  }
  if (candidate.of != templates_.heaviest() &&
      strength(candidate) < (templates_.established(candidate.of) ? kEstablishedStrength : kOtherStrength)) {
    pass_over(candidate);
    return;
  }
  if (candidate.gain < kSureGain && !sure) {
    hold(candidate);
    if (!noisy && strength(candidate) > kDoubtfulStrength) held_until_ = t + kDoubt;
    return;
  }
  const double rhythm = rhythm_s();
  if (has_held_) {
    has_held_ = false;
    const bool apart = t - held_.peak.time > kRefractory && !too_soon(held_);
    const bool very_like = held_.correlation > kVeryLike && held_.gain > kSureGain && held_.gain < 1.0 / kSureGain &&
                           strength(held_) > kUnfamiliarStrength;
    if (apart && has_last_ && (very_like || to_seconds(since) > kMissed * rhythm)) {
      accept(held_, kTrustBetween);
    } else {
      noisy_until_ = t + kNoisyFor;
    }
  } else if (has_passed_over_ && has_last_ && to_seconds(since) > kMissed * rhythm &&
             t - passed_over_.peak.time > kRefractory && sizeable(passed_over_)) {
    accept(passed_over_, kTrustBetween);
  }
  const bool after_unfamiliar = has_last_ && !last_familiar_;
  if (after_unfamiliar && std::abs(to_seconds(t - before_last_) - rhythm) < kInRhythm * rhythm) {
    noisy_until_ = t + kNoisyFor;
  }
  accept(candidate, kTrustFamiliar);
}

// Where the shape of the beats is known, what is much smaller than they are must be the more like them.
bool RPeakDetector::sizeable(const Candidate& candidate) const noexcept {
  const double size = strength(candidate);
  return (candidate.correlation >= kSearchBackLike && size > kSearchBackSize) ||
         (candidate.correlation >= kSearchBackVeryLike && size > kSearchBackLeastSize);
}

void RPeakDetector::pass_over(const Candidate& candidate) noexcept {
  if (has_passed_over_ && candidate.energy <= passed_over_.energy) return;
  passed_over_ = candidate;
  has_passed_over_ = true;
}

// When a beat is overdue, the strongest candidate since the last one is taken, above a threshold that falls as time
// goes on. It has to wait a little, for a P wave is no beat when its QRS complex follows.
void RPeakDetector::resolve_overdue() noexcept {
  if (learning_ || newest_ < rough_until_) return;
  const Instant t = newest_;
  const double since_s = to_seconds(t - (has_last_ ? last_.peak.time : start_));
  const double rhythm = rhythm_s();
  if (has_held_ && too_soon(held_)) has_held_ = false;
  if (has_held_ && (since_s > kHeldOverdue * rhythm || t >= held_until_)) {
    has_held_ = false;
    accept(held_, kTrustOverdue);
    return;
  }
  if (since_s > to_seconds(kRelearnAfter) && since_s > kRelearnCycles * rhythm) {
    learning_ = true;
    searching_since_ = t;
    return;
  }
  if (!has_passed_over_ || t - passed_over_.peak.time < kSearchBackWait) return;
  const double late_s = since_s - kSearchBack * rhythm;
  if (late_s <= 0.0) return;
  if (templates_.any_usable() && !sizeable(passed_over_)) return;
  const double threshold = kSearchBackThreshold * beat_threshold() * std::exp(-late_s / kDeafness_s);
  if (passed_over_.energy > threshold && stands_out(passed_over_, kStandOut)) accept(passed_over_, kTrustBetween);
}

void RPeakDetector::accept(const Candidate& candidate, double trust) noexcept {
  const bool familiar = candidate.correlation >= kFamiliar;
  const bool other_gain =
      candidate.correlation >= kSurelyFamiliar && (candidate.gain > kMostGain || candidate.gain < kLeastGain);
  if (other_gain && other_gain_ > 0.0 && std::abs(std::log(candidate.gain / other_gain_)) < kSameGain) {
    rescale(candidate.gain);
    other_gain_ = 0.0;
  } else {
    other_gain_ = other_gain ? candidate.gain : 0.0;
  }
  if (!templates_.any_usable() && candidate.energy < kThreshold * beat_energy_.median()) {
    // Taken by a threshold that had fallen: the gain has changed.
    beat_energy_.clear();
    beat_slope_.clear();
    noise_level_ = quiet_level_;
  }
  if ((familiar && !other_gain) || beat_energy_.count() == 0 || !templates_.any_usable()) {
    beat_energy_.push(candidate.energy);
    beat_slope_.push(candidate.slope);
  }
  RPeak peak = candidate.peak;
  const double resemblance =
      familiar ? std::clamp((candidate.correlation - kUnlike) / kAsAlikeAsAny, 0.0, 1.0) : kUnknownResemblance;
  const double quiet = candidate.energy > 0.0 ? std::min(quiet_level_ / candidate.energy, 1.0) : 1.0;
  peak.confidence = trust * resemblance * (1.0 - quiet);
  if (!familiar && trust <= kTrustBetween) peak.deviation = from_seconds(kDoubtfulDeviation_s);
  emit(peak);

  const double keep = upward_ > 0.0 || downward_ > 0.0 ? 1.0 - 1.0 / kPolarityMemory : 0.0;
  const double hysteresis = keep > 0.0 ? kPolarityHysteresis : 1.0;
  upward_ = keep * upward_ + (1.0 - keep) * candidate.upward;
  downward_ = keep * downward_ + (1.0 - keep) * candidate.downward;
  if (points_up_ ? downward_ > hysteresis * upward_ : upward_ >= hysteresis * downward_) points_up_ = !points_up_;
  if ((trust >= kLearnt && newest_ >= noisy_until_) || (familiar && candidate.of == templates_.heaviest())) {
    templates_.learn(candidate.peak.shape, candidate.points_up);
  }

  if (has_last_) {
    if (trust >= kLearnt) rr_s_.push(to_seconds(candidate.peak.time - last_.peak.time));
    before_last_ = last_.peak.time;
  } else {
    before_last_ = candidate.peak.time;
  }
  last_ = candidate;
  last_familiar_ = familiar;
  has_last_ = true;
  has_passed_over_ = false;
}

void RPeakDetector::emit(RPeak peak) noexcept {
  if (peak.time > newest_ || queue_count_ == kQueue) return;
  peak.detected_at = newest_;
  queue_[static_cast<std::size_t>((queue_begin_ + queue_count_) % kQueue)] = peak;
  ++queue_count_;
}

void RPeakDetector::rescale(double factor) noexcept {
  templates_.scale(factor);
  beat_energy_.scale(factor);
  beat_slope_.scale(factor);
  noise_level_ *= factor;
}

bool RPeakDetector::is_t_wave(const Candidate& candidate) const noexcept {
  if (!has_last_) return false;
  return to_seconds(candidate.peak.time - last_.peak.time) < kTWave * std::sqrt(rhythm_s()) &&
         candidate.slope < kTWaveSlope * std::max(last_.slope, kTWaveLevel * beat_slope_.median());
}

// Size as energy and slope, 1 for the usual beat. A wide slow wave has the energy of a beat but not its slope.
double RPeakDetector::strength(const Candidate& candidate) const noexcept {
  return std::sqrt(candidate.energy / beat_energy_.median() * candidate.slope / beat_slope_.median());
}

// Far above the quiet part of the signal and above the converter's own steps.
bool RPeakDetector::stands_out(const Candidate& candidate, double times) const noexcept {
  return candidate.energy > times * quiet_level_ && candidate.energy > kQuanta * filter_.quantum_mV();
}

double RPeakDetector::beat_threshold() const noexcept {
  const double noise = std::min(std::max(noise_level_, quiet_level_), beat_energy_.median());
  return noise + kThreshold * (beat_energy_.median() - noise);
}

// Where every other beat is premature, of the first few intervals most may be the short ones.
double RPeakDetector::rhythm_s() const noexcept {
  if (rr_s_.count() == 0) return kRhythmAtStart_s;
  const double usual_s = rr_s_.count() < kLevels ? std::max(rr_s_.median(), rr_s_.mean_of_last_two()) : rr_s_.median();
  return std::min(usual_s, kSlowestRhythm_s);
}

}  // namespace perimap

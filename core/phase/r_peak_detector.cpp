#include "core/phase/r_peak_detector.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Duration kShortestPeriod = std::chrono::microseconds(950);  // 1000 Hz and some tolerance
constexpr Duration kLongestPeriod = std::chrono::microseconds(10500);
constexpr int kRateSamples = 17;
constexpr int kGapPeriods = 4;  // a longer step between stamps is a gap

constexpr Duration kSmooth = milliseconds(20);   // a whole period of 50 Hz
constexpr Duration kEnergy = milliseconds(80);   // about a normal QRS complex
constexpr Duration kConfirm = milliseconds(50);  // a maximum of the energy is one when nothing exceeded it for so long,
constexpr double kConfirmFall = 0.75;            // or when the energy has fallen to this share of it
constexpr double kRiseAgain = 1.5;               // the next one begins when the energy has risen by this factor

constexpr Duration kPeakWindow = milliseconds(80);  // each side of the complex's middle
constexpr Duration kBaselineBefore = milliseconds(200);
constexpr Duration kParabola = milliseconds(10);  // each side of the peak
constexpr double kOpposite = 2.0;  // a beat points the other way when its other excursion is larger by this factor
constexpr double kPolarityHysteresis = 1.3;
constexpr double kPolarityMemory = 8.0;  // beats
constexpr double kDeviationFloor_s = 0.001;
constexpr double kDeviationCap_s = 0.020;

constexpr Duration kQuietStep = milliseconds(20);
constexpr int kQuietRecompute = 5;  // steps
constexpr double kQuietQuantile = 0.3;
constexpr double kStandOut = 3.5;  // times the quiet level; bare noise reaches it about once a minute

constexpr double kQuanta = 2.0;  // times the converter's resolution; a single step of it reaches 0.75

constexpr Duration kLearning = std::chrono::seconds(2);
constexpr Duration kRefractory = milliseconds(200);
constexpr double kTWave = 0.45;               // s / sqrt(cycle in s), the end of the T wave (Bazett 1920): before it,
constexpr double kTWaveSlope = 0.5;           // what has less than this share of the last beat's slope is its T wave
constexpr double kThreshold = 0.3;            // of the way from noise level to beat level
constexpr double kNoiseMemory = 8.0;          // candidates
constexpr double kSearchBack = 1.66;          // mean cycles without a beat after which a weaker candidate is taken,
constexpr double kSearchBackThreshold = 0.5;  // above this share of the threshold
constexpr Duration kSearchBackWait = milliseconds(300);
constexpr double kRhythmAtStart_s = 1.2;  // until an interval is known
constexpr double kDeafness_s = 1.0;       // that threshold falls by e in this time: the gain may have changed

}  // namespace

void RPeakDetector::Recent::push(double value) noexcept {
  values_[static_cast<std::size_t>(count_ % kLevels)] = value;
  ++count_;
  if (count_ >= 2 * kLevels) count_ -= kLevels;  // bounded, same slot and same fill
}

double RPeakDetector::Recent::median() const noexcept {
  auto sorted = values_;
  const auto middle = sorted.begin() + count() / 2;
  std::nth_element(sorted.begin(), middle, sorted.begin() + count());
  return *middle;
}

double RPeakDetector::Recent::mean() const noexcept {
  double sum = 0.0;
  for (int i = 0; i < count(); ++i) sum += values_[static_cast<std::size_t>(i)];
  return sum / count();
}

RPeakDetector::RPeakDetector(Duration sample_period) noexcept : given_period_(sample_period) { restart(); }

void RPeakDetector::restart() noexcept {
  now_ = -1;
  period_ = Duration::zero();
  rising_ = true;
  crest_ = 0.0;
  crest_at_ = 0;
  trough_ = 0.0;
  quiet_count_ = 0;
  quiet_level_ = 0.0;
  quantum_mV_ = 0.0;
  noise_level_ = 0.0;
  beat_energy_.clear();
  rr_s_.clear();
  learning_ = true;
  learnt_count_ = 0;
  has_last_ = false;
  has_passed_over_ = false;
}

void RPeakDetector::lead_off(Instant /*t*/) noexcept { restart(); }

std::optional<RPeak> RPeakDetector::push(Instant t, float mV) noexcept {
  if (!std::isfinite(mV)) {
    restart();
    return pop();
  }
  if (now_ >= 0) {
    const Duration step = t - at(now_).time;
    if (step <= Duration::zero()) return pop();
    if (period_ > Duration::zero() && step > kGapPeriods * period_) restart();
  }
  ++now_;
  if (now_ == 0) start_ = t;
  at(now_) = Sample{};
  at(now_).time = t;
  at(now_).mV = static_cast<double>(mV);
  if (period_ == Duration::zero()) {
    learn_rate();
    if (period_ == Duration::zero()) return pop();
    for (std::int64_t i = 0; i < now_; ++i) filter(i);
  }
  if (period_ < kShortestPeriod || period_ > kLongestPeriod) return pop();

  filter(now_);
  watch_quiet_level();
  if (follow_energy(false)) take(measure(crest_at_));
  if (learning_ && t - start_ > kLearning) finish_learning();
  search_back();
  return pop();
}

std::optional<RPeak> RPeakDetector::flush() noexcept {
  if (now_ >= 0 && period_ >= kShortestPeriod && period_ <= kLongestPeriod) {
    if (follow_energy(true)) take(measure(crest_at_));
    if (learning_) finish_learning();
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

void RPeakDetector::learn_rate() noexcept {
  if (given_period_ > Duration::zero()) {
    set_rate(given_period_);
  } else if (now_ + 1 == kRateSamples) {
    std::array<Duration, kRateSamples - 1> steps{};
    for (int i = 0; i + 1 < kRateSamples; ++i) steps[static_cast<std::size_t>(i)] = at(i + 1).time - at(i).time;
    std::nth_element(steps.begin(), steps.begin() + steps.size() / 2, steps.end());
    set_rate(steps[steps.size() / 2]);
  }
}

void RPeakDetector::set_rate(Duration sample_period) noexcept {
  period_ = sample_period;
  smooth_width_ = samples_in(kSmooth);
  energy_width_ = samples_in(kEnergy);
}

int RPeakDetector::samples_in(Duration d) const noexcept {
  return std::max(1, static_cast<int>((d + period_ / 2) / period_));
}

// Before its first sample the signal is taken to have stood still. Sums are formed anew each time: they are short, and
// a running sum would leave rounding errors that look like a signal on a flat line.
void RPeakDetector::filter(std::int64_t i) noexcept {
  Sample& sample = at(i);
  const auto mean = [&](int width, double Sample::*of) {
    double sum = 0.0;
    for (int k = 0; k < width; ++k) sum += at(std::max<std::int64_t>(i - k, 0)).*of;
    return sum / width;
  };
  sample.smooth = mean(smooth_width_, &Sample::mV);
  sample.smoother = mean(smooth_width_, &Sample::smooth);
  sample.slope = std::abs(sample.smoother - at(std::max<std::int64_t>(i - smooth_width_, 0)).smoother);
  sample.energy = mean(energy_width_, &Sample::slope);
  const double step = std::abs(sample.mV - at(std::max<std::int64_t>(i - 1, 0)).mV);
  if (step > 0.0 && (quantum_mV_ == 0.0 || step < quantum_mV_)) quantum_mV_ = step;
}

void RPeakDetector::watch_quiet_level() noexcept {
  if (now_ % samples_in(kQuietStep) != 0) return;
  quiet_[static_cast<std::size_t>(quiet_count_ % kQuietHistory)] = at(now_).energy;
  ++quiet_count_;
  if (quiet_count_ % kQuietRecompute != 0) return;
  auto sorted = quiet_;
  const auto count = std::min<std::int64_t>(quiet_count_, kQuietHistory);
  const auto quantile = sorted.begin() + static_cast<std::int64_t>(kQuietQuantile * static_cast<double>(count));
  std::nth_element(sorted.begin(), quantile, sorted.begin() + count);
  quiet_level_ = *quantile;
}

// True when a local maximum of the energy, at crest_at_, has just been confirmed.
bool RPeakDetector::follow_energy(bool ending) noexcept {
  const double energy = at(now_).energy;
  if (!rising_) {
    trough_ = std::min(trough_, energy);
    if (energy <= kRiseAgain * trough_) return false;
    rising_ = true;
    crest_ = energy;
    crest_at_ = now_;
    return false;
  }
  if (energy > crest_) {
    crest_ = energy;
    crest_at_ = now_;
  }
  const bool confirmed = energy < kConfirmFall * crest_ || now_ - crest_at_ >= samples_in(kConfirm) || ending;
  if (!confirmed || !(crest_ > 0.0)) return false;
  rising_ = false;
  trough_ = energy;
  return true;
}

RPeakDetector::Candidate RPeakDetector::measure(std::int64_t energy_peak) const noexcept {
  Candidate candidate;
  candidate.energy = at(energy_peak).energy;
  for (int k = 0; k < energy_width_; ++k) {
    candidate.slope = std::max(candidate.slope, at(std::max<std::int64_t>(energy_peak - k, 0)).slope);
  }
  const int filter_delay = (3 * smooth_width_ - 2 + energy_width_ - 1) / 2;
  locate_peak(std::max<std::int64_t>(energy_peak - filter_delay, 0), candidate);
  return candidate;
}

// Finds the peak of the complex whose middle is at sample `centre`.
void RPeakDetector::locate_peak(std::int64_t centre, Candidate& candidate) const noexcept {
  const int half_smooth = smooth_width_ / 2;
  const std::int64_t first = std::max<std::int64_t>(centre - samples_in(kPeakWindow), 0);
  const std::int64_t last = std::max(std::min(centre + samples_in(kPeakWindow), now_ - half_smooth), first);

  // The baseline is the median of a stretch of which the complex is the smaller part.
  std::array<double, kHistory / 2> stretch{};
  auto end = stretch.begin();
  for (std::int64_t i = std::max<std::int64_t>(centre - samples_in(kBaselineBefore), 0); i <= last; ++i) {
    *end++ = at(i).mV;
  }
  const auto middle = stretch.begin() + (end - stretch.begin()) / 2;
  std::nth_element(stretch.begin(), middle, end);
  const double baseline = *middle;

  std::int64_t top = first;
  std::int64_t bottom = first;
  const auto smooth_at = [&](std::int64_t i) { return at(std::min(i + half_smooth, now_)).smooth; };
  for (std::int64_t i = first; i <= last; ++i) {
    if (smooth_at(i) > smooth_at(top)) top = i;
    if (smooth_at(i) < smooth_at(bottom)) bottom = i;
  }
  candidate.upward = std::max(smooth_at(top) - baseline, 0.0);
  candidate.downward = std::max(baseline - smooth_at(bottom), 0.0);

  bool up = candidate.upward >= candidate.downward;
  if (has_last_) {
    up = points_up_ ? candidate.downward < kOpposite * candidate.upward
                    : candidate.upward >= kOpposite * candidate.downward;
  }

  // Parabola a + b u + c u^2 by least squares, fitted again around its own vertex once.
  std::int64_t peak = up ? top : bottom;
  const double step_s = to_seconds(period_);
  const int reach = std::max(1, samples_in(kParabola));
  double vertex_s = 0.0;
  double deviation_s = kDeviationCap_s;
  for (int pass = 0; pass < 2; ++pass) {
    const std::int64_t from = std::max<std::int64_t>(peak - reach, 0);
    const std::int64_t to = std::min(peak + reach, now_);
    if (peak - from != to - peak) break;  // too close to an end of the signal
    // Centred and evenly spaced, so that b separates from a and c.
    double n = 0.0;
    double sum_y = 0.0;
    double sum_uy = 0.0;
    double sum_u2 = 0.0;
    double sum_u2y = 0.0;
    double sum_u4 = 0.0;
    for (std::int64_t i = from; i <= to; ++i) {
      const double u = static_cast<double>(i - peak) * step_s;
      const double y = at(i).mV - baseline;
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
    if (up ? c >= 0.0 : c <= 0.0) break;
    const double limit = static_cast<double>(reach) * step_s;
    vertex_s = std::clamp(-b / (2.0 * c), -limit, limit);
    double squares = 0.0;
    for (std::int64_t i = from; i <= to; ++i) {
      const double u = static_cast<double>(i - peak) * step_s;
      const double residual = at(i).mV - baseline - (a + b * u + c * u * u);
      squares += residual * residual;
    }
    const double noise = std::max(std::sqrt(squares / n), quiet_level_);
    deviation_s = noise / (2.0 * std::abs(c) * std::sqrt(sum_u2));
    const auto shift = static_cast<std::int64_t>(std::lround(vertex_s / step_s));
    if (pass == 0 && shift != 0) {
      peak += shift;
      vertex_s = 0.0;
    } else {
      break;
    }
  }
  candidate.peak.time = at(peak).time + from_seconds(vertex_s);
  candidate.peak.deviation = from_seconds(std::min(std::hypot(deviation_s, kDeviationFloor_s), kDeviationCap_s));
}

void RPeakDetector::take(const Candidate& candidate) noexcept {
  if (!learning_) {
    decide(candidate);
    return;
  }
  if (learnt_count_ == kLearningCapacity) {
    std::copy(learnt_.begin() + 1, learnt_.end(), learnt_.begin());
    --learnt_count_;
  }
  learnt_[static_cast<std::size_t>(learnt_count_++)] = candidate;
}

// Learning lasts until something stands out; only the last seconds count.
void RPeakDetector::finish_learning() noexcept {
  const Instant oldest = at(now_).time - kLearning;
  const auto end = std::remove_if(learnt_.begin(), learnt_.begin() + learnt_count_,
                                  [&](const Candidate& c) { return c.peak.time < oldest; });
  learnt_count_ = static_cast<int>(end - learnt_.begin());
  const auto strongest = std::max_element(learnt_.begin(), end,
                                          [](const Candidate& a, const Candidate& b) { return a.energy < b.energy; });
  if (strongest == end || !stands_out(*strongest)) return;
  learning_ = false;
  noise_level_ = quiet_level_;
  beat_energy_.push(strongest->energy);
  for (int i = 0; i < learnt_count_; ++i) decide(learnt_[static_cast<std::size_t>(i)]);
}

void RPeakDetector::decide(const Candidate& candidate) noexcept {
  const Instant t = candidate.peak.time;
  bool t_wave = false;
  if (has_last_) {
    const Duration since = t - last_.peak.time;
    if (since < kRefractory) return;
    t_wave = to_seconds(since) < kTWave * std::sqrt(rhythm_s()) && candidate.slope < kTWaveSlope * last_.slope;
  }
  if (!t_wave && stands_out(candidate) && candidate.energy > beat_threshold()) {
    accept(candidate, false);
    return;
  }
  noise_level_ += (candidate.energy - noise_level_) / kNoiseMemory;
  if (!t_wave && (!has_passed_over_ || candidate.energy > passed_over_.energy)) {
    passed_over_ = candidate;
    has_passed_over_ = true;
  }
}

// When a beat is overdue, the strongest candidate since the last one is taken, above a threshold that falls as time
// goes on. It has to wait a little, for a P wave is no beat when its QRS complex follows.
void RPeakDetector::search_back() noexcept {
  if (learning_ || !has_passed_over_) return;
  const Instant t = at(now_).time;
  const Duration late = overdue_by(t);
  if (late <= Duration::zero() || t - passed_over_.peak.time < kSearchBackWait) return;
  const double threshold = kSearchBackThreshold * beat_threshold() * std::exp(-to_seconds(late) / kDeafness_s);
  if (passed_over_.energy > threshold && stands_out(passed_over_)) accept(passed_over_, true);
}

void RPeakDetector::accept(const Candidate& candidate, bool searched_back) noexcept {
  const double beat_level = beat_energy_.median();
  const double margin = std::max(beat_level - noise_level_, 0.1 * beat_level);
  RPeak peak = candidate.peak;
  peak.detected_at = at(now_).time;
  peak.confidence = std::clamp((candidate.energy - noise_level_) / margin, 0.0, 1.0) *
                    (1.0 - std::min(quiet_level_ / candidate.energy, 1.0)) * (searched_back ? 0.5 : 1.0);
  if (queue_count_ < kQueue) {
    queue_[static_cast<std::size_t>((queue_begin_ + queue_count_) % kQueue)] = peak;
    ++queue_count_;
  }

  if (candidate.energy < kThreshold * beat_level) {  // taken by a threshold that had fallen: the gain has changed
    beat_energy_.clear();
    noise_level_ = quiet_level_;
  }
  beat_energy_.push(candidate.energy);

  const double keep = has_last_ ? 1.0 - 1.0 / kPolarityMemory : 0.0;
  upward_ = keep * upward_ + (1.0 - keep) * candidate.upward;
  downward_ = keep * downward_ + (1.0 - keep) * candidate.downward;
  const double hysteresis = has_last_ ? kPolarityHysteresis : 1.0;
  if (points_up_ ? downward_ > hysteresis * upward_ : upward_ >= hysteresis * downward_) points_up_ = !points_up_;

  if (has_last_) rr_s_.push(to_seconds(candidate.peak.time - last_.peak.time));
  last_ = candidate;
  has_last_ = true;
  has_passed_over_ = false;
}

// Far above the quiet part of the signal and above the converter's own steps.
bool RPeakDetector::stands_out(const Candidate& candidate) const noexcept {
  return candidate.energy > kStandOut * quiet_level_ && candidate.energy > kQuanta * quantum_mV_;
}

double RPeakDetector::beat_threshold() const noexcept {
  const double noise = std::min(std::max(noise_level_, quiet_level_), beat_energy_.median());
  return noise + kThreshold * (beat_energy_.median() - noise);
}

Duration RPeakDetector::overdue_by(Instant t) const noexcept {
  return has_last_ ? t - last_.peak.time - from_seconds(kSearchBack * rhythm_s()) : t - start_ - kLearning;
}

double RPeakDetector::rhythm_s() const noexcept {
  return rr_s_.count() > 0 ? std::min(rr_s_.mean(), kRhythmAtStart_s) : kRhythmAtStart_s;
}

}  // namespace perimap

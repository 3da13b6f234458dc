#include "core/phase/beat_classer.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {
constexpr double kUsual = 0.9;          // correlation with the usual shape from which on a beat is of it
constexpr int kConductionChanged = 4;   // beats in a row,
constexpr int kEctopicRun = 12;         // of a kind that has come early before
constexpr int kDisplaced = 4;           // steps, 20 ms
constexpr double kDoubtful = 0.3;       // confidence below which an unusual shape is thought noise,
constexpr double kMostDoubtful = 0.15;  // and a usual one, unless it comes when a beat is due
constexpr int kUnseen = 2;              // cycles: noise may have hidden the beat before
constexpr double kEarly = 0.9;          // of the rhythm's cycle, in an unusual shape
constexpr double kMuchTooEarly = 0.8;   // in the usual one
constexpr double kInRhythm = 0.15;      // of the rhythm's cycle, either way
constexpr double kPause = 1.5;          // rhythm's cycles
constexpr double kGap = 4.0;            // beyond, beats were missed
constexpr double kLongest = 1.35;       // cycles
constexpr double kOwn = 0.5;            // from which on a beat is the heart's own beside paced ones
constexpr int kStale = 8;               // beats in a row that taught the cycle nothing: it may be another by now

}  // namespace

// 1 - correlation with the usual shape; 0 while there is none.
double BeatClasser::strangeness(const QrsShape& shape) const noexcept {
  const int usual = templates_.heaviest();
  if (usual < 0 || !templates_.usable(usual) || shape.points == 0) return 0.0;
  return 1.0 - templates_.likeness_to(usual, shape, kDisplaced);
}

// log(interval / the rhythm's cycle); 0 where one of the two is not known.
double BeatClasser::log_of_cycle(double rr_s) const noexcept {
  return rr_s > 0.0 && normal_rr_s_.count() > 0 ? std::log(rr_s / normal_rr_s_.median()) : 0.0;
}

VentricularEvidence BeatClasser::evidence_of(const RPeak& peak, const BeatKinds::Comparison& compared) const noexcept {
  VentricularEvidence evidence;
  if (!has_last_) return evidence;
  evidence.unlike = compared.unlike;
  evidence.log_rr = log_of_cycle(to_seconds(peak.time - last_));
  evidence.spread = scatter_.mean();
  evidence.log_rr_before = log_of_cycle(raw_rr_s_);
  evidence.narrower = compared.narrower;
  evidence.paced = scatter_.like_clockwork();
  evidence.recurs = compared.recurs;
  evidence.apart = compared.apart;
  evidence.coupled = compared.coupled;
  evidence.after_one = last_ventricular_;
  evidence.kind_log_rr = compared.log_rr;
  evidence.kind_scatter = compared.scatter;
  return evidence;
}

bool BeatClasser::ventricular(const RPeak& peak, const VentricularEvidence& evidence) const noexcept {
  if (!has_last_ || normal_rr_s_.count() == 0 || peak.shape.points == 0) return false;
  return peak.confidence >= kDoubtful && log_odds(evidence) > 0.0;
}

BeatClass BeatClasser::by_interval(const RPeak& peak, bool unusual, bool at_any_time) const noexcept {
  if (!has_last_ || normal_rr_s_.count() == 0) return BeatClass::kNormal;
  const double cycle_s = normal_rr_s_.median();
  const double rr_s = to_seconds(peak.time - last_);
  // Breathing shortens cycles too, but not from one to the next.
  const double usual_s = last_rr_s_ > 0.0 ? std::min(cycle_s, last_rr_s_) : cycle_s;
  // A second cycle as short as the last, in the usual shape, is a new rhythm.
  const bool again = last_class_ == BeatClass::kPremature && !last_unusual_ && raw_rr_s_ > 0.0 &&
                     std::abs(rr_s - raw_rr_s_) < kInRhythm * raw_rr_s_;
  if (!unusual && again) return BeatClass::kNormal;
  if (!at_any_time && rr_s < kMuchTooEarly * usual_s && !is_due(peak, 1)) return BeatClass::kPremature;
  if (rr_s > kPause * cycle_s && last_class_ != BeatClass::kPremature) return BeatClass::kPause;
  return BeatClass::kNormal;
}

// One cycle after the last normal beat, or so many at most: after an interpolated beat the next normal one is where it
// would have been without.
bool BeatClasser::is_due(const RPeak& peak, int most_cycles) const noexcept {
  if (!has_normal_ || normal_rr_s_.count() == 0) return false;
  const double cycles = to_seconds(peak.time - last_normal_) / normal_rr_s_.median();
  return std::abs(cycles - std::clamp(std::round(cycles), 1.0, static_cast<double>(most_cycles))) < kInRhythm;
}

RPeak BeatClasser::classify(RPeak peak) noexcept {
  const bool gap =
      has_last_ && normal_rr_s_.count() > 0 && to_seconds(peak.time - last_) > kGap * normal_rr_s_.median();
  if (gap) interrupt();
  const double strange = strangeness(peak.shape);
  const bool unusual = strange > 1.0 - kUsual;
  const BeatKinds::Comparison compared = kinds_.compare(peak.shape);
  const bool early =
      has_last_ && normal_rr_s_.count() > 0 && to_seconds(peak.time - last_) < kEarly * normal_rr_s_.median();
  const bool again = compared.kind >= 0 && compared.kind == last_kind_ && !early;
  on_time_in_one_shape_ = again ? std::min(on_time_in_one_shape_ + 1, kEctopicRun + 1) : 0;
  if (!again) ectopic_run_ = compared.log_rr < kCameEarly;
  const VentricularEvidence evidence = evidence_of(peak, compared);
  const bool ventricular =
      on_time_in_one_shape_ < (ectopic_run_ ? kEctopicRun : kConductionChanged) && this->ventricular(peak, evidence);
  // In fibrillation beats come at any time, and so do those of a heart that a pacemaker waits for.
  const bool own = own_of_paced(evidence) > kOwn;
  const bool at_any_time = rhythm_.rhythm() == Rhythm::kUnpredictable || own;
  peak.beat_class = ventricular ? BeatClass::kPremature : by_interval(peak, unusual, at_any_time);
  if (peak.confidence < (unusual ? kDoubtful : kMostDoubtful) && !is_due(peak, kUnseen))
    peak.beat_class = BeatClass::kNoise;
  peak.unusual_shape = unusual || ventricular;
  if (peak.beat_class == BeatClass::kNoise) return peak;  // as if it had not been

  templates_.learn(peak.shape);
  learn_kind(peak, compared);
  if (has_last_) learn_rhythm(peak, unusual || own);
  last_unusual_ = peak.unusual_shape;
  last_ventricular_ = ventricular;
  last_ = peak.time;
  last_class_ = peak.beat_class;
  has_last_ = true;
  if (peak.beat_class != BeatClass::kPremature) {
    last_normal_ = peak.time;
    has_normal_ = true;
  }
  return peak;
}

void BeatClasser::learn_kind(const RPeak& peak, const BeatKinds::Comparison& compared) noexcept {
  const double log_rr = has_last_ ? log_of_cycle(to_seconds(peak.time - last_)) : 0.0;
  const int learnt = kinds_.learn(peak.shape, compared, log_rr);
  if (compared.usual && last_usual_kind_ && has_last_) scatter_.learn(log_rr);
  last_usual_kind_ = compared.usual;
  last_kind_ = learnt;
}

// The rhythm's cycle: intervals between beats in rhythm; from one over a premature beat, as it tells when every second
// beat is one, half. Bounded, so that a pause hardly counts but a new rhythm does after some beats.
void BeatClasser::learn_rhythm(const RPeak& peak, bool unusual) noexcept {
  last_rr_s_ = 0.0;
  const double before_s = raw_rr_s_;
  raw_rr_s_ = to_seconds(peak.time - last_);
  if (!peak.unusual_shape && !last_unusual_) rhythm_.push(Seconds(raw_rr_s_));
  const double rr_s = raw_rr_s_;
  ++untaught_;
  if (peak.beat_class == BeatClass::kPremature || unusual) {
    if (untaught_ > kStale && normal_rr_s_.count() > 0) push_cycle(rr_s);
    return;
  }
  const bool again = !last_unusual_ && std::abs(rr_s - before_s) < kInRhythm * before_s;
  if (last_class_ != BeatClass::kPremature || again) {
    if (last_unusual_) return;
    last_rr_s_ = rr_s;
    push_cycle(rr_s);
    untaught_ = 0;
    return;
  }
  if (!has_normal_ || normal_rr_s_.count() == 0) return;
  const double half_s = 0.5 * to_seconds(peak.time - last_normal_);
  const double cycle_s = normal_rr_s_.median();
  if (std::abs(half_s - cycle_s) < kInRhythm * cycle_s) {
    normal_rr_s_.push(half_s);
    untaught_ = 0;
  }
}

void BeatClasser::push_cycle(double rr_s) noexcept {
  normal_rr_s_.push(normal_rr_s_.count() == 0 ? rr_s : std::min(rr_s, kLongest * normal_rr_s_.median()));
}

}  // namespace perimap

#include "core/phase/beat_classer.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kUsual = 0.9;         // correlation with the usual shape from which on a beat is of it
constexpr double kOfItsOwn = 0.2;      // 1 - correlation with the usual shape: no usual beat that noise has bent
constexpr double kMostUnusual = 0.43;  // of the beats: beyond, neither of two shapes is the usual one
constexpr double kWider = 0.8;         // a ventricular complex's sharpness, of the usual one's
constexpr double kShareMemory = 32.0;  // beats
constexpr int kConductionChanged = 4;  // beats in a row
constexpr double kStranger = 1.5;      // times the usual beats' strangeness: a premature beat is ventricular
constexpr double kSlight = 0.01;
constexpr double kStrangenessMemory = 16.0;  // beats
constexpr int kDisplaced = 4;                // steps, 20 ms
constexpr double kDoubtful = 0.3;            // confidence below which an unusual shape is thought noise,
constexpr double kMostDoubtful = 0.15;       // and a usual one, unless it comes when a beat is due
constexpr int kUnseen = 2;                   // cycles: noise may have hidden the beat before
constexpr double kEarly = 0.9;               // of the rhythm's cycle, in an unusual shape
constexpr double kMuchTooEarly = 0.8;        // in the usual one
constexpr double kInRhythm = 0.15;           // of the rhythm's cycle, either way
constexpr double kPause = 1.5;               // rhythm's cycles
constexpr double kGap = 4.0;                 // beyond, beats were missed
constexpr double kLongest = 1.35;            // cycles

// How fast the slope changes beside how large it is: the less, the wider the complex. 0 for a shape of no points.
double sharpness(const QrsShape& shape) noexcept {
  double change = 0.0;
  double size = 0.0;
  for (int i = 1; i < shape.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    change += std::abs(shape.slope[k] - shape.slope[k - 1]);
    size += std::abs(shape.slope[k]);
  }
  return size > 0.0 ? change / size : 0.0;
}

}  // namespace

// 1 - correlation with the usual shape; 0 while there is none.
double BeatClasser::strangeness(const QrsShape& shape) const noexcept {
  const int usual = templates_.heaviest();
  if (usual < 0 || !templates_.usable(usual) || shape.points == 0) return 0.0;
  return 1.0 - templates_.best_match_with(usual, shape, kDisplaced).correlation;
}

bool BeatClasser::recurs_beside_the_usual(const QrsShape& shape) const noexcept {
  for (int i = 0; i < ShapeTemplates::kTemplates; ++i) {
    if (i == templates_.heaviest() || !templates_.usable(i)) continue;
    if (templates_.best_match_with(i, shape, kDisplaced).correlation > kUsual) return true;
  }
  return false;
}

BeatClass BeatClasser::by_interval(const RPeak& peak, bool unusual) const noexcept {
  if (!has_last_ || normal_rr_s_.count() == 0) return BeatClass::kNormal;
  const double cycle_s = normal_rr_s_.median();
  const double rr_s = to_seconds(peak.time - last_);
  if (unusual && rr_s < kEarly * cycle_s) return BeatClass::kPremature;
  // Breathing shortens cycles too, but not from one to the next.
  const double usual_s = last_rr_s_ > 0.0 ? std::min(cycle_s, last_rr_s_) : cycle_s;
  // A second cycle as short as the last, in the usual shape, is a new rhythm.
  const bool again = last_class_ == BeatClass::kPremature && !last_unusual_ && raw_rr_s_ > 0.0 &&
                     std::abs(rr_s - raw_rr_s_) < kInRhythm * raw_rr_s_;
  if (!unusual && again) return BeatClass::kNormal;
  if (!unusual && rr_s < kMuchTooEarly * usual_s && !is_due(peak, 1)) return BeatClass::kPremature;
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
  peak.beat_class = by_interval(peak, unusual);
  const bool ventricular_on_time = peak.beat_class == BeatClass::kNormal && strange > kOfItsOwn &&
                                   unusual_share_ < kMostUnusual && sharpness(peak.shape) < kWider * usual_sharpness_ &&
                                   recurs_beside_the_usual(peak.shape);
  on_time_in_another_shape_ = ventricular_on_time ? std::min(on_time_in_another_shape_ + 1, kConductionChanged + 1) : 0;
  if (ventricular_on_time && on_time_in_another_shape_ <= kConductionChanged) peak.beat_class = BeatClass::kPremature;
  if (peak.confidence < (unusual ? kDoubtful : kMostDoubtful) && !is_due(peak, kUnseen))
    peak.beat_class = BeatClass::kNoise;
  peak.unusual_shape =
      unusual || (peak.beat_class == BeatClass::kPremature && strange > kStranger * strangeness_ + kSlight);
  if (peak.beat_class == BeatClass::kNoise) return peak;  // as if it had not been

  templates_.learn(peak.shape, true);
  if (has_last_) learn(peak, unusual);
  last_unusual_ = peak.unusual_shape;
  if (!unusual) usual_sharpness_ += (sharpness(peak.shape) - usual_sharpness_) / kShareMemory;
  unusual_share_ += ((unusual ? 1.0 : 0.0) - unusual_share_) / kShareMemory;
  if (peak.beat_class == BeatClass::kNormal) strangeness_ += (strange - strangeness_) / kStrangenessMemory;
  last_ = peak.time;
  last_class_ = peak.beat_class;
  has_last_ = true;
  if (peak.beat_class != BeatClass::kPremature) {
    last_normal_ = peak.time;
    has_normal_ = true;
  }
  return peak;
}

// The rhythm's cycle: intervals between beats in rhythm; from one over a premature beat, as it tells when every second
// beat is one, half. Bounded, so that a pause hardly counts but a new rhythm does after some beats.
void BeatClasser::learn(const RPeak& peak, bool unusual) noexcept {
  last_rr_s_ = 0.0;
  const double before_s = raw_rr_s_;
  raw_rr_s_ = to_seconds(peak.time - last_);
  if (peak.beat_class == BeatClass::kPremature || unusual) return;
  const double rr_s = raw_rr_s_;
  const bool again = !last_unusual_ && std::abs(rr_s - before_s) < kInRhythm * before_s;
  if (last_class_ != BeatClass::kPremature || again) {
    if (last_unusual_) return;
    last_rr_s_ = rr_s;
    normal_rr_s_.push(normal_rr_s_.count() == 0 ? rr_s : std::min(rr_s, kLongest * normal_rr_s_.median()));
    return;
  }
  if (!has_normal_ || normal_rr_s_.count() == 0) return;
  const double half_s = 0.5 * to_seconds(peak.time - last_normal_);
  const double cycle_s = normal_rr_s_.median();
  if (std::abs(half_s - cycle_s) < kInRhythm * cycle_s) normal_rr_s_.push(half_s);
}

}  // namespace perimap

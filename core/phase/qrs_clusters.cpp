#include "core/phase/qrs_clusters.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace perimap {
namespace {

constexpr double kKeep = 0.99;  // of a cluster's weight from complex to complex
constexpr double kSame = 0.85;  // correlation from which on a complex is of a cluster
// A T wave may have the shape of a ventricular beat, but not its size.
constexpr double kSameSize = 2.0;
// Sizes of one kind scatter by 0.15, and a shape of 140 ms below 25 Hz has seven independent parts: from noise of this
// share of a kind's size on a size tells as much as the shape.
constexpr double kNoiseToSize = 0.4;
constexpr int kAgree = 3;            // sizes
constexpr double kLeastGain = 0.25;  // of a beat whose shape is looked for: ten times less is not seen in noise
constexpr double kSlowestLearning = 1.0 / 8.0;
constexpr int kDisplaced = 3;            // steps, 15 ms
constexpr double kMemory = 12.0;         // members that shares are of
constexpr double kLongMemory = 60.0;     // a burst of 20 s must not outweigh the beats before it
constexpr double kCaution = 2.0;         // members
constexpr double kOften = 0.4;           // share of P waves that are conducted: in 2:1 block half of them
constexpr double kHardlyWithout = 0.85;  // share of QRS complexes that a P wave precedes
constexpr int kEnough = 2;               // members
constexpr int kTimes = 3;                // that a kind came early: twice is chance
constexpr double kFollow = 0.2;          // share of a new distance in that of rivals

}  // namespace

// By the shape; in noise, where waves of other sizes come near to it, by the size as well.
ClusterMatch QrsClusters::nearest(const QrsShape& shape, int most_displaced, double noise) const noexcept {
  ClusterMatch nearest;
  const double size = root_mean_square(shape);
  double least = 0.0;
  for (int i = 0; i < kClusters; ++i) {
    if (at(i).weight == 0.0) continue;
    const ShapeMatch m = best_match(shape, at(i).shape, most_displaced);
    const double gain = m.gain / at(i).size;
    if (!(m.correlation > 0.0) || gain > kSameSize || gain < 1.0 / kSameSize) continue;
    // Squares of what is not the kind's shape, and of how far its size is from the kind's.
    const double limit = kNoiseToSize * at(i).size;
    const double counts = noise * noise / (noise * noise + limit * limit);
    const double left = size * size * (1.0 - m.correlation * m.correlation);
    const double other = at(i).size - m.gain;
    const double distance = left + counts * other * other;
    if (nearest.of >= 0 && distance >= least) continue;
    least = distance;
    nearest = {i, m.correlation, gain};
  }
  return nearest;
}

ClusterMatch QrsClusters::nearest_beat(const QrsShape& shape) const noexcept {
  ClusterMatch nearest;
  for (int i = 0; i < kClusters; ++i) {
    if (!recurs(i) || log_odds(i) < 0.0) continue;
    const ShapeMatch m = match(shape, at(i).shape);
    const double gain = m.gain / at(i).size;
    if (m.correlation <= nearest.correlation || gain < kLeastGain) continue;
    nearest = {i, m.correlation, gain};
  }
  return nearest;
}

int QrsClusters::make_room(bool frozen) noexcept {
  int room = -1;
  const auto spared = [&](int i) { return frozen && settled(i); };
  for (int i = 0; i < kClusters; ++i) {
    if (room < 0 || (spared(i) != spared(room) ? spared(room) : at(i).weight < at(room).weight)) room = i;
  }
  clusters_[static_cast<std::size_t>(room)] = {};
  for (Cluster& c : clusters_) {
    if (c.before == room) {
      c.before = -1;
      c.preceded = 0.0;
      c.preceded_known = 0.0;
    }
    for (Rival& rival : c.rivals) {
      if (rival.by == room) rival = {};
    }
  }
  return room;
}

int QrsClusters::learn(const QrsShape& shape, bool upward, Surroundings around, Instant seen) noexcept {
  const double size = root_mean_square(shape);
  if (!(size > 0.0)) return -1;
  const bool frozen = around == Surroundings::kBurst;
  for (int i = 0; i < kClusters; ++i) {
    if (!frozen || !settled(i)) clusters_[static_cast<std::size_t>(i)].weight *= kKeep;
  }
  ClusterMatch same = nearest(shape, kDisplaced);
  if (same.correlation < kSame) {
    same.of = make_room(frozen);
    Cluster& anew = clusters_[static_cast<std::size_t>(same.of)];
    anew.shape.points = shape.points;
    anew.upward = upward;
    anew.born = seen;
  }
  Cluster& c = clusters_[static_cast<std::size_t>(same.of)];
  c.weight += 1.0;
  c.calm_known = std::min(c.calm_known + 1.0, kLongMemory);
  c.calm += ((around == Surroundings::kCalm ? 1.0 : 0.0) - c.calm) / c.calm_known;
  const double rate = std::max(1.0 / c.weight, kSlowestLearning);
  for (int i = 0; i < shape.points; ++i) {
    float& mean = c.shape.slope[static_cast<std::size_t>(i)];
    mean += static_cast<float>(rate) * (shape.slope[static_cast<std::size_t>(i)] / static_cast<float>(size) - mean);
  }
  const auto norm = static_cast<float>(root_mean_square(c.shape));
  if (norm > 0.0F) {
    for (float& slope : c.shape.slope) slope /= norm;
  }
  c.sizes.push(size);
  // The median; but where the last few agree that the gain has changed it is late.
  c.size = std::clamp(c.sizes.median(), c.sizes.smallest_of_last(kAgree), c.sizes.largest_of_last(kAgree));
  return same.of;
}

void QrsClusters::judged(int of, double log_odds) noexcept {
  if (of < 0) return;
  Cluster& c = clusters_[static_cast<std::size_t>(of)];
  c.judged = std::min(c.judged + 1.0, kMemory);
  c.log_odds += (log_odds - c.log_odds) / c.judged;
}

double QrsClusters::log_odds(int i) const noexcept { return at(i).log_odds * at(i).judged / (at(i).judged + kCaution); }

void QrsClusters::followed(int of, bool by_sharper) noexcept {
  if (of < 0) return;
  Cluster& c = clusters_[static_cast<std::size_t>(of)];
  c.followed_known = std::min(c.followed_known + 1.0, kMemory);
  c.followed += ((by_sharper ? 1.0 : 0.0) - c.followed) / c.followed_known;
}

void QrsClusters::preceded(int of, int by) noexcept {
  if (of < 0) return;
  Cluster& c = clusters_[static_cast<std::size_t>(of)];
  c.preceded_known = std::min(c.preceded_known + 1.0, kMemory);
  if (by >= 0 && by != c.before && c.preceded <= 1.0 - kHardlyWithout) c.before = by;
  c.preceded += ((by >= 0 && by == c.before ? 1.0 : 0.0) - c.preceded) / c.preceded_known;
}

bool QrsClusters::leads(int i) const noexcept {
  if (i < 0 || at(i).followed < kOften) return false;
  return std::any_of(clusters_.begin(), clusters_.end(), [&](const Cluster& c) {
    return &c != &at(i) && c.before == i && c.preceded_known >= kEnough && c.preceded >= kHardlyWithout;
  });
}

bool QrsClusters::beside(int of, int by, double after_s, double scatter_s, bool at_first) noexcept {
  auto& rivals = clusters_[static_cast<std::size_t>(of)].rivals;
  const auto same_side = [&](const Rival& rival) { return rival.after_s * after_s > 0.0; };
  const bool first = std::none_of(rivals.begin(), rivals.end(), same_side);
  const auto known = std::find_if(rivals.begin(), rivals.end(), [&](const Rival& rival) {
    return same_side(rival) && std::abs(after_s - rival.after_s) < scatter_s;
  });
  const bool same_distance = known != rivals.end();
  const bool same_kind = same_distance && known->by == by && recurs(by);
  const double mean_s = same_distance ? known->after_s + kFollow * (after_s - known->after_s) : after_s;
  std::move_backward(rivals.begin(), same_distance ? known : std::prev(rivals.end()),
                     same_distance ? std::next(known) : rivals.end());
  rivals.front() = {by, mean_s};
  return same_kind || (at_first && (same_distance || first));
}

void QrsClusters::rivalled(int of, bool by_another) noexcept {
  if (of < 0) return;
  Cluster& c = clusters_[static_cast<std::size_t>(of)];
  c.rivalled_known = std::min(c.rivalled_known + 1.0, kMemory);
  c.rivalled += ((by_another ? 1.0 : 0.0) - c.rivalled) / c.rivalled_known;
}

void QrsClusters::came(int of, double log_of_cycle) noexcept {
  if (of < 0) return;
  Cluster& c = clusters_[static_cast<std::size_t>(of)];
  c.came_known = std::min(c.came_known + 1.0, kMemory);
  c.log_of_cycle += (log_of_cycle - c.log_of_cycle) / c.came_known;
}

double QrsClusters::log_of_cycle(int i) const noexcept {
  return i >= 0 && at(i).came_known >= kTimes ? at(i).log_of_cycle : 0.0;
}

void QrsClusters::settle(int of) noexcept {
  Cluster& c = clusters_[static_cast<std::size_t>(of)];
  c.calm = 1.0;
  c.calm_known = kCaution;
}

bool QrsClusters::any_settled() const noexcept {
  for (int i = 0; i < kClusters; ++i) {
    if (settled(i)) return true;
  }
  return false;
}

bool QrsClusters::any_recurs() const noexcept {
  return std::any_of(clusters_.begin(), clusters_.end(), [](const Cluster& c) { return c.weight >= kRecurs; });
}

}  // namespace perimap

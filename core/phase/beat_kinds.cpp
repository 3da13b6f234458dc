#include "core/phase/beat_kinds.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kOneKind = 0.12;  // of 2 (1 - correlation) + log(size ratio)^2, the difference's energy to the shape's
constexpr double kKeep = 0.998;    // of a kind's weight from beat to beat: some 500 beats count
constexpr double kSlowest = 1.0 / 8.0;           // learning of the mean,
constexpr double kSlowestVariance = 1.0 / 32.0;  // and of the variances
constexpr double kVarianceAtFirst = 0.01;        // to the mean square of the shape
constexpr double kLeastVariance = 0.0009;        // likewise: of 3 %, as converters and filters differ
constexpr double kMemory = 16.0;                 // beats
constexpr int kEnough = 3;                       // members
constexpr int kEnoughIntervals = 4;              // of a kind, to tell how they scatter
constexpr double kAnother = 6.0;           // unlikeness of a kind; the usual beats of a record have 1, one in 50 has 7
constexpr double kApart = 55.0;            // likewise: what has recurred is no noise
constexpr double kEarly = -0.08;           // log of the interval to the cycle,
constexpr double kFixed = 0.14;            // mean deviation of that,
constexpr double kDeviationAtFirst = 0.3;  // while it is not known,
constexpr int kDisplaced = 3;              // steps, 15 ms
constexpr int kFarther = 4;                // of another kind: its peak is another wave

double square(double x) noexcept { return x * x; }

double difference(const QrsShape& shape, const QrsShape& kind) noexcept {
  const double size = root_mean_square(shape);
  const double of_kind = root_mean_square(kind);
  if (!(size > 0.0) || !(of_kind > 0.0)) return kOneKind;
  return 2.0 * (1.0 - best_match(shape, kind, kDisplaced).correlation) + square(std::log(size / of_kind));
}

// How fast the slope changes from point to point, beside how large it is: a narrow complex changes faster.
double quickness(const QrsShape& shape) noexcept {
  double changes = 0.0;
  for (std::size_t i = 1; i < static_cast<std::size_t>(shape.points); ++i) {
    changes += square(static_cast<double>(shape.slope[i] - shape.slope[i - 1]));
  }
  const double size = root_mean_square(shape);
  return size > 0.0 ? std::sqrt(changes / shape.points) / size : 0.0;
}

// Where two shapes overlap, one displaced by so many steps: what(point of the shape, index in the reference).
template <class What>
void overlap(const QrsShape& shape, int displaced, What&& what) noexcept {
  const int last = std::min(shape.points, shape.points - displaced);
  for (int i = std::max(0, -displaced); i < last; ++i) {
    what(static_cast<double>(shape.slope[static_cast<std::size_t>(i + displaced)]), static_cast<std::size_t>(i));
  }
}

}  // namespace

int BeatKinds::usual() const noexcept {
  const auto heaviest =
      std::max_element(kinds_.begin(), kinds_.end(), [](const Kind& a, const Kind& b) { return a.weight < b.weight; });
  return heaviest->weight > 0.0 ? static_cast<int>(heaviest - kinds_.begin()) : -1;
}

double BeatKinds::unlike(const QrsShape& shape, const Kind& usual) noexcept {
  const double least = kLeastVariance * square(root_mean_square(usual.shape));
  double sum = 0.0;
  double points = 0.0;
  overlap(shape, best_match(shape, usual.shape, kFarther).displaced, [&](double slope, std::size_t i) {
    sum += square(slope - static_cast<double>(usual.shape.slope[i])) / (static_cast<double>(usual.variance[i]) + least);
    points += 1.0;
  });
  return points > 0.0 && least > 0.0 ? sum / points : 0.0;
}

BeatKinds::Comparison BeatKinds::compare(const QrsShape& shape) const noexcept {
  Comparison compared;
  const int usual = this->usual();
  if (shape.points == 0 || usual < 0) return compared;
  double least = kOneKind;
  for (int i = 0; i < kKinds; ++i) {
    if (at(i).weight == 0.0) continue;
    const double other = difference(shape, at(i).shape);
    if (other >= least) continue;
    least = other;
    compared.kind = i;
  }
  compared.usual = compared.kind == usual;
  if (at(usual).members >= kEnough) {
    compared.unlike = unlike(shape, at(usual));
    const double own = quickness(shape);
    const double of_usual = quickness(at(usual).shape);
    if (own > 0.0 && of_usual > 0.0) compared.narrower = std::log(own / of_usual);
  }
  if (compared.kind < 0) return compared;
  const Kind& kind = at(compared.kind);
  compared.recurs = kind.members >= kEnough;
  if (compared.usual) return compared;
  if (kind.intervals >= kEnoughIntervals) {
    compared.log_rr = kind.log_rr;
    compared.scatter = kind.log_rr_deviation;
  }
  if (!compared.recurs) return compared;
  const double apart = unlike(kind.shape, at(usual));
  compared.apart = apart > kApart;
  compared.coupled = kind.log_rr < kEarly && kind.log_rr_deviation < kFixed && apart > kAnother;
  return compared;
}

int BeatKinds::learn(const QrsShape& shape, const Comparison& compared, double log_rr) noexcept {
  if (shape.points == 0) return -1;
  for (Kind& kind : kinds_) kind.weight *= kKeep;
  auto of = kinds_.begin() + compared.kind;
  if (compared.kind < 0) {
    of = std::min_element(kinds_.begin(), kinds_.end(),
                          [](const Kind& a, const Kind& b) { return a.weight < b.weight; });
    *of = {};
    of->shape = shape;
    of->variance.fill(static_cast<float>(kVarianceAtFirst * square(root_mean_square(shape))));
    of->log_rr_deviation = kDeviationAtFirst;
  } else {
    learn_variance(shape, *of);
  }
  of->weight += 1.0;
  of->members = std::min(of->members + 1.0, kMemory);
  const auto rate = static_cast<float>(std::max(1.0 / of->weight, kSlowest));
  for (std::size_t i = 0; i < static_cast<std::size_t>(shape.points); ++i) {
    of->shape.slope[i] += rate * (shape.slope[i] - of->shape.slope[i]);
  }
  if (log_rr != 0.0) learn_interval(log_rr, *of);
  return static_cast<int>(of - kinds_.begin());
}

void BeatKinds::learn_variance(const QrsShape& shape, Kind& kind) noexcept {
  const double rate = std::max(1.0 / (kind.weight + 1.0), kSlowestVariance);
  const double most = square(root_mean_square(kind.shape));
  overlap(shape, best_match(shape, kind.shape, kDisplaced).displaced, [&](double slope, std::size_t i) {
    const double seen = std::min(square(slope - static_cast<double>(kind.shape.slope[i])), most);
    kind.variance[i] += static_cast<float>(rate * (seen - static_cast<double>(kind.variance[i])));
  });
}

void BeatKinds::learn_interval(double log_rr, Kind& kind) noexcept {
  kind.intervals = std::min(kind.intervals + 1.0, kMemory);
  if (kind.intervals > 1.0) {
    kind.log_rr_deviation += (std::abs(log_rr - kind.log_rr) - kind.log_rr_deviation) / kind.intervals;
  }
  kind.log_rr += (log_rr - kind.log_rr) / kind.intervals;
}

}  // namespace perimap

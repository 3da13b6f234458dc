#include "daemon/evaluation/traces/cycle_lengths.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angle/angle.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kMostOfCycle = 0.6;  // that systole is
constexpr double kShortest = 0.5;     // of the usual length,
constexpr double kLongest = 1.8;      // between which candidates lie
constexpr double kStep_s = 0.02;
constexpr double kSmooth_s = 0.08;  // width of the kernel on each length that was
constexpr double kMemory = 12.0;    // cycles
constexpr double kAnything = 1e-3;  // weight of a length that never was

}  // namespace

CycleLengths::CycleLengths(std::vector<double> peaks_s, double now_s, double systole_s)
    : peaks_s_(std::move(peaks_s)), systole_s_(systole_s) {
  std::vector<double> lengths_s;
  for (std::size_t k = 1; k < peaks_s_.size(); ++k) lengths_s.push_back(peaks_s_[k] - peaks_s_[k - 1]);
  auto sorted = lengths_s;
  usual_s_ = upper_median(sorted.begin(), sorted.end());
  double sum = 0.0;
  const auto steps = static_cast<int>(std::ceil((kLongest - kShortest) * usual_s_ / kStep_s));
  for (int step = 0; step < steps; ++step) {
    const double length_s = kShortest * usual_s_ + step * kStep_s;
    if (peaks_s_.back() + length_s <= now_s) continue;
    double weight = kAnything;
    for (std::size_t k = 0; k < lengths_s.size(); ++k) {
      const double off = (length_s - lengths_s[k]) / kSmooth_s;
      weight += std::exp(-0.5 * off * off - static_cast<double>(lengths_s.size() - 1 - k) / kMemory);
    }
    candidates_.push_back({length_s, weight});
    sum += weight;
  }
  // Longer than any candidate: it ends any moment.
  if (candidates_.empty()) candidates_.push_back({now_s - peaks_s_.back() + kStep_s, sum = 1.0});
  for (Candidate& candidate : candidates_) candidate.weight /= sum;
}

double CycleLengths::within(double since_s, double length_s) const {
  const double systole_s = std::min(systole_s_, kMostOfCycle * length_s);
  if (since_s <= systole_s) return kTwoPi * since_s / usual_s_;
  const double at_end = kTwoPi * systole_s / usual_s_;
  return at_end + (kTwoPi - at_end) * (since_s - systole_s) / (length_s - systole_s);
}

double CycleLengths::phase(double t_s, double last_length_s) const {
  if (t_s < peaks_s_.front()) return -kTwoPi * (peaks_s_.front() - t_s) / usual_s_;
  const auto after = std::upper_bound(peaks_s_.begin(), peaks_s_.end(), t_s);
  const auto k = static_cast<std::size_t>(after - peaks_s_.begin()) - 1;
  const double cycles = kTwoPi * static_cast<double>(k);
  if (k + 1 < peaks_s_.size()) return cycles + within(t_s - peaks_s_[k], peaks_s_[k + 1] - peaks_s_[k]);
  const double since_s = t_s - peaks_s_[k];
  return since_s < last_length_s ? cycles + within(since_s, last_length_s)
                                 : cycles + kTwoPi + within(since_s - last_length_s, usual_s_);
}

}  // namespace perimap

// How much of a model's own motion there is in what features do: of each harmonic a complex gain.
//
// With the harmonic a cos - b sin of the model as the number a + i b, the features' is (g + i h)(a + i b) and a rest
// that is a Gaussian process. g is the model's share, and h how far it comes earlier or later: a motion that is the
// model's but for its size, and for a delay, has no rest; one that is another has a gain near 0 (estimated generalised
// least squares; Rasmussen & Williams 2006, ch. 2.7, with the prior below).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// Harmonics of V places in the chart's axes.
struct ChartedHarmonics {
  Eigen::MatrixXd across_mm;  // V x 4 B: of each band the cosine's x, y, the sine's x, y
  Eigen::MatrixXd along_mm;   // V x 2 B: of each band the cosine's z, the sine's z

  [[nodiscard]] Eigen::Index bands() const noexcept { return along_mm.cols() / 2; }
};

struct HarmonicGain {
  double in_step = 0.0;      // g
  double out_of_step = 0.0;  // h
  double variance = 0.0;     // of each; all are 0 where the model has no such harmonic
};
using ModelGains = std::vector<HarmonicGain>;  // of each band of a group

// What one direction tells of the gains, N places: both whitened by the same factor, L^-1 Y, so that the rest is white
// with the variance of its band.
struct WhitenedHarmonics {
  Eigen::MatrixXd seen;   // N x C, a column for each output
  Eigen::MatrixXd model;  // likewise
};

// The likeliest, with a prior that the model is about right: 1 in step, none out of step, each with a deviation of 1,
// so that no motion at all and one of twice the size are within it. The variances of the rest are estimated along.
// `told`: how many numbers there are of each output.
[[nodiscard]] ModelGains likeliest_gains(const WhitenedHarmonics& across, const WhitenedHarmonics& along,
                                         Eigen::Index told);

// What they add to minus the logarithm of the marginal likelihood: by how many numbers that have been adapted there is
// more to explain with (Laplace's approximation, which for gains is exact).
[[nodiscard]] double cost_of(const ModelGains& gains);

// The model's harmonics times the gains.
[[nodiscard]] ChartedHarmonics scaled(const ChartedHarmonics& model, const ModelGains& gains);

// What the gains' variances make of the position of place v, mean over the cycle, in the chart's axes: `model` is by
// how much the prediction goes with them.
[[nodiscard]] Matrix3d gain_covariance_mm2(const ChartedHarmonics& model, const ModelGains& gains, Eigen::Index v);
// Of one band's coefficients alone, each of cosine and sine.
[[nodiscard]] Matrix3d gain_covariance_mm2(const ChartedHarmonics& model, const HarmonicGain& gain, Eigen::Index v,
                                           Eigen::Index band);

}  // namespace perimap

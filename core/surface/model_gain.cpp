#include "core/surface/model_gain.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace perimap {
namespace {

constexpr double kPriorGain = 1.0;
constexpr double kPriorVariance = 1.0;

// Columns of cosine and sine of a band, one for each axis.
struct BandColumns {
  Eigen::Index cosine, sine, axes;
};

BandColumns columns_of(Eigen::Index outputs, Eigen::Index bands, Eigen::Index band) {
  const Eigen::Index axes = outputs / bands / 2;
  return {2 * axes * band, 2 * axes * band + axes, axes};
}

auto times(const Eigen::MatrixXd& model, const BandColumns& of, const HarmonicGain& gain) {
  Eigen::MatrixXd out(model.rows(), 2 * of.axes);
  const auto a = model.middleCols(of.cosine, of.axes);
  const auto b = model.middleCols(of.sine, of.axes);
  out.leftCols(of.axes) = gain.in_step * a - gain.out_of_step * b;
  out.rightCols(of.axes) = gain.in_step * b + gain.out_of_step * a;
  return out;
}

// Of one band in one direction.
struct Told {
  double variance = 0.0;  // of the rest
  double weight = 0.0;    // |model|^2
  double in_step = 0.0;   // <model, seen>
  double out_of_step = 0.0;
};

Told told_by(const WhitenedHarmonics& direction, const BandColumns& of, const HarmonicGain& gain, Eigen::Index told) {
  const auto a = direction.model.middleCols(of.cosine, of.axes);
  const auto b = direction.model.middleCols(of.sine, of.axes);
  const auto y_a = direction.seen.middleCols(of.cosine, of.axes);
  const auto y_b = direction.seen.middleCols(of.sine, of.axes);
  const Eigen::MatrixXd rest = direction.seen.middleCols(of.cosine, 2 * of.axes) - times(direction.model, of, gain);
  Told out;
  out.variance = std::max(rest.squaredNorm() / static_cast<double>(told * 2 * of.axes), 1e-12);
  out.weight = a.squaredNorm() + b.squaredNorm();
  out.in_step = a.cwiseProduct(y_a).sum() + b.cwiseProduct(y_b).sum();
  out.out_of_step = a.cwiseProduct(y_b).sum() - b.cwiseProduct(y_a).sum();
  return out;
}

}  // namespace

ModelGains likeliest_gains(const WhitenedHarmonics& across, const WhitenedHarmonics& along, Eigen::Index told) {
  const Eigen::Index bands = along.seen.cols() / 2;
  ModelGains gains(static_cast<std::size_t>(bands));
  // From no gain at all the variances fall with each round; ten leave nothing of the third digit.
  constexpr int kRounds = 10;
  for (Eigen::Index band = 0; band < bands; ++band) {
    HarmonicGain& gain = gains[static_cast<std::size_t>(band)];
    for (int round = 0; round < kRounds; ++round) {
      double precision = 1.0 / kPriorVariance;
      double in_step = kPriorGain / kPriorVariance;
      double out_of_step = 0.0;
      double weight = 0.0;
      for (const WhitenedHarmonics* direction : {&across, &along}) {
        const Told of = told_by(*direction, columns_of(direction->seen.cols(), bands, band), gain, told);
        precision += of.weight / of.variance;
        in_step += of.in_step / of.variance;
        out_of_step += of.out_of_step / of.variance;
        weight += of.weight;
      }
      if (!(weight > 0.0)) break;
      gain = {in_step / precision, out_of_step / precision, 1.0 / precision};
    }
  }
  return gains;
}

double cost_of(const ModelGains& gains) {
  double cost = 0.0;
  for (const HarmonicGain& gain : gains) {
    if (!(gain.variance > 0.0)) continue;
    const double off = gain.in_step - kPriorGain;
    cost += 0.5 * (off * off + gain.out_of_step * gain.out_of_step) / kPriorVariance +
            std::log(kPriorVariance / gain.variance);
  }
  return cost;
}

ChartedHarmonics scaled(const ChartedHarmonics& model, const ModelGains& gains) {
  ChartedHarmonics out = model;
  for (Eigen::Index band = 0; band < model.bands(); ++band) {
    const HarmonicGain& gain = gains[static_cast<std::size_t>(band)];
    for (const auto& [from, to] :
         {std::pair(&model.across_mm, &out.across_mm), std::pair(&model.along_mm, &out.along_mm)}) {
      const BandColumns of = columns_of(from->cols(), model.bands(), band);
      to->middleCols(of.cosine, 2 * of.axes) = times(*from, of, gain);
    }
  }
  return out;
}

Matrix3d gain_covariance_mm2(const ChartedHarmonics& model, const HarmonicGain& gain, Eigen::Index v,
                             Eigen::Index band) {
  const auto across = model.across_mm.row(v).segment<4>(4 * band);
  const auto along = model.along_mm.row(v).segment<2>(2 * band);
  const Vector3d cosine(across(0), across(1), along(0));
  const Vector3d sine(across(2), across(3), along(1));
  return gain.variance * (cosine * cosine.transpose() + sine * sine.transpose());
}

Matrix3d gain_covariance_mm2(const ChartedHarmonics& model, const ModelGains& gains, Eigen::Index v) {
  Matrix3d covariance = Matrix3d::Zero();
  for (Eigen::Index band = 0; band < model.bands(); ++band) {
    covariance += gain_covariance_mm2(model, gains[static_cast<std::size_t>(band)], v, band);
  }
  return covariance;
}

}  // namespace perimap

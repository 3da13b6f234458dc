#include "core/setup_watch/setup_verdict.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace perimap {
namespace {

// Nobody mistakes more at once, and with more of them free anything is explained.
constexpr int kMostBlamed = 3;
// What a further number explains by chance, twice over: of two parts that explain alike the smaller is blamed.
constexpr double kByChance = 2.0;

// The estimate with nothing but some parts free.
struct Hypothesis {
  std::array<bool, kSetupParts.size()> parts{};
  std::vector<int> numbers;
  SetupVector deviation = SetupVector::Zero();
  SetupVector uncertainty = SetupVector::Zero();
  double explained = 0.0;  // chi-squared

  [[nodiscard]] double merit() const { return explained - kByChance * static_cast<double>(numbers.size()); }
};

// `information` and `pull`: of all numbers, about the configured set-up.
Hypothesis with(const Hypothesis& before, SetupPart part, const SetupMatrix& information, const SetupVector& pull) {
  Hypothesis hypothesis = before;
  hypothesis.parts[index_of(part)] = true;
  const SetupRange range = range_of(part);
  for (int i = 0; i < range.size; ++i) hypothesis.numbers.push_back(range.begin + i);
  const Eigen::MatrixXd free_information = information(hypothesis.numbers, hypothesis.numbers);
  const Eigen::VectorXd free_pull = pull(hypothesis.numbers);
  const Eigen::LLT<Eigen::MatrixXd> factor(free_information);
  const auto n = static_cast<Eigen::Index>(hypothesis.numbers.size());
  const Eigen::VectorXd value = factor.solve(free_pull);
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(n, n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const int number = hypothesis.numbers[static_cast<std::size_t>(i)];
    hypothesis.deviation(number) = value(i);
    hypothesis.uncertainty(number) = std::sqrt(covariance(i, i));
  }
  hypothesis.explained = free_pull.dot(value);
  return hypothesis;
}

Hypothesis best_with_one_more(const Hypothesis& before, const SetupMatrix& information, const SetupVector& pull) {
  Hypothesis best = before;
  for (const SetupPart part : kSetupParts) {
    if (before.parts[index_of(part)]) continue;
    const Hypothesis more = with(before, part, information, pull);
    if (best.numbers.size() == before.numbers.size() || more.merit() > best.merit()) best = more;
  }
  return best;
}

double surface_mm(const SetupFit& fit, const SetupVector& deviation) {
  double sum = 0.0;
  for (const auto& shift : fit.shift) sum += (shift * deviation).squaredNorm();
  return std::sqrt(sum / static_cast<double>(fit.shift.size()));
}

double surface_deviation_mm(const SetupFit& fit) {
  double sum = 0.0;
  for (const auto& shift : fit.shift) sum += (shift * fit.covariance * shift.transpose()).trace();
  return std::sqrt(sum / static_cast<double>(fit.shift.size()));
}

// Of the surface, root mean square, if one part alone is wrong or none, each by the chance that the window leaves it:
// the evidence for a part is its likelihood with its numbers integrated out (Bayes factors of nested Gaussian models;
// Kass and Raftery, J. Am. Stat. Assoc. 90, 1995). A part of which the window tells nothing keeps its chance and the
// prior's deviation.
double expected_mm(const SetupFit& fit, const SetupMatrix& information, const SetupVector& pull,
                   const SetupVerdictSettings& settings) {
  const SetupVector prior = settings.wrong_by * widest_setup_deviations();
  const double right = 1.0 - settings.wrong_probability;
  const double each = settings.wrong_probability / static_cast<double>(kSetupParts.size());
  double largest = std::log(right);
  std::array<double, kSetupParts.size()> log_weights{};
  std::array<double, kSetupParts.size()> squares_mm2{};
  for (const SetupPart part : kSetupParts) {
    const SetupRange range = range_of(part);
    const Eigen::VectorXd deviations = prior.segment(range.begin, range.size);
    const Eigen::VectorXd free_pull = pull.segment(range.begin, range.size);
    Eigen::MatrixXd posterior = information.block(range.begin, range.begin, range.size, range.size);
    posterior += Eigen::MatrixXd(deviations.cwiseAbs2().cwiseInverse().asDiagonal());
    const Eigen::LLT<Eigen::MatrixXd> factor(posterior);
    const Eigen::VectorXd value = factor.solve(free_pull);
    const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(range.size, range.size));
    const Eigen::VectorXd root = Eigen::MatrixXd(factor.matrixL()).diagonal();
    const std::size_t i = index_of(part);
    log_weights[i] = std::log(each) + 0.5 * free_pull.dot(value) - (root.array() * deviations.array()).log().sum();
    largest = std::max(largest, log_weights[i]);
    for (const auto& shift : fit.shift) {
      const Eigen::MatrixXd of_part = shift.middleCols(range.begin, range.size);
      squares_mm2[i] += (of_part * value).squaredNorm() + (of_part * covariance * of_part.transpose()).trace();
    }
  }
  double weights = std::exp(std::log(right) - largest);
  double sum = 0.0;
  for (std::size_t i = 0; i < kSetupParts.size(); ++i) {
    const double weight = std::exp(log_weights[i] - largest);
    weights += weight;
    sum += weight * squares_mm2[i];
  }
  return std::sqrt(sum / (weights * static_cast<double>(fit.shift.size())));
}

}  // namespace

SetupVerdict judge_setup(const SetupFit& fit, const SetupVerdictSettings& settings) {
  SetupVerdict verdict;
  if (fit.state == SetupFitState::kStill) verdict.state = SetupState::kUndetermined;
  if (fit.state != SetupFitState::kSolved || fit.shift.empty()) return verdict;
  const Eigen::LLT<SetupMatrix> factor(fit.covariance);
  if (factor.info() != Eigen::Success) return verdict;
  const SetupMatrix information = factor.solve(SetupMatrix::Identity());
  const SetupVector pull = information * fit.deviation;
  verdict.deviation = fit.deviation;
  verdict.uncertainty = fit.covariance.diagonal().cwiseSqrt();
  verdict.surface_deviation_mm = surface_deviation_mm(fit);
  verdict.chi2_with = fit.chi2_with;
  verdict.chi2_without = fit.chi2_without;
  verdict.freedom = fit.freedom;
  verdict.scatter = fit.scatter;
  verdict.error_correlation_s = fit.error_correlation_s;
  verdict.frames = fit.frames;
  verdict.matches = fit.matches;

  // Where the window tells little, the estimate's covariance promises somewhat too much.
  const double caution = std::max(1.0, verdict.surface_deviation_mm / settings.undetermined_mm);
  Hypothesis blamed;
  for (int i = 0; i < kMostBlamed; ++i) {
    const Hypothesis more = best_with_one_more(blamed, information, pull);
    const auto numbers = static_cast<double>(more.numbers.size() - blamed.numbers.size());
    const double needed = caution * (settings.doubted_chi2 + settings.doubted_chi2_per_number * (numbers - 1.0));
    if (i == 0) {
      verdict.explained = more.explained;
      verdict.certainty = more.explained / needed;
      verdict.surface_mm = surface_mm(fit, more.deviation);
    }
    if (more.explained - blamed.explained < needed) break;
    blamed = more;
  }
  if (!blamed.numbers.empty()) verdict.surface_mm = surface_mm(fit, blamed.deviation);
  verdict.widening_mm = expected_mm(fit, information, pull, settings);
  if (verdict.explained > settings.chance_chi2) {
    verdict.suspected_mm = verdict.surface_mm * std::sqrt(1.0 - settings.chance_chi2 / verdict.explained);
  }
  if (!blamed.numbers.empty() && verdict.surface_mm > settings.doubted_mm) {
    verdict.state = SetupState::kDoubted;
    verdict.blamed = blamed.parts;
    verdict.blamed_deviation = blamed.deviation;
    verdict.blamed_uncertainty = blamed.uncertainty;
    return verdict;
  }
  verdict.state =
      verdict.surface_deviation_mm > settings.undetermined_mm ? SetupState::kUndetermined : SetupState::kConsistent;
  return verdict;
}

}  // namespace perimap

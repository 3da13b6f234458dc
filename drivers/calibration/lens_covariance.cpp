#include "drivers/calibration/lens_covariance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <exception>
#include <vector>

#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr const char* kKey = "lens_covariance";
constexpr std::size_t kLargestFile = std::size_t{1} << 20;
constexpr std::size_t kNumbers = 81;

// In units in which each number that is free weighs alike.
bool is_covariance(const LensCovariance& C) {
  if (!C.allFinite() || !(C.diagonal().minCoeff() >= 0.0)) return false;
  if ((C - C.transpose()).cwiseAbs().maxCoeff() > 1e-6 * C.cwiseAbs().maxCoeff()) return false;
  const Eigen::Matrix<double, 9, 1> scale =
      C.diagonal().unaryExpr([](double v) { return v > 0.0 ? 1.0 / std::sqrt(v) : 0.0; });
  const LensCovariance alike = scale.asDiagonal() * C * scale.asDiagonal();
  constexpr double kRounding = 1e-6;
  return Eigen::SelfAdjointEigenSolver<LensCovariance>(alike, Eigen::EigenvaluesOnly).eigenvalues()[0] > -kRounding;
}

}  // namespace

CameraModel changed_lens(const CameraModel& lens, const Eigen::Matrix<double, 9, 1>& change) noexcept {
  CameraModel changed = lens;
  changed.fx += change[0], changed.fy += change[1], changed.cx += change[2], changed.cy += change[3];
  changed.k1 += change[4], changed.k2 += change[5];
  if (lens.lens == Lens::kKannalaBrandt) {
    changed.k3 += change[6], changed.k4 += change[7];
  } else {
    changed.p1 += change[6], changed.p2 += change[7], changed.k3 += change[8];
  }
  return changed;
}

std::string format_lens_covariance(const LensCovariance& covariance) {
  std::vector<double> values(covariance.data(), covariance.data() + covariance.size());  // symmetric
  return fmt::format("{}: !!opencv-matrix\n   rows: 9\n   cols: 9\n   dt: d\n   data: [ {} ]\n", kKey,
                     fmt::join(values, ", "));
}

std::optional<LensCovariance> parse_lens_covariance(std::string_view text) {
  if (text.size() > kLargestFile) return std::nullopt;
  // yaml-cpp reports what it cannot read by exceptions.
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap()) return std::nullopt;
    const YAML::Node matrix = root[kKey];
    if (!matrix.IsDefined() || !matrix.IsMap()) return std::nullopt;
    const YAML::Node data = matrix["data"];
    if (!data.IsDefined() || !data.IsSequence() || data.size() != kNumbers) return std::nullopt;
    LensCovariance covariance;
    for (std::size_t i = 0; i < kNumbers; ++i) covariance.data()[i] = data[i].as<double>();
    if (!is_covariance(covariance)) return std::nullopt;
    return covariance;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

std::optional<LensCovariance> read_lens_covariance(const std::filesystem::path& file) {
  const auto text = read_text_file(file, kLargestFile, "calibration file");
  return text ? parse_lens_covariance(*text) : std::nullopt;
}

}  // namespace perimap

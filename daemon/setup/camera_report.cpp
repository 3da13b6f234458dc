#include "daemon/setup/camera_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "drivers/calibration/calibration_file.hpp"

namespace perimap {
namespace {

std::size_t used_of(const CameraCalibration& result) {
  return static_cast<std::size_t>(
      std::count_if(result.views.begin(), result.views.end(), [](const ViewResult& view) { return view.used; }));
}

std::vector<double> distortion_of(const CameraModel& c) {
  if (c.lens == Lens::kKannalaBrandt) return {c.k1, c.k2, c.k3, c.k4};
  return {c.k1, c.k2, c.p1, c.p2, c.k3};
}

std::vector<double> distortion_deviations_of(const CameraCalibration& result) {
  const std::size_t count = distortion_of(result.camera).size();
  return {result.deviations.begin() + 4, result.deviations.begin() + 4 + static_cast<std::ptrdiff_t>(count)};
}

// Of the RMS of so many residuals, widened as the lens's deviations are.
double rms_deviation(const CameraCalibration& result) {
  const double coordinates = 2.0 * static_cast<double>(std::max<std::size_t>(1, result.points));
  return result.rms_px * std::sqrt(result.variance_factor / (2.0 * coordinates));
}

// The first few, and how many more there are.
std::string some_of(const char* what, const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i) text += fmt::format("  {}: {}\n", what, names[i]);
  if (names.size() > kMost) text += fmt::format("  {}: {} more\n", what, names.size() - kMost);
  return text;
}

}  // namespace

std::string text_of(const CameraCalibration& result, const Board& board, const std::vector<std::string>& without) {
  const CameraModel& c = result.camera;
  const std::vector<double>& s = result.deviations;
  std::string text =
      fmt::format("Lens of {}x{} pictures, by {} views of a {}\n", c.width, c.height, used_of(result), name_of(board));
  text += fmt::format("  focal length     {:.2f} {:.2f} px, deviations {:.2f} {:.2f}\n", c.fx, c.fy, s[0], s[1]);
  // 95 % of a normal axis lie within 1.96 deviations.
  constexpr double kWantedFocal = 0.003 / 1.96;
  const double focal = std::max(s[0] / c.fx, s[1] / c.fy);
  if (focal > kWantedFocal) {
    text += fmt::format(
        "                   within {:.2f} % (95 %): tilt the board by 30 degrees and more to all sides, fill the "
        "picture, and take some {:.0f} views more to make it 0.3 %\n",
        196.0 * focal, std::ceil((std::pow(focal / kWantedFocal, 2.0) - 1.0) * static_cast<double>(used_of(result))));
  }
  text += fmt::format("  principal point  {:.2f} {:.2f} px, deviations {:.2f} {:.2f}\n", c.cx, c.cy, s[2], s[3]);
  // 95 % of two normal axes lie within 2.45 deviations.
  constexpr double kWanted_px = 2.0 / 2.45;
  const double centre_px = std::sqrt(0.5 * (s[2] * s[2] + s[3] * s[3]));
  if (centre_px > kWanted_px) {
    const double ratio = centre_px / kWanted_px;
    text += fmt::format(
        "                   within {:.1f} px (95 %): some {:.0f} views more of this kind, tilted and turned, would "
        "make it "
        "2 px\n",
        2.45 * centre_px, std::ceil((ratio * ratio - 1.0) * static_cast<double>(used_of(result))));
  }
  text += fmt::format("  distortion       {} {:.5f}, deviations {:.5f}\n",
                      c.lens == Lens::kKannalaBrandt ? "k1 k2 k3 k4" : "k1 k2 p1 p2 k3",
                      fmt::join(distortion_of(c), " "), fmt::join(distortion_deviations_of(result), " "));
  text += fmt::format("  reprojection     {:.3f} px RMS of {} points; {} more left out, {:.3f} px with them\n",
                      result.rms_px, result.points, result.points_left_out, result.rms_all_px);
  text += fmt::format("  held aside       each fifth of the views by the others: {:.3f} px RMS\n",
                      result.held_aside_rms_px);
  if (result.variance_factor > 1.0) {
    text +=
        fmt::format("  deviations are {:.1f} times those of independent residuals, for those of a view go together\n",
                    std::sqrt(result.variance_factor));
  }
  text += "  points in each ninth of the picture:\n";
  for (std::size_t row = 0; row < 3; ++row) {
    text += fmt::format("    {:>6} {:>6} {:>6}\n", result.coverage[3 * row], result.coverage[3 * row + 1],
                        result.coverage[3 * row + 2]);
  }
  if (std::any_of(result.coverage.begin(), result.coverage.end(), [](int n) { return n == 0; })) {
    text += "  where there are none the distortion is only guessed: show the board there too\n";
  }
  std::vector<std::string> unfitted;
  for (const ViewResult& view : result.views) {
    if (!view.used) unfitted.push_back(view.name);
  }
  return text + some_of("not fitted", unfitted) + some_of("no board", without);
}

nlohmann::json json_of(const CameraCalibration& result, const Board& board, const std::vector<std::string>& without) {
  const CameraModel& c = result.camera;
  const std::vector<double>& s = result.deviations;
  nlohmann::json covariance = nlohmann::json::array();
  for (Eigen::Index i = 0; i < 4; ++i) {
    covariance.push_back(
        {result.covariance(i, 0), result.covariance(i, 1), result.covariance(i, 2), result.covariance(i, 3)});
  }
  nlohmann::json views = nlohmann::json::array();
  for (const ViewResult& view : result.views) {
    views.push_back({{"name", view.name}, {"used", view.used}, {"rms_px", view.rms_px}});
  }
  return {{"rms_px", result.rms_px},
          {"rms_px_deviation", rms_deviation(result)},
          {"rms_all_px", result.rms_all_px},
          {"focal_px", {c.fx, c.fy}},
          {"focal_px_deviation", {s[0], s[1]}},
          {"principal_point_px", {c.cx, c.cy}},
          {"principal_point_px_deviation", {s[2], s[3]}},
          {"views", used_of(result)},
          {"views_deviation", 0},
          {"distortion_model", c.lens == Lens::kKannalaBrandt ? "equidistant" : "plumb_bob"},
          {"distortion_coefficients", distortion_of(c)},
          {"distortion_coefficients_deviation", distortion_deviations_of(result)},
          {"covariance", covariance},
          {"covariance_order", "fx, fy, cx, cy (px)"},
          {"held_aside_rms_px", result.held_aside_rms_px},
          {"variance_factor", result.variance_factor},
          {"image_width", c.width},
          {"image_height", c.height},
          {"points", result.points},
          {"points_left_out", result.points_left_out},
          {"coverage", result.coverage},
          {"board", name_of(board)},
          {"pictures", views},
          {"pictures_without_board", without}};
}

std::string calibration_text_of(const CameraCalibration& result, const Board& board, const std::string& date) {
  const std::vector<double>& s = result.deviations;
  return sealed_calibration(
      result.camera,
      fmt::format(
          "calibration_time: \"{}\"\nnr_of_frames: {}\navg_reprojection_error: {}\nheld_aside_reprojection_error: "
          "{}\n"
          "focal_length_deviation: [ {}, {} ]\nprincipal_point_deviation: [ {}, {} ]\nboard: \"{}\"\n",
          date, used_of(result), result.rms_px, result.held_aside_rms_px, s[0], s[1], s[2], s[3], name_of(board)) +
          format_lens_covariance(result.covariance));
}

}  // namespace perimap

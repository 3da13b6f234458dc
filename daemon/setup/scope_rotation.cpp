#include "daemon/setup/scope_rotation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <string_view>

#include "core/angle/angle.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/turned_scope_file.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

bool read_numbers(const nlohmann::json& json, const char* key, double* values, std::size_t count) {
  if (!json.contains(key) || !json[key].is_array() || json[key].size() != count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    if (!json[key][i].is_number()) return false;
    values[i] = json[key][i].get<double>();
  }
  return true;
}

// The upper left part of rows of numbers, as `perimap calibrate hand-eye` writes them; zeros where there are none.
template <int kColumns>
Eigen::Matrix<double, 6, kColumns> rows_in(const nlohmann::json& json, const char* key) {
  using Rows = Eigen::Matrix<double, 6, kColumns>;
  Rows rows = Rows::Zero();
  if (!json.contains(key) || !json[key].is_array() || json[key].size() < 6) return rows;
  for (std::size_t i = 0; i < 6; ++i) {
    const nlohmann::json& row = json[key][i];
    for (std::size_t k = 0; k < kColumns; ++k) {
      if (!row.is_array() || row.size() < kColumns || !row[k].is_number()) return Rows::Zero();
      rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = row[k].get<double>();
    }
  }
  return rows.allFinite() ? rows : Rows(Rows::Zero());
}

// As `perimap calibrate camera` writes it; zeros where there is none.
Vector2d principal_deviation_in(const std::string& text) {
  constexpr std::string_view kKey = "principal_point_deviation: [";
  const auto at = text.find(kKey);
  if (at == std::string::npos) return Vector2d::Zero();
  Vector2d deviation;
  char* end = nullptr;
  deviation.x() = std::strtod(text.c_str() + at + kKey.size(), &end);
  while (*end == ' ' || *end == ',') ++end;
  deviation.y() = std::strtod(end, &end);
  const bool good = deviation.allFinite() && deviation.minCoeff() >= 0.0 && deviation.maxCoeff() < 1e4;
  return good ? deviation : Vector2d(Vector2d::Zero());
}

}  // namespace

Expected<ScopeRotation> rotation_of(std::vector<ReadPicture> pictures, std::vector<std::string> without) {
  if (pictures.empty()) return fail(without.empty() ? "there are no pictures" : without.front());
  ScopeRotation result;
  Vector2d sum = Vector2d::Zero();
  double variance = 0.0;
  const auto n = static_cast<double>(pictures.size());
  for (const ReadPicture& picture : pictures) {
    const FieldStopReading& reading = picture.reading;
    sum += Vector2d(std::cos(reading.notch_rad), std::sin(reading.notch_rad));
    result.radius_px += reading.radius_px / n;
    result.centre_px += reading.centre_px / n;
    variance += reading.notch_deviation_rad * reading.notch_deviation_rad / n;
  }
  result.rotation_rad = std::atan2(sum.y(), sum.x());
  double squares = 0.0;
  for (const ReadPicture& picture : pictures) {
    const double apart = std::remainder(picture.reading.notch_rad - result.rotation_rad, 2.0 * std::numbers::pi);
    squares += apart * apart / n;
  }
  result.spread_rad = std::sqrt(squares);
  // Pictures of one view have errors in common: the mean is told no better than a third of one picture.
  result.rotation_deviation_rad = std::sqrt(variance) / std::min(3.0, std::sqrt(n));
  result.pictures = std::move(pictures);
  result.without = std::move(without);
  return result;
}

void NotchReadings::add(const std::string& name, double t_s, const GreyImage& grey) {
  width_ = grey.width;
  height_ = grey.height;
  const auto reading = read_field_stop(grey);
  if (reading) {
    pictures_.push_back({name, t_s, *reading});
  } else {
    without_.push_back(name + ": " + reading.error().message);
  }
}

Expected<ScopeRotation> NotchReadings::rotation() && {
  auto rotation = rotation_of(std::move(pictures_), std::move(without_));
  if (rotation) rotation->width = width_, rotation->height = height_;
  return rotation;
}

Expected<ScopeRotation> rotation_in_recording(const std::string& recording) {
  constexpr double kFrames_per_s = 2.0;
  NotchReadings readings;
  const auto read = for_each_recorded_frame(recording, kFrames_per_s, [&](double t_s, const GreyImage& grey) {
    readings.add(fmt::format("frame at {:.3f} s", t_s), t_s, grey);
  });
  if (!read) return tl::unexpected(read.error());
  auto rotation = std::move(readings).rotation();
  if (!rotation) return fail(recording + ": " + rotation.error().message);
  return rotation;
}

Expected<SetupAtRotation> read_setup(const std::filesystem::path& hand_eye, const std::filesystem::path& camera) {
  constexpr std::size_t kLargest = std::size_t{4} * 1024 * 1024;
  const auto text = read_text_file(hand_eye, kLargest, "hand-eye calibration");
  if (!text) return tl::unexpected(text.error());
  const nlohmann::json json = nlohmann::json::parse(*text, nullptr, false);
  double t[3];
  double q[4];
  if (!json.is_object() || !read_numbers(json, "translation_mm", t, 3) || !read_numbers(json, "rotation_wxyz", q, 4)) {
    return fail(hand_eye.string() +
                ": has no 'translation_mm' and 'rotation_wxyz'; expected a file that perimap calibrate hand-eye "
                "--output wrote");
  }
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(norm - 1.0) < 1e-3)) return fail(hand_eye.string() + ": 'rotation_wxyz' is no unit quaternion");
  constexpr double kFarthest_mm = 10'000.0;
  if (Vector3d(t[0], t[1], t[2]).norm() > kFarthest_mm) {
    return fail(hand_eye.string() + ": 'translation_mm' is farther than 10 m");
  }
  const auto lens = read_calibration(camera);
  if (!lens) return tl::unexpected(lens.error());
  const auto lens_text = read_text_file(camera, kLargest, "calibration");
  if (!lens_text) return tl::unexpected(lens_text.error());
  SetupAtRotation setup;
  setup.X_SC = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), q);
  setup.principal_px = {lens->cx, lens->cy};
  setup.focal_px = {lens->fx, lens->fy};
  setup.covariance_C = rows_in<6>(json, "covariance");
  setup.covariance_with_principal = rows_in<2>(json, "covariance_with_principal_point");
  setup.principal_deviation_px = principal_deviation_in(*lens_text);
  return setup;
}

std::string text_of(const ScopeRotation& rotation) {
  std::string text = fmt::format("Scope's rotation in its camera head by {} pictures\n", rotation.pictures.size());
  text += fmt::format("  notch          {:.2f} degrees, deviation {:.2f}: from the right towards below\n",
                      rotation.rotation_rad / kDegree, rotation.rotation_deviation_rad / kDegree);
  text += fmt::format("  pictures       {:.2f} degrees RMS about it\n", rotation.spread_rad / kDegree);
  text += fmt::format("  field stop     radius {:.1f} px about ({:.1f}, {:.1f}) px\n", rotation.radius_px,
                      rotation.centre_px.x(), rotation.centre_px.y());
  if (rotation.spread_rad > 2.0 * kDegree) {
    text += "  the scope turned between the pictures: the mean says little; see the page or --json for each\n";
  }
  for (const std::string& why : rotation.without) text += "  not read: " + why + "\n";
  return text;
}

nlohmann::json json_of(const ScopeRotation& rotation) {
  nlohmann::json json = {{"rotation_deg", rotation.rotation_rad / kDegree},
                         {"rotation_deg_deviation", rotation.rotation_deviation_rad / kDegree},
                         {"spread_deg", rotation.spread_rad / kDegree},
                         {"field_stop_radius_px", rotation.radius_px},
                         {"field_stop_centre_px", {rotation.centre_px.x(), rotation.centre_px.y()}},
                         {"pictures", nlohmann::json::array()},
                         {"pictures_not_read", rotation.without}};
  for (const ReadPicture& picture : rotation.pictures) {
    json["pictures"].push_back({{"name", picture.name},
                                {"rotation_deg", picture.reading.notch_rad / kDegree},
                                {"rotation_deg_deviation", picture.reading.notch_deviation_rad / kDegree},
                                {"field_stop_radius_px", picture.reading.radius_px},
                                {"seen_share", picture.reading.seen_share}});
  }
  return json;
}

std::string text_of(const TurnedScope& scope) {
  std::string text = fmt::format("Set-up as a function of that rotation: the sensor is on the {}\n",
                                 scope.sensor_on_scope ? "scope" : "camera head");
  if (!scope.sensor_on_scope) {
    text += fmt::format(
        "  shaft          along ({:.4f} {:.4f} {:.4f}) of the sensor, through ({:.2f} {:.2f} {:.2f}) mm\n",
        scope.axis_S.x(), scope.axis_S.y(), scope.axis_S.z(), scope.point_S.x(), scope.point_S.y(), scope.point_S.z());
  }
  text += fmt::format(
      "  deviations     {:.2f} mm and {:.2f} degrees of the hand-eye, {:.2f} px of the principal point, at the turn "
      "where they are largest\n",
      scope.translation_deviation_mm, scope.rotation_deviation_rad / kDegree, scope.principal_deviation_px);
  if (scope.target_deviation_mm > 0.0) {
    text += fmt::format("                 {:.2f} mm of a target {:.0f} mm ahead, by both together\n",
                        scope.target_deviation_mm, TurnedScope::kTargetAhead_mm);
  }
  if (!scope.sensor_on_scope) {
    text += fmt::format("                 {:.2f} degrees of the shaft's direction, {:.2f} mm of its place\n",
                        scope.axis_deviation_rad / kDegree, scope.point_deviation_mm);
  }
  for (const FocalAtRadius& row : scope.focals) {
    text += fmt::format("  focal length   {:.2f} {:.2f} px where the field stop's radius is {:.1f} px\n",
                        row.focal_px.x(), row.focal_px.y(), row.radius_px);
  }
  if (scope.second_sensor) {
    text += fmt::format("  second sensor  turns about one axis but for {:.2f} degrees RMS; zoom must stay as it was\n",
                        scope.second_sensor->left_over_rad / kDegree);
  }
  if (scope.aside_translation_rms_mm > 0.0) {
    text += fmt::format("  held aside     {:.2f} mm and {:.2f} degrees RMS of each set-up by the others' function\n",
                        scope.aside_translation_rms_mm, scope.aside_rotation_rms_deg);
  }
  if (scope.translation_rms_mm > 0.0) {
    text += fmt::format("  left over      {:.2f} mm and {:.2f} degrees RMS of the set-ups\n", scope.translation_rms_mm,
                        scope.rotation_rms_deg);
  } else {
    text += "  left over      not known from two set-ups: a third one at another turn would tell\n";
  }
  return text;
}

nlohmann::json json_of(const TurnedScope& scope) {
  return nlohmann::json::parse(format_turned_scope(scope)).at("turned_scope");
}

std::vector<Plot> plots_of(const ScopeRotation& rotation) {
  Plot plot;
  plot.title = "Rotation of the scope by each picture";
  plot.x_label = "picture";
  plot.y_label = "degrees";
  PlotLine line;
  line.width_px = 2.0;
  constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < rotation.pictures.size(); ++i) {
    const FieldStopReading& reading = rotation.pictures[i].reading;
    const double x = static_cast<double>(i + 1);
    const double mean = rotation.rotation_rad / kDegree;
    const double y = mean + std::remainder(reading.notch_rad - rotation.rotation_rad, 2.0 * std::numbers::pi) / kDegree;
    const double e = reading.notch_deviation_rad / kDegree;
    line.points.insert(line.points.end(), {{x, y - e}, {x, y + e}, {kNoPoint, kNoPoint}});
  }
  line.label = "each, plus and minus its deviation";
  plot.lines = {line};
  return {plot};
}

std::vector<Plot> plots_of(const TurnedScope& scope, const std::vector<SetupAtRotation>& setups) {
  constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
  const auto plot_of = [&](const char* title, const char* unit, auto left_over) {
    Plot plot;
    plot.title = title;
    plot.x_label = "turn of the scope, degrees";
    plot.y_label = unit;
    PlotLine line;
    line.width_px = 2.0;
    for (const SetupAtRotation& setup : setups) {
      const double x = setup.rotation_rad / kDegree;
      const double y = left_over(setup, scope.at(setup.rotation_rad));
      line.points.insert(line.points.end(), {{x, 0.0}, {x, y}, {kNoPoint, kNoPoint}});
    }
    line.label = "each set-up";
    plot.lines = {line};
    return plot;
  };
  return {plot_of("Hand-eye translation of each set-up, off the function", "mm",
                  [](const SetupAtRotation& is, const SetupAtRotation& expected) {
                    return (expected.X_SC.inverse() * is.X_SC).t.norm();
                  }),
          plot_of("Principal point of each set-up, off the function", "px",
                  [](const SetupAtRotation& is, const SetupAtRotation& expected) {
                    return (is.principal_px - expected.principal_px).norm();
                  })};
}

}  // namespace perimap

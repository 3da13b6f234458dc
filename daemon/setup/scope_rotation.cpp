#include "daemon/setup/scope_rotation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/angle/angle.hpp"
#include "drivers/calibration/calibration_file.hpp"
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
  const auto lens = read_calibration(camera);
  if (!lens) return tl::unexpected(lens.error());
  return SetupAtRotation{0.0, pose_from_wxyz(Vector3d(t[0], t[1], t[2]), q), {lens->cx, lens->cy}};
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
  if (scope.translation_rms_mm > 0.0) {
    text += fmt::format("  left over      {:.2f} mm and {:.2f} degrees RMS of the set-ups\n", scope.translation_rms_mm,
                        scope.rotation_rms_deg);
  } else {
    text += "  left over      not known from two set-ups: a third one at another turn would tell\n";
  }
  return text;
}

nlohmann::json json_of(const TurnedScope& scope) {
  const auto three = [](const Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  double q[4];
  rotation_to_wxyz(scope.reference.X_SC.R, q);
  return {{"reference_rotation_deg", scope.reference.rotation_rad / kDegree},
          {"reference_translation_mm", three(scope.reference.X_SC.t)},
          {"reference_rotation_wxyz", {q[0], q[1], q[2], q[3]}},
          {"reference_principal_point_px", {scope.reference.principal_px.x(), scope.reference.principal_px.y()}},
          {"sensor_on_scope", scope.sensor_on_scope},
          {"axis", three(scope.axis_S)},
          {"axis_point_mm", three(scope.point_S)},
          {"turn_centre_px", {scope.turn_px.x(), scope.turn_px.y()}},
          {"left_over_mm", scope.translation_rms_mm},
          {"left_over_deg", scope.rotation_rms_deg}};
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

}  // namespace perimap

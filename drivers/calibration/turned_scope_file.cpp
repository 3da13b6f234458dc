#include "drivers/calibration/turned_scope_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/angle/angle.hpp"
#include "drivers/json/json_seal.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

// The numbers of one object, each within bounds; the first key that is wrong is remembered.
class Numbers {
 public:
  Numbers(const nlohmann::json& object, const char* path) : object_(object), path_(path) {}

  void list(const char* key, std::span<double> values, double largest) {
    const auto found = object_.find(key);
    bool good = found != object_.end() && found->is_array() && found->size() == values.size();
    for (std::size_t i = 0; good && i < values.size(); ++i) {
      good = (*found)[i].is_number();
      if (!good) break;
      values[i] = (*found)[i].get<double>();
      good = std::abs(values[i]) <= largest;  // not of what is no number
    }
    if (!good) refuse(key, fmt::format("{} numbers of at most {:g}", values.size(), largest));
  }
  void number(const char* key, double& value, double largest) {
    const auto found = object_.find(key);
    const bool good = found != object_.end() && found->is_number() && std::abs(found->get<double>()) <= largest;
    if (good) value = found->get<double>();
    if (!good) refuse(key, fmt::format("a number of at most {:g}", largest));
  }
  void flag(const char* key, bool& value) {
    const auto found = object_.find(key);
    const bool good = found != object_.end() && found->is_boolean();
    if (good) value = found->get<bool>();
    if (!good) refuse(key, "true or false");
  }
  // Rows of a radius and two focal lengths, the radii rising.
  void table(const char* key, std::vector<FocalAtRadius>& rows) {
    constexpr std::size_t kMostRows = 100;
    constexpr double kLargest_px = 100'000.0;
    const auto found = object_.find(key);
    bool good = found != object_.end() && found->is_array() && found->size() <= kMostRows;
    double before_px = 0.0;
    for (std::size_t i = 0; good && i < found->size(); ++i) {
      const nlohmann::json& row = (*found)[i];
      double values[3]{};
      good = row.is_array() && row.size() == 3;
      for (std::size_t k = 0; good && k < 3; ++k) {
        good = row[k].is_number();
        if (good) values[k] = row[k].get<double>();
        good = good && values[k] > 0.0 && values[k] <= kLargest_px;  // not of what is no number
      }
      good = good && values[0] > before_px;
      before_px = values[0];
      if (good) rows.push_back({values[0], {values[1], values[2]}});
    }
    if (!good) refuse(key, "rows of a radius and two focal lengths, px, the radii rising");
  }
  void refuse(const char* key, const std::string& expected) {
    if (!wrong_) wrong_ = fmt::format("key '{}{}': expected {}", path_, key, expected);
  }
  [[nodiscard]] const std::optional<std::string>& wrong() const { return wrong_; }

 private:
  const nlohmann::json& object_;
  const char* path_;  // of the object, before its keys
  std::optional<std::string> wrong_;
};

double norm_of(std::initializer_list<double> values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares);
}

constexpr double kUnit = 1e-3;  // so far may the norm be from 1

// Returns what is wrong.
std::optional<std::string> read_second_sensor(const nlohmann::json& object, SecondSensor& second) {
  Numbers numbers(object, "turned_scope.second_sensor.");
  double q[4]{};
  double axis[3]{};
  double left_over_deg = 0.0;
  numbers.list("reference_rotation_wxyz", q, 1.001);
  numbers.list("axis", axis, 1.001);
  numbers.number("left_over_deg", left_over_deg, 180.0);
  if (std::abs(norm_of({q[0], q[1], q[2], q[3]}) - 1.0) > kUnit) {
    numbers.refuse("reference_rotation_wxyz", "a unit quaternion");
  }
  if (std::abs(norm_of({axis[0], axis[1], axis[2]}) - 1.0) > kUnit) numbers.refuse("axis", "a unit vector");
  if (numbers.wrong()) return numbers.wrong();
  second.reference_S2 = pose_from_wxyz(Vector3d::Zero(), q).R;
  second.axis_S = Vector3d(axis[0], axis[1], axis[2]).normalized();
  second.left_over_rad = left_over_deg * kDegree;
  return std::nullopt;
}

}  // namespace

Expected<TurnedScope> read_turned_scope(const std::filesystem::path& file) {
  constexpr std::size_t kLargest = std::size_t{1024} * 1024;
  const auto text = read_text_file(file, kLargest, "turned scope");
  if (!text) return tl::unexpected(text.error());
  return parse_turned_scope(*text, file.string());
}

Expected<TurnedScope> parse_turned_scope(std::string_view text, std::string_view name) {
  const auto wrong = [&](const std::string& what) {
    return fail(fmt::format("{}: {}; expected a file that perimap calibrate scope --at --output wrote", name, what));
  };
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return wrong("is no JSON object");
  if (const auto whole = check_json_seal(json); !whole) return wrong(whole.error().message);
  const auto found = json.find("turned_scope");
  if (found == json.end() || !found->is_object()) return wrong("has no key 'turned_scope'");
  constexpr double kFarthest_mm = 10'000.0;
  constexpr double kFarthest_px = 100'000.0;
  Numbers numbers(*found, "turned_scope.");
  double rotation_deg = 0.0;
  double t[3]{};
  double q[4]{};
  double principal[2]{};
  double axis[3]{};
  double point[3]{};
  double centre[2]{};
  double size[2]{};
  double focal[2]{};
  TurnedScope scope;
  numbers.number("reference_rotation_deg", rotation_deg, 360.0);
  numbers.list("reference_translation_mm", t, kFarthest_mm);
  numbers.list("reference_rotation_wxyz", q, 1.001);
  numbers.list("reference_principal_point_px", principal, kFarthest_px);
  numbers.flag("sensor_on_scope", scope.sensor_on_scope);
  numbers.list("axis", axis, 1.001);
  numbers.list("axis_point_mm", point, kFarthest_mm);
  numbers.list("turn_centre_px", centre, kFarthest_px);
  numbers.list("picture_px", size, 16384.0);
  numbers.list("reference_focal_px", focal, kFarthest_px);
  numbers.table("focal_px_by_field_stop_radius_px", scope.focals);
  if (std::abs(norm_of({q[0], q[1], q[2], q[3]}) - 1.0) > kUnit) {
    numbers.refuse("reference_rotation_wxyz", "a unit quaternion");
  }
  if (std::abs(norm_of({axis[0], axis[1], axis[2]}) - 1.0) > kUnit) numbers.refuse("axis", "a unit vector");
  if (size[0] < 1.0 || size[1] < 1.0) numbers.refuse("picture_px", "the pictures' width and height");
  if (!(focal[0] > 0.0 && focal[1] > 0.0)) numbers.refuse("reference_focal_px", "focal lengths above 0");
  // None: the field stop tells the turn.
  if (const auto second = found->find("second_sensor"); second != found->end() && !second->is_null()) {
    if (!second->is_object()) numbers.refuse("second_sensor", "an object, or null");
    const auto bad = second->is_object() ? read_second_sensor(*second, scope.second_sensor.emplace()) : std::nullopt;
    if (bad && !numbers.wrong()) return wrong(*bad);
    if (!scope.focals.empty()) numbers.refuse("focal_px_by_field_stop_radius_px", "no rows beside 'second_sensor'");
  }
  if (numbers.wrong()) return wrong(*numbers.wrong());
  scope.reference.focal_px = {focal[0], focal[1]};
  scope.reference.rotation_rad = rotation_deg * kDegree;
  scope.reference.X_SC = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), q);
  scope.reference.principal_px = {principal[0], principal[1]};
  scope.axis_S = Vector3d(axis[0], axis[1], axis[2]).normalized();
  scope.point_S = {point[0], point[1], point[2]};
  scope.turn_px = {centre[0], centre[1]};
  scope.width = static_cast<int>(size[0]);
  scope.height = static_cast<int>(size[1]);
  return scope;
}

std::string format_turned_scope(const TurnedScope& scope) {
  const auto three = [](const Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  const auto two = [](const Vector2d& v) { return nlohmann::json{v.x(), v.y()}; };
  double q[4];
  rotation_to_wxyz(scope.reference.X_SC.R, q);
  nlohmann::json table = nlohmann::json::array();
  for (const FocalAtRadius& row : scope.focals) table.push_back({row.radius_px, row.focal_px.x(), row.focal_px.y()});
  nlohmann::json second;
  if (scope.second_sensor) {
    double q_S2[4];
    rotation_to_wxyz(scope.second_sensor->reference_S2, q_S2);
    second = {{"reference_rotation_wxyz", {q_S2[0], q_S2[1], q_S2[2], q_S2[3]}},
              {"axis", three(scope.second_sensor->axis_S)},
              {"left_over_deg", scope.second_sensor->left_over_rad / kDegree}};
  }
  const nlohmann::json json = {{"reference_rotation_deg", scope.reference.rotation_rad / kDegree},
                               {"reference_translation_mm", three(scope.reference.X_SC.t)},
                               {"reference_rotation_wxyz", {q[0], q[1], q[2], q[3]}},
                               {"reference_principal_point_px", two(scope.reference.principal_px)},
                               {"reference_focal_px", two(scope.reference.focal_px)},
                               {"focal_px_by_field_stop_radius_px", table},
                               {"sensor_on_scope", scope.sensor_on_scope},
                               {"axis", three(scope.axis_S)},
                               {"axis_deg_deviation", scope.axis_deviation_rad / kDegree},
                               {"axis_point_mm", three(scope.point_S)},
                               {"axis_point_mm_deviation", scope.point_deviation_mm},
                               {"turn_centre_px", two(scope.turn_px)},
                               {"picture_px", {scope.width, scope.height}},
                               {"rotation_deg_deviation", scope.rotation_deviation_rad / kDegree},
                               {"translation_mm_deviation", scope.translation_deviation_mm},
                               {"principal_point_px_deviation", scope.principal_deviation_px},
                               {"target_mm_deviation", scope.target_deviation_mm},
                               {"left_over_mm", scope.translation_rms_mm},
                               {"left_over_deg", scope.rotation_rms_deg},
                               {"aside_mm", scope.aside_translation_rms_mm},
                               {"aside_deg", scope.aside_rotation_rms_deg},
                               {"second_sensor", second}};
  return json_document(nlohmann::json{{"turned_scope", json}});
}

}  // namespace perimap

// drivers/calibration/turned_scope_file: written and read back, and what is garbled.
#include "drivers/calibration/turned_scope_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace perimap {
namespace {

using testing::HasSubstr;

TurnedScope made() {
  TurnedScope scope;
  scope.reference.rotation_rad = 0.7;
  scope.reference.X_SC = {so3_exp({0.1, -0.4, 1.2}), {3.0, -4.0, 60.0}};
  scope.reference.principal_px = {330.0, 236.0};
  scope.axis_S = Vector3d(0.1, 0.2, 0.9).normalized();
  scope.point_S = {1.0, 2.0, -3.0};
  scope.turn_px = {321.0, 239.0};
  scope.reference.focal_px = {600.0, 601.0};
  scope.focals = {{200.0, {600.0, 601.0}}, {230.0, {690.0, 691.5}}};
  scope.width = 640;
  scope.height = 480;
  return scope;
}

TEST(TurnedScopeFile, IsReadBackAsItWasWritten) {
  const auto read = parse_turned_scope(format_turned_scope(made()), "scope.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->width, 640);
  EXPECT_FALSE(read->sensor_on_scope);
  for (const double turn : {-2.0, 0.0, 1.5}) {
    const SetupAtRotation before = made().at(turn);
    const SetupAtRotation after = read->at(turn);
    EXPECT_LT((before.X_SC.t - after.X_SC.t).norm(), 1e-9);
    EXPECT_LT((before.X_SC.R - after.X_SC.R).norm(), 1e-9);
    EXPECT_LT((before.principal_px - after.principal_px).norm(), 1e-9);
    EXPECT_LT((made().lens_at(turn, 214.0)->focal_px - read->lens_at(turn, 214.0)->focal_px).norm(), 1e-9);
  }
}

TurnedScope sensed() {
  TurnedScope scope = made();
  scope.focals.clear();
  scope.second_sensor = SecondSensor{so3_exp({0.4, 0.2, -0.9}), Vector3d(0.3, -0.2, 0.9).normalized(), 0.002};
  return scope;
}

TEST(TurnedScopeFile, ASecondSensorIsReadBack) {
  const auto read = parse_turned_scope(format_turned_scope(sensed()), "scope.json");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(read->second_sensor);
  const Matrix3d R_S2 = so3_exp(1.2 * sensed().second_sensor->axis_S) * sensed().second_sensor->reference_S2;
  EXPECT_NEAR(read->second_sensor->rotation_rad(R_S2), 1.2, 1e-9);
  EXPECT_FALSE(parse_turned_scope(format_turned_scope(made()), "scope.json")->second_sensor);
}

TEST(TurnedScopeFile, GarbledSecondSensorsAreRefusedByFileAndKey) {
  const nlohmann::json good = nlohmann::json::parse(format_turned_scope(sensed()));
  struct Garbled {
    const char* key;
    const char* value;
  };
  for (const Garbled& garbled : {Garbled{"reference_rotation_wxyz", "[1, 0, 0]"},
                                 {"reference_rotation_wxyz", "[0.5, 0, 0, 0]"},
                                 {"reference_rotation_wxyz", "[\"1\", 0, 0, 0]"},
                                 {"axis", "[0, 0, 0]"},
                                 {"axis", "[1e300, 0, 0]"},
                                 {"axis", "null"},
                                 {"left_over_deg", "\"0\""}}) {
    nlohmann::json text = good;
    text["turned_scope"]["second_sensor"][garbled.key] = nlohmann::json::parse(garbled.value);
    const auto read = parse_turned_scope(text.dump(), "scope.json");
    ASSERT_FALSE(read) << garbled.key << " " << garbled.value;
    EXPECT_THAT(read.error().message,
                HasSubstr(std::string("scope.json: key 'turned_scope.second_sensor.") + garbled.key + "'"));
  }
  for (const char* value : {"3", "[]", "true", "\"second\""}) {
    nlohmann::json text = good;
    text["turned_scope"]["second_sensor"] = nlohmann::json::parse(value);
    EXPECT_THAT(parse_turned_scope(text.dump(), "scope.json").error().message, HasSubstr("second_sensor")) << value;
  }
  nlohmann::json text = nlohmann::json::parse(format_turned_scope(made()));
  text["turned_scope"]["second_sensor"] = good["turned_scope"]["second_sensor"];
  EXPECT_THAT(parse_turned_scope(text.dump(), "scope.json").error().message, HasSubstr("no rows beside"))
      << "zoom is read where the field stop is";
}

TEST(TurnedScopeFile, GarbledOnesAreRefusedByFileAndKey) {
  const std::string good = format_turned_scope(made());
  struct Garbled {
    const char* key;
    const char* value;
  };
  for (const Garbled& garbled : {Garbled{"reference_rotation_deg", "\"40\""},
                                 {"reference_translation_mm", "[1, 2]"},
                                 {"reference_translation_mm", "[1, 2, 1e9]"},
                                 {"reference_rotation_wxyz", "[0.5, 0, 0, 0]"},
                                 {"reference_principal_point_px", "[1e300, 0]"},
                                 {"sensor_on_scope", "0"},
                                 {"axis", "[0, 0, 0]"},
                                 {"axis_point_mm", "null"},
                                 {"turn_centre_px", "{}"},
                                 {"picture_px", "[0, 480]"},
                                 {"reference_focal_px", "[600.0, -1]"},
                                 {"focal_px_by_field_stop_radius_px", "7"}}) {
    std::string text = good;
    const auto at = text.find(std::string("\"") + garbled.key + "\": ");
    ASSERT_NE(at, std::string::npos) << garbled.key;
    const auto value = text.find(": ", at) + 2;
    // A list goes over lines, and may hold lists; what follows a value is a comma or the object's end.
    auto end = text.find_first_of(",\n", value);
    if (text[value] == '[') {
      int depth = 0;
      end = value;
      do {
        depth += text[end] == '[' ? 1 : text[end] == ']' ? -1 : 0;
        ++end;
      } while (depth > 0);
    }
    text.replace(value, end - value, garbled.value);
    const auto read = parse_turned_scope(text, "scope.json");
    ASSERT_FALSE(read) << garbled.key << " " << garbled.value;
    EXPECT_THAT(read.error().message, HasSubstr("scope.json: key 'turned_scope."));
    EXPECT_THAT(read.error().message, HasSubstr(garbled.key));
  }
  for (const char* rows : {"[[200, 600]]", "[[200, 600, 0]]", "[[200, 600, 600], [200, 600, 600]]", "[\"a\"]"}) {
    std::string text = good;
    const auto begin = text.find("[", text.find("focal_px_by_field_stop_radius_px"));
    text.replace(begin, text.find("\n    ],\n", begin) + 6 - begin, rows);
    const auto read = parse_turned_scope(text, "scope.json");
    ASSERT_FALSE(read) << rows;
    EXPECT_THAT(read.error().message, HasSubstr("focal_px_by_field_stop_radius_px")) << text;
  }
  for (const char* text : {"", "[]", "{", "{\"turned_scope\": 3}", "{\"tip_mm\": [1, 2, 3]}"}) {
    EXPECT_THAT(parse_turned_scope(text, "scope.json").error().message, HasSubstr("scope.json: ")) << text;
  }
}

}  // namespace
}  // namespace perimap

#include "daemon/bridge/messages/view_layout.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/angle/angle.hpp"
#include "daemon/bridge/messages/view_names.hpp"
#include "daemon/bridge/messages/view_units.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

// Of a panel its name is KIND!NAME.
constexpr const char* kImagePanel = "Image!perimap";
constexpr const char* kScenePanel = "3D!perimap";
constexpr const char* kEcgPanel = "Plot!perimap_ecg";
constexpr const char* kStatePanel = "StateTransitions!perimap";

Json image_panel() {
  return {{"imageMode",
           {{"imageTopic", view_names::kImage},
            {"calibrationTopic", view_names::kCalibration},
            {"synchronize", false},
            {"annotations", {{view_names::kAnnotations, {{"visible", true}}}}}}},
          {"topics", {{view_names::kScene, {{"visible", false}}}}}};
}

// Their angles: phi from the third axis, theta about it from the second axis' negative half, degrees.
Json scene_panel(const std::string& world_frame, const std::optional<ViewAim>& aim) {
  double distance_m = 0.4, phi_deg = 60.0, theta_deg = 45.0;
  Json at = {0, 0, 0};
  if (aim && (aim->from - aim->at).norm() > 0.0) {
    const Vector3d way = aim->from - aim->at;
    const Vector3d towards = way.normalized();
    distance_m = way.norm() * kMetresPerMillimetre;
    phi_deg = std::acos(std::clamp(towards.z(), -1.0, 1.0)) / kDegree;
    theta_deg = -std::atan2(towards.x(), -towards.y()) / kDegree;
    at = {aim->at.x() * kMetresPerMillimetre, aim->at.y() * kMetresPerMillimetre, aim->at.z() * kMetresPerMillimetre};
  }
  return {{"followTf", world_frame},
          {"followMode", "follow-none"},
          {"scene", {{"transforms", {{"axisScale", 0.02}, {"labelSize", 0.003}}}}},
          {"cameraState",
           {{"perspective", true},
            {"distance", distance_m},
            {"phi", phi_deg},
            {"thetaOffset", theta_deg},
            {"targetOffset", at},
            {"target", {0, 0, 0}},
            {"targetOrientation", {0, 0, 0, 1}},
            {"fovy", 45},
            {"near", 0.001},
            {"far", 100}}},
          {"topics", {{view_names::kScene, {{"visible", true}}}, {view_names::kCalibration, {{"visible", false}}}}}};
}

Json plot_panel() {
  const Json path = {{"value", std::string(view_names::kEcg) + ".mV"},
                     {"enabled", true},
                     {"timestampMethod", "receiveTime"},
                     {"label", "ECG, mV"}};
  return {{"paths", Json::array({path})}, {"showXAxisLabels", true}, {"showYAxisLabels", true},
          {"showLegend", true},           {"isSynced", true},        {"xAxisVal", "timestamp"},
          {"followingViewWidth", 5}};
}

Json state_panel() {
  const auto path = [](const char* member) {
    return Json{{"value", std::string(view_names::kWorth) + "." + member},
                {"enabled", true},
                {"timestampMethod", "receiveTime"}};
  };
  return {{"paths", Json::array({path("state"), path("reason")})}, {"isSynced", true}};
}

}  // namespace

std::string view_layout(const std::string& world_frame, const std::optional<ViewAim>& aim) {
  const Json signals = {{"first", kEcgPanel}, {"second", kStatePanel}, {"direction", "row"}, {"splitPercentage", 60}};
  const Json pictures = {
      {"first", kImagePanel}, {"second", kScenePanel}, {"direction", "row"}, {"splitPercentage", 50}};
  const Json layout = {
      {"configById",
       {{kImagePanel, image_panel()},
        {kScenePanel, scene_panel(world_frame, aim)},
        {kEcgPanel, plot_panel()},
        {kStatePanel, state_panel()}}},
      {"globalVariables", Json::object()},
      {"userNodes", Json::object()},
      {"playbackConfig", {{"speed", 1}}},
      {"layout", {{"first", pictures}, {"second", signals}, {"direction", "column"}, {"splitPercentage", 70}}}};
  // A name of a frame may be no UTF-8.
  return json_document(layout);
}

}  // namespace perimap

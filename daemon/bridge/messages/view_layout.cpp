#include "daemon/bridge/messages/view_layout.hpp"

#include <nlohmann/json.hpp>

#include "daemon/bridge/messages/view_names.hpp"
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

Json scene_panel(const std::string& world_frame) {
  return {{"followTf", world_frame},
          {"followMode", "follow-none"},
          {"scene", {{"transforms", {{"axisScale", 0.02}, {"labelSize", 0.01}}}}},
          {"cameraState",
           {{"perspective", true},
            {"distance", 0.4},
            {"phi", 60},
            {"thetaOffset", 45},
            {"targetOffset", {0, 0, 0}},
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

std::string view_layout(const std::string& world_frame) {
  const Json signals = {{"first", kEcgPanel}, {"second", kStatePanel}, {"direction", "row"}, {"splitPercentage", 60}};
  const Json pictures = {
      {"first", kImagePanel}, {"second", kScenePanel}, {"direction", "row"}, {"splitPercentage", 50}};
  const Json layout = {
      {"configById",
       {{kImagePanel, image_panel()},
        {kScenePanel, scene_panel(world_frame)},
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

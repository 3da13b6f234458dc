// How far an angled scope is turned in its camera head, by pictures of its field stop; and the set-up by it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/calibration/field_stop.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "daemon/pages/svg_plot.hpp"

namespace perimap {

struct ReadPicture {
  std::string name;
  double t_s = 0.0;
  FieldStopReading reading;
};

struct ScopeRotation {
  std::vector<ReadPicture> pictures;      // that the notch was read in
  std::vector<std::string> without;       // the others, each with why
  double rotation_rad = 0.0;              // mean of all
  double rotation_deviation_rad = 0.0;    // of that mean, where the scope was held; of one picture, where there is one
  double spread_rad = 0.0;                // RMS of the pictures about it
  double radius_px = 0.0;                 // mean
  Vector2d centre_px = Vector2d::Zero();  // mean
  int width = 0;                          // px, of the pictures
  int height = 0;
};

// Notches as they are read, picture by picture.
class NotchReadings {
 public:
  void add(const std::string& name, double t_s, const GreyImage& grey);
  [[nodiscard]] Expected<ScopeRotation> rotation() &&;

 private:
  std::vector<ReadPicture> pictures_;
  std::vector<std::string> without_;
  int width_ = 0;
  int height_ = 0;
};

// Of two frames a second.
[[nodiscard]] Expected<ScopeRotation> rotation_in_recording(const std::string& recording);

// Fails when the notch was read in none, and says why.
[[nodiscard]] Expected<ScopeRotation> rotation_of(std::vector<ReadPicture> pictures, std::vector<std::string> without);

// The hand-eye transform and the principal point as `perimap calibrate hand-eye --output` and `perimap calibrate camera
// --output` wrote them.
[[nodiscard]] Expected<SetupAtRotation> read_setup(const std::filesystem::path& hand_eye,
                                                   const std::filesystem::path& camera);

[[nodiscard]] std::string text_of(const ScopeRotation& rotation);
[[nodiscard]] nlohmann::json json_of(const ScopeRotation& rotation);
[[nodiscard]] std::string text_of(const TurnedScope& scope);
[[nodiscard]] nlohmann::json json_of(const TurnedScope& scope);
[[nodiscard]] std::vector<Plot> plots_of(const ScopeRotation& rotation);
// What the function leaves over of the set-ups that it was made from, by their turn.
[[nodiscard]] std::vector<Plot> plots_of(const TurnedScope& scope, const std::vector<SetupAtRotation>& setups);

}  // namespace perimap

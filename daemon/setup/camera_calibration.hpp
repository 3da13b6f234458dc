// The lens, from pictures of a board: `perimap calibrate camera`.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/setup/board.hpp"
#include "drivers/calibration/lens_covariance.hpp"

namespace perimap {

struct CameraCalibrationSettings {
  Lens lens = Lens::kBrownConrady;
  // A result that is less certain is refused: beyond it errors are larger than their deviations say.
  double largest_focal_deviation = 0.01;   // of the focal length
  double largest_centre_deviation = 0.02;  // of the picture's width
};

struct ViewResult {
  std::string name;
  bool used = false;  // for the fit; else left out, as too far off, or only judged by
  double rms_px = 0.0;
  Pose X_CB;  // the board in the camera's frame, mm (squares where their size is not known)
};

struct CameraCalibration {
  CameraModel camera;
  // Of fx, fy, cx, cy, then k1 k2 p1 p2 k3, or k1 k2 k3 k4 of a fisheye; what was held fixed has none.
  std::vector<double> deviations;
  LensCovariance covariance = LensCovariance::Zero();
  double rms_px = 0.0;             // reprojection, of the points that were used, both coordinates together
  double rms_all_px = 0.0;         // of all points of the views used, none left out
  double held_aside_rms_px = 0.0;  // of the views of each fifth by a lens that the others tell
  double variance_factor = 1.0;    // by which the deviations were widened, where residuals in a view go together
  std::size_t points = 0;
  std::size_t points_left_out = 0;
  std::vector<ViewResult> views;
  std::array<int, 9> coverage{};                    // points in each ninth of the picture, row by row
  std::vector<std::vector<Vector2d>> residuals_px;  // of each view used
  std::vector<std::vector<Vector2d>> points_px;     // where, likewise
};

// From at least seven views of a board by cv::calibrateCamera (Zhang 2000) or cv::fisheye::calibrate. Points further
// off than chance lets them be are left out, and so are whole views; k3 is held at 0 where it is not told from it.
// Fails, and says which view is missing, when focal length or principal point stay open.
[[nodiscard]] Expected<CameraCalibration> calibrate_camera(const std::vector<BoardView>& views, int width, int height,
                                                           const CameraCalibrationSettings& settings);

}  // namespace perimap

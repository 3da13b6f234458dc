#include "daemon/bridge/messages/view_camera.hpp"

#include <algorithm>
#include <array>

#include "daemon/bridge/messages/lent.hpp"
#include "daemon/bridge/messages/view_names.hpp"
#include "daemon/bridge/messages/view_units.hpp"
#include "drivers/recording/foxglove_image.hpp"

namespace perimap {

foxglove_CameraCalibration borrow_camera_calibration(const CameraModel& lens, Instant time,
                                                     std::vector<double>& coefficients) {
  foxglove_CameraCalibration message{};
  message.timestamp = to_foxglove_time(time);
  message.frame_id = lent(view_names::kCameraFrame);
  message.width = static_cast<std::uint32_t>(lens.width);
  message.height = static_cast<std::uint32_t>(lens.height);
  const bool fisheye = lens.lens == Lens::kKannalaBrandt;
  message.distortion_model = lent(fisheye ? "kannala_brandt" : "plumb_bob");
  coefficients = fisheye ? std::vector{lens.k1, lens.k2, lens.k3, lens.k4}
                         : std::vector{lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
  lend(coefficients, message.D);
  const std::array K{lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0};
  const std::array R{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  const std::array P{lens.fx, 0.0, lens.cx, 0.0, 0.0, lens.fy, lens.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  std::copy(K.begin(), K.end(), message.K);
  std::copy(R.begin(), R.end(), message.R);
  std::copy(P.begin(), P.end(), message.P);
  return message;
}

foxglove_FrameTransform borrow_frame_transform(const Pose& X_PC, Instant time, const std::string& parent,
                                               const char* child) {
  double wxyz[4];
  rotation_to_wxyz(X_PC.R, wxyz);
  foxglove_FrameTransform message{};
  message.timestamp = to_foxglove_time(time);
  message.parent_frame_id = lent(parent);
  message.child_frame_id = lent(child);
  message.translation = metres(X_PC.t);
  message.rotation = {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
  return message;
}

foxglove_Pose no_pose() noexcept { return {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}}; }

}  // namespace perimap

#include "drivers/recording/foxglove_pose.hpp"

#include "drivers/recording/foxglove_image.hpp"

namespace perimap {

foxglove_PoseInFrame borrow_pose_in_frame(const Pose& X_WS, Instant time, const std::string& frame_id) {
  double wxyz[4];
  rotation_to_wxyz(X_WS.R, wxyz);
  constexpr double kMetresPerMillimetre = 1e-3;
  foxglove_PoseInFrame message{};
  message.timestamp = to_foxglove_time(time);
  message.frame_id = const_cast<char*>(frame_id.c_str());  // the generated type has no const; only ever read
  message.pose.position = {X_WS.t.x() * kMetresPerMillimetre, X_WS.t.y() * kMetresPerMillimetre,
                           X_WS.t.z() * kMetresPerMillimetre};
  message.pose.orientation = {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
  return message;
}

}  // namespace perimap

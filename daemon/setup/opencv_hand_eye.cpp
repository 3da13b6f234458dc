#include "daemon/setup/opencv_hand_eye.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <utility>

namespace perimap {
namespace {

cv::Mat to_cv(const Matrix3d& R) {
  cv::Mat m(3, 3, CV_64F);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m.at<double>(i, j) = R(i, j);
  }
  return m;
}

cv::Mat to_cv(const Vector3d& t) {
  cv::Mat_<double> m = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
  return m;
}

}  // namespace

std::vector<OtherHandEye> opencv_hand_eyes(const std::vector<PosePair>& pairs) {
  constexpr std::size_t kMostPairs = 60;
  std::vector<cv::Mat> R_WS, t_WS, R_CB, t_CB;
  const std::size_t count = std::min(pairs.size(), kMostPairs);
  for (std::size_t k = 0; k < count; ++k) {
    const PosePair& pair = pairs[k * pairs.size() / count];
    const Pose X_CB = pair.X_BC.inverse();
    R_WS.push_back(to_cv(pair.X_WS.R)), t_WS.push_back(to_cv(pair.X_WS.t));
    R_CB.push_back(to_cv(X_CB.R)), t_CB.push_back(to_cv(X_CB.t));
  }
  static constexpr std::pair<const char*, cv::HandEyeCalibrationMethod> kMethods[] = {
      {"tsai", cv::CALIB_HAND_EYE_TSAI},
      {"park", cv::CALIB_HAND_EYE_PARK},
      {"horaud", cv::CALIB_HAND_EYE_HORAUD},
      {"daniilidis", cv::CALIB_HAND_EYE_DANIILIDIS}};
  std::vector<OtherHandEye> results;
  for (const auto& [name, method] : kMethods) {
    try {
      cv::Mat R, t;
      cv::calibrateHandEye(R_WS, t_WS, R_CB, t_CB, R, t, method);
      OtherHandEye other;
      other.method = name;
      for (int i = 0; i < 3; ++i) {
        other.X_SC.t[i] = t.at<double>(i);
        for (int j = 0; j < 3; ++j) other.X_SC.R(i, j) = R.at<double>(i, j);
      }
      if (other.X_SC.R.allFinite() && other.X_SC.t.allFinite()) results.push_back(other);
    } catch (const cv::Exception&) {
      continue;  // it finds no solution
    }
  }
  return results;
}

}  // namespace perimap

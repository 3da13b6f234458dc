#include "daemon/setup/touch_guide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/calibration/landmark_registration.hpp"

namespace perimap {
namespace {

class TouchGuide final : public LiveGuide {
 public:
  TouchGuide(std::vector<NamedPoint> model, const Vector3d& tip_T, const TouchRule& rule, double tolerance_mm)
      : model_(std::move(model)), tip_T_(tip_T), rule_(rule), tolerance_mm_(tolerance_mm) {}

  void see(double /*t_s*/, const GreyImage& /*grey*/) override {}

  void follow(const std::vector<TimedPose>& poses) override {
    const TouchedPoints touched = touched_points(poses, tip_T_, model_, rule_);
    constexpr double kLifted_s = 0.5;
    constexpr double kAmply_s = 1.0;  // longer than a touch: the last one is not lifted by everyone
    const auto& touches = touched.touches;
    const bool lifted = touches.empty() || poses.back().t_s > touches.back().end_s + kLifted_s;
    const bool all_held =
        touches.size() >= model_.size() && touches.back().end_s - touches.back().begin_s > rule_.shortest_s + kAmply_s;
    enough_ = false;
    state_ = fmt::format("{} of {} landmarks touched", std::min(touches.size(), model_.size()), model_.size());
    if (!lifted && !all_held) {
      state_ += "; lift the tip";
    } else if (touches.size() < model_.size()) {
      state_ += fmt::format("; touch {} and hold still", model_[touches.size()].name);
    } else if (!touched.landmarks_W) {
      state_ += "; too many rests elsewhere";
    } else {
      fit(*touched.landmarks_W);
    }
  }

  [[nodiscard]] std::string line() const override { return state_; }
  [[nodiscard]] bool enough() const override { return enough_; }

 private:
  void fit(const std::vector<NamedPoint>& touched_W) {
    std::vector<Landmark> landmarks;
    for (std::size_t i = 0; i < model_.size(); ++i) {
      landmarks.push_back({model_[i].name, model_[i].p, touched_W[i].p});
    }
    const auto result = register_landmarks(landmarks, tolerance_mm_);
    enough_ = result.has_value();
    state_ += result ? fmt::format(", {:.2f} mm RMS", result->fre_mm) : "; " + result.error().message;
  }

  std::vector<NamedPoint> model_;
  Vector3d tip_T_;
  TouchRule rule_;
  double tolerance_mm_;
  std::string state_ = "no poses of the tool yet";
  bool enough_ = false;
};

}  // namespace

std::unique_ptr<LiveGuide> touch_guide(std::vector<NamedPoint> model, const Vector3d& tip_T, const TouchRule& rule,
                                       double tolerance_mm) {
  return std::make_unique<TouchGuide>(std::move(model), tip_T, rule, tolerance_mm);
}

}  // namespace perimap

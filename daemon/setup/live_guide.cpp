#include "daemon/setup/live_guide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angle/angle.hpp"
#include "core/calibration/pivot.hpp"
#include "core/calibration/rotation_spread.hpp"
#include "core/calibration/tracker_noise.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/lens_in_hand_eye.hpp"

namespace perimap {
namespace {

constexpr std::array<const char*, 9> kNinths{"upper left", "upper middle", "upper right",  "left",       "middle",
                                             "right",      "lower left",   "lower middle", "lower right"};

Vector3d turned_deg(const std::vector<TimedPose>& poses) {
  std::vector<Matrix3d> rotations;
  for (const TimedPose& pose : poses) rotations.push_back(pose.X.R);
  return rotation_spread(rotations).deviation_rad / kDegree;
}

double span_s(const std::vector<TimedPose>& poses) {
  return poses.empty() ? 0.0 : poses.back().t_s - poses.front().t_s;
}

// At most so many of them, evenly: what is judged while it goes on must be quick.
template <typename Timed>
std::vector<Timed> thinned(const std::vector<Timed>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<Timed> few;
  for (std::size_t k = 0; k < most; ++k) few.push_back(all[k * all.size() / most]);
  return few;
}

class BoardGuide final : public LiveGuide {
 public:
  BoardGuide(const BoardWish& wish, std::optional<KnownLens> lens, double least_s, Turning turning)
      : wish_(wish), lens_(std::move(lens)), least_s_(least_s), turned_(lens_ || turning == Turning::kWanted) {}

  void see(double t_s, const GreyImage& grey) override {
    ++frames_;
    first_s_ = std::min(first_s_.value_or(t_s), t_s);
    last_s_ = t_s;
    if (!board_) {
      const auto found = recognise_board({grey}, wish_);
      if (!found) return;
      board_ = *found;
    }
    auto view = find_board(grey, *board_);
    sees_ = view.has_value();
    if (!view) return;
    for (const Vector2d& px : view->px) {
      const int column = std::clamp(static_cast<int>(3.0 * px.x() / grey.width), 0, 2);
      const int row = std::clamp(static_cast<int>(3.0 * px.y() / grey.height), 0, 2);
      ++coverage_[static_cast<std::size_t>(3 * row + column)];
    }
    views_.push_back({t_s, *std::move(view)});
  }

  void follow(const std::vector<TimedPose>& poses) override {
    turned_deg_ = turned_deg(thinned(poses, 500));
    // Anew every five seconds of views.
    constexpr double kEvery_s = 5.0;
    if (!lens_ || views_.size() < 50 || views_.back().t_s - judged_s_ < kEvery_s) return;
    judged_s_ = views_.back().t_s;
    determined_ = false;
    auto result = calibrate_hand_eye(camera_poses_of(views_, lens_->camera), poses, {});
    if (!result) {
      residual_ = result.error().message;
      return;
    }
    // What it makes of a hand-eye goes with the motion, not with the number of views.
    constexpr std::size_t kViewsOfLens = 40;
    if (lens_->covariance) {
      add_lens_uncertainty(*result, thinned(views_, kViewsOfLens), lens_->camera, *lens_->covariance);
    }
    const double by_lens_mm = result->target_deviation_by_lens_mm;
    residual_ = fmt::format("AX - XB {:.2f} mm, held aside {:.2f} mm, a target {:.0f} mm ahead within {:.2f} mm, {}",
                            result->residual_median_mm, result->held_aside_rms_mm, HandEyeCalibration::kTargetAhead_mm,
                            result->target_deviation_mm(),
                            result->covariance_by_lens ? fmt::format("{:.2f} mm of it by the lens", by_lens_mm)
                                                       : "the lens being taken for exact: " + result->lens_untold);
    // A lens that is known worse is not mended by a longer recording.
    constexpr double kLittleMore = 1.1;
    determined_ =
        result->target_deviation_mm() <= std::max(HandEyeCalibration::kWellKnownTarget_mm, kLittleMore * by_lens_mm);
  }

  [[nodiscard]] Followed followed() const override { return turned_ ? Followed::kTool : Followed::kNone; }

  [[nodiscard]] std::string line() const override {
    if (!board_) return "no board is seen: bring all of it into view, sharp and evenly lit";
    std::string text = fmt::format("{} views{}", views_.size(), sees_ ? "" : " (not seen now)");
    const std::string missing = missing_ninths();
    if (!missing.empty()) {
      text += "; show it " + missing;
    } else if (turned_ && !is_turned()) {
      text += fmt::format("; turned {:.0f} {:.0f} {:.0f} degrees about three axes: tilt and turn the scope further",
                          turned_deg_[0], turned_deg_[1], turned_deg_[2]);
    } else {
      text += "; from all sides";
    }
    return residual_.empty() ? text : text + "; " + residual_;
  }

  [[nodiscard]] std::vector<double> seen_of_ninths() const override {
    std::vector<double> seen;
    for (const int points : coverage_) seen.push_back(std::min(1.0, static_cast<double>(points) / kFewestInNinth));
    return seen;
  }

  [[nodiscard]] bool enough() const override {
    return views_.size() >= kWantedViews && last_s_ - first_s_.value_or(last_s_) >= least_s_ &&
           missing_ninths().empty() && (!turned_ || is_turned()) && (!lens_ || determined_);
  }

 private:
  static constexpr std::size_t kWantedViews = 60;
  static constexpr int kFewestInNinth = 30;  // points

  // About two axes, which tell the camera's place in the sensor; a hand turns about the third as well.
  [[nodiscard]] bool is_turned() const {
    constexpr double kWanted_deg = 8.0;  // standard deviation
    constexpr double kWantedOfThird_deg = 3.0;
    return turned_deg_[1] >= kWanted_deg && turned_deg_[2] >= kWantedOfThird_deg;
  }

  [[nodiscard]] std::string missing_ninths() const {
    std::string missing;
    for (std::size_t i = 0; i < coverage_.size(); ++i) {
      if (coverage_[i] < kFewestInNinth) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", kNinths[i]);
    }
    return missing;
  }

  BoardWish wish_;
  std::optional<KnownLens> lens_;
  double least_s_;
  bool turned_;  // wanted
  std::optional<Board> board_;
  std::vector<TimedView> views_;
  std::array<int, 9> coverage_{};
  std::size_t frames_ = 0;
  std::optional<double> first_s_;
  double last_s_ = 0.0;
  double judged_s_ = -1e9;
  bool sees_ = false;
  bool determined_ = false;
  Vector3d turned_deg_ = Vector3d::Zero();
  std::string residual_;
};

class PivotGuide final : public LiveGuide {
 public:
  explicit PivotGuide(double least_s) : least_s_(least_s) {}

  void see(double /*t_s*/, const GreyImage& /*grey*/) override {}

  void follow(const std::vector<TimedPose>& poses) override {
    span_s_ = span_s(poses);
    turned_deg_ = turned_deg(thinned(poses, 500));
    // Of a few of the poses the tip would be less well known than of all.
    const auto result = calibrate_pivot(thinned(poses, 3000));
    const double within_mm = result ? std::sqrt(result->covariance_T.trace()) : 0.0;
    well_known_ = result && within_mm <= kWellKnownTip_mm;
    state_ = result ? fmt::format("{:.2f} mm RMS, tip within {:.2f} mm{}", result->rms_mm, within_mm,
                                  well_known_ ? "" : ": swing it on, to all sides")
                    : result.error().message;
  }

  [[nodiscard]] std::string line() const override {
    return fmt::format("{:.0f} s, turned {:.0f} {:.0f} {:.0f} degrees about three axes; {}", span_s_, turned_deg_[0],
                       turned_deg_[1], turned_deg_[2], state_.empty() ? "no poses of the tool yet" : state_);
  }

  [[nodiscard]] bool enough() const override {
    constexpr double kWanted_deg = 10.0;
    return well_known_ && span_s_ >= least_s_ && turned_deg_[1] >= kWanted_deg;
  }

 private:
  // Root of the covariance's trace: the tip is off by less than half a millimetre then in 95 %.
  static constexpr double kWellKnownTip_mm = 0.3;

  double least_s_;
  double span_s_ = 0.0;
  bool well_known_ = false;
  Vector3d turned_deg_ = Vector3d::Zero();
  std::string state_;
};

class StillGuide final : public LiveGuide {
 public:
  explicit StillGuide(double least_s) : least_s_(least_s) {}

  void see(double /*t_s*/, const GreyImage& /*grey*/) override {}

  void follow(const std::vector<TimedPose>& poses) override {
    const auto result = measure_tracker_noise(thinned(poses, 2000));
    still_s_ = result ? result->still_s : 0.0;
    state_ = result ? fmt::format("{:.2f} mm and {:.2f} degrees RMS", result->position_deviation_mm,
                                  result->rotation_deviation_deg)
                    : result.error().message;
  }

  [[nodiscard]] std::string line() const override {
    return fmt::format("still for {:.0f} of {:.0f} s; {}", still_s_, least_s_,
                       state_.empty() ? "no poses of the sensor yet" : state_);
  }

  [[nodiscard]] bool enough() const override { return still_s_ >= least_s_; }

 private:
  double least_s_;
  double still_s_ = 0.0;
  std::string state_;
};

}  // namespace

std::unique_ptr<LiveGuide> board_guide(const BoardWish& wish, std::optional<KnownLens> lens, double least_s,
                                       Turning turning) {
  return std::make_unique<BoardGuide>(wish, std::move(lens), least_s, turning);
}

std::unique_ptr<LiveGuide> pivot_guide(double least_s) { return std::make_unique<PivotGuide>(least_s); }

std::unique_ptr<LiveGuide> still_guide(double least_s) { return std::make_unique<StillGuide>(least_s); }

}  // namespace perimap

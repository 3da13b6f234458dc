#include "daemon/setup/scope_guide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/field_stop.hpp"
#include "core/calibration/fit_by_second_sensor.hpp"
#include "core/calibration/held_stretches.hpp"

namespace perimap {
namespace {

// Readings in a row that are alike tell that the scope is held: not those of one moment.
constexpr double kReadEvery_s = 0.25;

// The square about the field stop's circle, as far as it is in the picture: its ninths are those that can be filled.
GreyImage square_of(const GreyImage& grey, const FieldStopReading& stop) {
  const auto first = [](double middle, double radius) { return std::max(0, static_cast<int>(middle - radius)); };
  const auto last = [](double middle, double radius, int side) {
    return std::min(side, static_cast<int>(std::ceil(middle + radius)));
  };
  const int left = first(stop.centre_px.x(), stop.radius_px), top = first(stop.centre_px.y(), stop.radius_px);
  const int right = last(stop.centre_px.x(), stop.radius_px, grey.width);
  const int bottom = last(stop.centre_px.y(), stop.radius_px, grey.height);
  return {grey.row(top) + left, right - left, bottom - top, grey.stride};
}

class ScopeGuide final : public LiveGuide {
 public:
  explicit ScopeGuide(const ScopeGuideSettings& settings) : settings_(settings) {}

  void see(double t_s, const GreyImage& grey) override {
    GreyImage seen = grey;
    if (!settings_.by_second_sensor) {
      const auto stop = read_field_stop(grey);
      unread_ = stop ? "" : stop.error().message;
      if (!stop) return;
      if (t_s >= due_s_) {
        due_s_ = t_s + kReadEvery_s;
        take({t_s, orientation_of_notch(stop->notch_rad)});
      }
      seen = square_of(grey, *stop);
    }
    if (held_.is_held() && now_ != nullptr) now_->guide->see(t_s, seen);
  }

  void follow(const std::vector<TimedPose>& poses) override {
    sensor_ = poses;
    if (now_ == nullptr) return;
    const auto since =
        std::find_if(poses.begin(), poses.end(), [&](const TimedPose& p) { return p.t_s > now_->from_s; });
    now_->guide->follow({since, poses.end()});
  }

  void follow_second(const std::vector<TimedPose>& poses) override {
    if (!settings_.by_second_sensor) return;
    second_s_ = poses.back().t_s;
    const double each_s = relation_window_s(poses);
    const auto since = [&](const std::vector<TimedPose>& all) {
      return std::vector<TimedPose>(
          std::find_if(all.begin(), all.end(), [&](const TimedPose& p) { return p.t_s > related_s_; }), all.end());
    };
    std::vector<TimedTurn> relations = relations_over(since(sensor_), since(poses), each_s);
    if (relations.size() < 2) return;
    relations.pop_back();  // it is not over
    for (const TimedTurn& relation : relations) take(relation);
    related_s_ = relations.back().t_s + 0.5 * each_s;
  }

  [[nodiscard]] std::string line() const override {
    if (!unread_.empty()) return "the field stop is not read: " + unread_;
    constexpr double kUnseen_s = 1.0;
    if (settings_.by_second_sensor && !sensor_.empty() && second_s_ + kUnseen_s < sensor_.back().t_s) {
      return "the second sensor is not seen: bring both into sight of the tracker";
    }
    if (!near_.empty()) return near_;
    if (now_ == nullptr || !held_.is_held()) {
      return fmt::format("{} of {} turns are enough; hold the scope at one turn", done(), settings_.turns);
    }
    if (now_->guide->enough()) {
      return fmt::format(
          "{} of {} turns are enough; turn the scope in its camera head by 60 degrees, and hold it there", done(),
          settings_.turns);
    }
    return fmt::format("turn {} of {}: {}", std::min(done() + 1, settings_.turns), settings_.turns,
                       now_->guide->line());
  }

  [[nodiscard]] bool enough() const override { return done() >= settings_.turns; }

 private:
  struct Turn {
    Matrix3d R = Matrix3d::Identity();
    double from_s = 0.0;  // on the tracker's clock
    std::unique_ptr<LiveGuide> guide;
  };

  [[nodiscard]] std::size_t done() const {
    return static_cast<std::size_t>(
        std::count_if(turns_.begin(), turns_.end(), [](const auto& turn) { return turn->guide->enough(); }));
  }

  void take(const TimedTurn& reading) {
    const std::size_t before = held_.stretches().size();
    held_.add(reading);
    if (held_.stretches().size() > before) begin(held_.stretches().back().R);
  }

  // Another turn than those before; or one anew whose stretch was too short.
  void begin(const Matrix3d& R) {
    near_.clear();
    now_ = nullptr;
    const auto angle_from = [&](const std::unique_ptr<Turn>& turn) { return angle_between(turn->R, R) / kDegree; };
    const auto near = std::find_if(turns_.begin(), turns_.end(),
                                   [&](const auto& turn) { return angle_from(turn) < kLeastTurnOfSetups_deg; });
    if (near != turns_.end() && (*near)->guide->enough()) {
      near_ = fmt::format(
          "{} of {} turns are enough, and this one is {:.0f} degrees from one of them: turn on, by 60 "
          "degrees",
          done(), settings_.turns, angle_from(*near));
      return;
    }
    if (near != turns_.end()) turns_.erase(near);
    turns_.push_back(std::make_unique<Turn>());
    now_ = turns_.back().get();
    now_->R = R;
    now_->from_s = sensor_.empty() ? -1e18 : sensor_.back().t_s;
    now_->guide = board_guide(settings_.board, std::nullopt, settings_.least_s, Turning::kWanted);
  }

  ScopeGuideSettings settings_;
  HeldStretches held_;
  std::vector<std::unique_ptr<Turn>> turns_;
  Turn* now_ = nullptr;
  std::vector<TimedPose> sensor_;
  double due_s_ = -1e18;
  double related_s_ = -1e18;
  double second_s_ = -1e18;  // its last pose
  std::string unread_;
  std::string near_;
};

class NotchGuide final : public LiveGuide {
 public:
  void see(double t_s, const GreyImage& grey) override {
    const auto stop = read_field_stop(grey);
    state_ = stop ? fmt::format("notch at {:.1f} degrees", stop->notch_rad / kDegree)
                  : "the field stop is not read: " + stop.error().message;
    if (!stop || t_s < due_s_) return;
    due_s_ = t_s + kReadEvery_s;
    held_.add({t_s, orientation_of_notch(stop->notch_rad)});
  }
  void follow(const std::vector<TimedPose>& /*poses*/) override {}
  [[nodiscard]] std::string line() const override { return state_; }
  [[nodiscard]] bool enough() const override {
    constexpr double kHeld_s = 5.0;
    return held_.is_held() && held_.stretches().back().to_s - held_.stretches().back().from_s >= kHeld_s;
  }

 private:
  HeldStretches held_;
  double due_s_ = -1e18;
  std::string state_ = "no pictures yet";
};

}  // namespace

std::unique_ptr<LiveGuide> scope_guide(const ScopeGuideSettings& settings) {
  return std::make_unique<ScopeGuide>(settings);
}

std::unique_ptr<LiveGuide> notch_guide() { return std::make_unique<NotchGuide>(); }

}  // namespace perimap

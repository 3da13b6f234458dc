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

// One turn, or one zoom.
struct Held {
  Matrix3d R = Matrix3d::Identity();
  double radius_px = 0.0;
  double from_s = 0.0;  // on the tracker's clock
  std::unique_ptr<LiveGuide> guide;
};

// Those of one kind.
class AllHeld {
 public:
  explicit AllHeld(std::size_t wanted) : wanted_(wanted) {}

  [[nodiscard]] std::size_t wanted() const { return wanted_; }
  [[nodiscard]] std::size_t done() const {
    return static_cast<std::size_t>(
        std::count_if(all_.begin(), all_.end(), [](const auto& held) { return held->guide->enough(); }));
  }
  [[nodiscard]] bool enough() const { return done() >= wanted_; }
  // One like this that is enough already. One that is not is forgotten: its stretch is over.
  template <typename IsLike>
  const Held* done_like(const IsLike& is_like) {
    const auto like = std::find_if(all_.begin(), all_.end(), [&](const auto& held) { return is_like(*held); });
    if (like == all_.end()) return nullptr;
    if ((*like)->guide->enough()) return like->get();
    all_.erase(like);
    return nullptr;
  }
  Held* add(Held held) {
    all_.push_back(std::make_unique<Held>(std::move(held)));
    return all_.back().get();
  }

 private:
  std::size_t wanted_;
  std::vector<std::unique_ptr<Held>> all_;
};

class ScopeGuide final : public LiveGuide {
 public:
  explicit ScopeGuide(const ScopeGuideSettings& settings)
      : settings_(settings), turns_(settings.turns), zooms_(settings.zooms) {}

  void see(double t_s, const GreyImage& grey) override {
    GreyImage seen = grey;
    if (!settings_.by_second_sensor) {
      const auto stop = read_field_stop(grey);
      unread_ = stop ? "" : stop.error().message;
      if (!stop) return;
      if (t_s >= due_s_) {
        due_s_ = t_s + kReadEvery_s;
        take({t_s, orientation_of_notch(stop->notch_rad), stop->radius_px});
      }
      seen = square_of(grey, *stop);
    }
    if (stretches_.is_held() && now_ != nullptr) now_->guide->see(t_s, seen);
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

  [[nodiscard]] Followed followed() const override {
    return settings_.by_second_sensor ? Followed::kBothSensors : Followed::kTool;
  }

  [[nodiscard]] std::string line() const override {
    if (!unread_.empty()) return "the field stop is not read: " + unread_;
    if (!near_.empty()) return fmt::format("{} are enough, and this one is {}", so_far(), near_);
    if (now_ == nullptr || !stretches_.is_held()) {
      return fmt::format("{} are enough; hold the scope at one turn{}", so_far(),
                         zooms_.wanted() > 0 ? " and zoom" : "");
    }
    if (now_->guide->enough()) return fmt::format("{} are enough; {}", so_far(), next());
    const bool zoomed = now_is_zoom_;
    const AllHeld& kind = zoomed ? zooms_ : turns_;
    return fmt::format("{} {} of {}: {}", zoomed ? "zoom" : "turn", std::min(kind.done() + 1, kind.wanted()),
                       kind.wanted(), now_->guide->line());
  }

  // Of the whole picture: by the field stop they are ninths of its square.
  [[nodiscard]] std::vector<double> seen_of_ninths() const override {
    if (!settings_.by_second_sensor || now_ == nullptr) return {};
    return now_->guide->seen_of_ninths();
  }

  [[nodiscard]] bool enough() const override { return turns_.enough() && zooms_.enough(); }

 private:
  [[nodiscard]] std::string so_far() const {
    std::string text = fmt::format("{} of {} turns", turns_.done(), turns_.wanted());
    if (zooms_.wanted() > 0) text += fmt::format(" and {} of {} other zooms", zooms_.done(), zooms_.wanted());
    return text;
  }

  [[nodiscard]] std::string next() const {
    if (!turns_.enough()) {
      return fmt::format("{}turn the scope in its camera head by 60 degrees, and hold it there",
                         now_is_zoom_ ? "zoom back to where the first turn was, " : "");
    }
    return "zoom or focus to an end, or between the ends, and hold it there";
  }

  void take(const TimedTurn& reading) {
    const std::size_t before = stretches_.stretches().size();
    stretches_.add(reading);
    if (stretches_.stretches().size() > before) begin(stretches_.stretches().back());
  }

  // Another turn or zoom than those before; or one anew whose stretch was too short.
  void begin(const HeldStretch& stretch) {
    near_.clear();
    now_ = nullptr;
    now_is_zoom_ = !is_same_zoom(radius_of_turns_px(stretches_.stretches()), stretch.radius_px);
    near_ = now_is_zoom_ ? why_no_zoom(stretch) : why_no_turn(stretch);
    if (!near_.empty()) return;
    Held held{stretch.R, stretch.radius_px, sensor_.empty() ? -1e18 : sensor_.back().t_s,
              board_guide(settings_.board, std::nullopt, settings_.least_s, Turning::kWanted)};
    now_ = (now_is_zoom_ ? zooms_ : turns_).add(std::move(held));
  }

  [[nodiscard]] std::string why_no_turn(const HeldStretch& stretch) {
    const auto from_deg = [&](const Held& turn) { return angle_between(turn.R, stretch.R) / kDegree; };
    const Held* like = turns_.done_like([&](const Held& turn) { return from_deg(turn) < kLeastTurnOfSetups_deg; });
    if (like == nullptr) return "";
    if (turns_.enough()) return "one of them: zoom or focus to an end, or between the ends, and hold it there";
    return fmt::format("{:.0f} degrees from one of them: turn on, by 60 degrees", from_deg(*like));
  }

  [[nodiscard]] std::string why_no_zoom(const HeldStretch& stretch) {
    if (zooms_.wanted() == 0) {
      return "of another zoom than the first turn: zoom back, or say --zooms, so that other zooms are measured too";
    }
    const Held* like =
        zooms_.done_like([&](const Held& zoom) { return is_same_zoom(zoom.radius_px, stretch.radius_px); });
    if (like == nullptr) return "";
    return fmt::format("one of these zooms: {}", zooms_.enough() ? "zoom back to where the first turn was" : "zoom on");
  }

  ScopeGuideSettings settings_;
  HeldStretches stretches_;
  AllHeld turns_;
  AllHeld zooms_;
  Held* now_ = nullptr;
  bool now_is_zoom_ = false;
  std::vector<TimedPose> sensor_;
  double due_s_ = -1e18;
  double related_s_ = -1e18;
  std::string unread_;
  std::string near_;  // why there is nothing to be measured as it is held now
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
  [[nodiscard]] Followed followed() const override { return Followed::kNone; }
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

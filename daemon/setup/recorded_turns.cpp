#include "daemon/setup/recorded_turns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/angle/angle.hpp"
#include "core/calibration/held_stretches.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/lens_in_hand_eye.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "daemon/setup/recorded_poses.hpp"

namespace perimap {
namespace {

// All that the recording holds, of which each stretch takes its part.
struct Recorded {
  RecordedBoard board;
  std::vector<TimedPose> sensor;
  std::vector<TimedPose> second;   // where a second sensor tells the turn
  std::vector<ReadPicture> stops;  // where the field stop does
  std::vector<TimedTurn> turns;
};

template <typename Timed>
std::vector<Timed> between(const std::vector<Timed>& all, double from_s, double to_s) {
  std::vector<Timed> part;
  std::copy_if(all.begin(), all.end(), std::back_inserter(part),
               [&](const Timed& one) { return one.t_s >= from_s && one.t_s <= to_s; });
  return part;
}

Expected<void> read_second_sensor(const std::string& recording, Recorded& recorded) {
  if (const auto has = has_recorded_poses(recording, kSecondSensorTool); !has || !*has) {
    return fail(has ? recording + ": has no second sensor: name it as tracker.second_sensor, and record again"
                    : has.error().message);
  }
  auto second = read_recorded_poses(recording, kSecondSensorTool);
  if (!second) return tl::unexpected(second.error());
  recorded.second = *std::move(second);
  recorded.turns = relations_over(recorded.sensor, recorded.second, relation_window_s(recorded.second));
  if (recorded.turns.empty()) {
    return fail(recording + ": the two sensors are hardly seen together: keep both in sight of the tracker");
  }
  return {};
}

Expected<void> read_field_stops(const std::string& recording, Recorded& recorded) {
  constexpr double kFrames_per_s = 4.0;
  std::string why = "it has no frames";
  const auto read = for_each_recorded_frame(recording, kFrames_per_s, [&](double t_s, const GreyImage& grey) {
    const auto reading = read_field_stop(grey);
    if (!reading) {
      why = reading.error().message;
      return;
    }
    recorded.stops.push_back({fmt::format("frame at {:.3f} s", t_s), t_s, *reading});
    recorded.turns.push_back({t_s, orientation_of_notch(reading->notch_rad), reading->radius_px});
  });
  if (!read) return tl::unexpected(read.error());
  if (recorded.turns.empty()) return fail(fmt::format("{}: no field stop is read: {}", recording, why));
  return {};
}

Expected<Recorded> read_all(const std::string& recording, const BoardWish& wish, bool by_second_sensor,
                            const std::function<void(std::uint64_t done, std::uint64_t all)>& progress) {
  Recorded recorded;
  auto sensor = read_recorded_poses(recording, kScopeTool);
  if (!sensor) return tl::unexpected(sensor.error());
  recorded.sensor = *std::move(sensor);
  const auto read = by_second_sensor ? read_second_sensor(recording, recorded) : read_field_stops(recording, recorded);
  if (!read) return tl::unexpected(read.error());
  constexpr double kFrames_per_s = 15.0;
  auto board = find_recorded_board(recording, wish, kFrames_per_s, progress);
  if (!board) return tl::unexpected(board.error());
  recorded.board = *std::move(board);
  return recorded;
}

// The lens by two views a second, as `perimap calibrate camera` takes them.
std::vector<BoardView> thinned(const std::vector<TimedView>& views) {
  constexpr double kInterval_s = 0.5 - 1e-3;
  std::vector<BoardView> few;
  double due_s = -1e18;
  for (const TimedView& seen : views) {
    if (seen.t_s < due_s) continue;
    due_s = seen.t_s + kInterval_s;
    few.push_back(seen.view);
  }
  return few;
}

Expected<CameraCalibration> measured_lens(const Recorded& recorded, const std::vector<TimedView>& views) {
  return calibrate_camera(thinned(views), recorded.board.width, recorded.board.height, {});
}

Expected<RecordedTurn> measured_turn(const Recorded& recorded, const HeldStretch& stretch) {
  const double from_s = stretch.from_s, to_s = stretch.to_s;
  const std::vector<TimedView> views = between(recorded.board.views, from_s, to_s);
  RecordedTurn turn;
  const auto lens = measured_lens(recorded, views);
  if (!lens) return tl::unexpected(lens.error());
  // The clocks may differ by so much.
  const double apart_s = HandEyeSettings{}.largest_offset_s;
  const std::vector<TimedPose> sensor = between(recorded.sensor, from_s - apart_s, to_s + apart_s);
  auto hand_eye = calibrate_hand_eye(camera_poses_of(views, lens->camera), sensor, {});
  if (!hand_eye) return tl::unexpected(hand_eye.error());
  add_lens_uncertainty(*hand_eye, views, lens->camera, lens->covariance);
  turn.held.views = views.size();
  turn.held.lens_rms_px = lens->rms_px;
  turn.hand_eye_rms_mm = hand_eye->held_aside_rms_mm;
  turn.offset_s = hand_eye->offset_s;
  turn.measured.lens = lens->camera;
  SetupAtRotation& setup = turn.measured.setup;
  setup.X_SC = hand_eye->X_SC;
  setup.covariance_C = hand_eye->covariance.topLeftCorner<6, 6>();
  setup.principal_px = {lens->camera.cx, lens->camera.cy};
  setup.principal_deviation_px = {lens->deviations[2], lens->deviations[3]};
  setup.covariance_with_principal = hand_eye->covariance_with_principal;
  setup.focal_px = {lens->camera.fx, lens->camera.fy};
  if (!recorded.second.empty()) {
    const auto relation = held_relation(between(recorded.sensor, from_s, to_s), between(recorded.second, from_s, to_s));
    if (!relation) return tl::unexpected(relation.error());
    turn.measured.relation = *relation;
    return turn;
  }
  std::vector<ReadPicture> stops = between(recorded.stops, from_s, to_s);
  // A notch that was misread is none.
  std::erase_if(stops, [&](const ReadPicture& picture) {
    return !is_same_turn(stretch.R, orientation_of_notch(picture.reading.notch_rad));
  });
  const auto stop = rotation_of(std::move(stops), {});
  if (!stop) return tl::unexpected(stop.error());
  constexpr double kHeld_rad = 2.0 * kDegree;
  if (stop->spread_rad > kHeld_rad) {
    return fail(fmt::format("the notch goes to and fro by {:.1f} degrees RMS: hold the scope at its turn",
                            stop->spread_rad / kDegree));
  }
  turn.measured.stop_centre_px = stop->centre_px;
  setup.rotation_rad = stop->rotation_rad;
  setup.rotation_deviation_rad = stop->rotation_deviation_rad;
  setup.radius_px = stop->radius_px;
  return turn;
}

Expected<RecordedZoom> measured_zoom(const Recorded& recorded, const HeldStretch& stretch) {
  const std::vector<TimedView> views = between(recorded.board.views, stretch.from_s, stretch.to_s);
  const auto lens = measured_lens(recorded, views);
  if (!lens) return tl::unexpected(lens.error());
  RecordedZoom zoom;
  zoom.measured = {stretch.radius_px, {lens->camera.fx, lens->camera.fy}};
  zoom.focal_deviation_px = {lens->deviations[0], lens->deviations[1]};
  zoom.held.views = views.size();
  zoom.held.lens_rms_px = lens->rms_px;
  return zoom;
}

// The stretch without its ends: the scope is let go a little before it stands out that it moves.
HeldStretch well_inside(HeldStretch stretch) {
  constexpr double kMargin_s = 0.75;
  stretch.from_s += kMargin_s;
  stretch.to_s -= kMargin_s;
  return stretch;
}

// Stretches one after the other, into the result.
class MeasuredStretches {
 public:
  MeasuredStretches(const Recorded& recorded, double radius_of_turns_px)
      : recorded_(recorded), first_s_(recorded.turns.front().t_s), radius_of_turns_px_(radius_of_turns_px) {}

  void add(const HeldStretch& whole) {
    if (whole.to_s - whole.from_s < kLeastHeld_s) return leave_out(whole, "held for less than twelve seconds");
    const HeldStretch stretch = well_inside(whole);
    if (is_same_zoom(radius_of_turns_px_, stretch.radius_px)) {
      keep(whole, stretch, measured_turn(recorded_, stretch), result_.turns);
    } else {
      keep(whole, stretch, measured_zoom(recorded_, stretch), result_.zooms);
    }
  }
  [[nodiscard]] RecordedTurns result() && { return std::move(result_); }

 private:
  template <typename Measured>
  void keep(const HeldStretch& whole, const HeldStretch& stretch, Expected<Measured> measured,
            std::vector<Measured>& all) {
    if (!measured) return leave_out(whole, measured.error().message);
    measured->held.from_s = stretch.from_s - first_s_;
    measured->held.to_s = stretch.to_s - first_s_;
    all.push_back(*std::move(measured));
  }
  void leave_out(const HeldStretch& stretch, const std::string& why) {
    result_.left_out.push_back(
        fmt::format("{:.1f} to {:.1f} s: {}", stretch.from_s - first_s_, stretch.to_s - first_s_, why));
  }

  const Recorded& recorded_;
  double first_s_;
  double radius_of_turns_px_;
  RecordedTurns result_;
};

// Without a sign where there is nothing.
double tenths_of(double value) { return std::round(10.0 * value) / 10.0 + 0.0; }

}  // namespace

Expected<RecordedTurns> turns_in_recording(const std::string& recording, const BoardWish& board, bool by_second_sensor,
                                           const std::function<void(std::uint64_t done, std::uint64_t all)>& progress) {
  const auto recorded = read_all(recording, board, by_second_sensor, progress);
  if (!recorded) return tl::unexpected(recorded.error());
  HeldStretches held;
  for (const TimedTurn& turn : recorded->turns) held.add(turn);
  if (held.stretches().empty()) {
    return fail(recording + ": the scope was held at no turn: hold it at each while the board is looked at");
  }
  MeasuredStretches stretches(*recorded, radius_of_turns_px(held.stretches()));
  for (const HeldStretch& stretch : held.stretches()) stretches.add(stretch);
  RecordedTurns result = std::move(stretches).result();
  if (result.turns.empty()) {
    return fail(fmt::format("{}: no turn is measured: {}", recording, fmt::join(result.left_out, "; ")));
  }
  return result;
}

std::string text_of(const RecordedTurns& recorded) {
  std::string text;
  for (const RecordedTurn& turn : recorded.turns) {
    text += fmt::format(
        "  held           {:.1f} to {:.1f} s{}: {} views, lens {:.2f} px RMS, hand-eye {:.2f} mm RMS held "
        "aside, clocks {:.1f} ms\n",
        turn.held.from_s, turn.held.to_s,
        turn.measured.relation
            ? ""
            : fmt::format(", notch at {:.1f} degrees", tenths_of(turn.measured.setup.rotation_rad / kDegree)),
        turn.held.views, turn.held.lens_rms_px, turn.hand_eye_rms_mm, 1e3 * turn.offset_s);
  }
  for (const RecordedZoom& zoom : recorded.zooms) {
    text += fmt::format(
        "  zoomed         {:.1f} to {:.1f} s, field stop of {:.1f} px: {} views, lens {:.2f} px RMS, focal length "
        "{:.2f} {:.2f} px, deviation {:.2f} {:.2f}\n",
        zoom.held.from_s, zoom.held.to_s, zoom.measured.radius_px, zoom.held.views, zoom.held.lens_rms_px,
        zoom.measured.focal_px.x(), zoom.measured.focal_px.y(), zoom.focal_deviation_px.x(),
        zoom.focal_deviation_px.y());
  }
  for (const std::string& why : recorded.left_out) text += "  not measured   " + why + "\n";
  return text;
}

nlohmann::json json_of(const RecordedTurns& recorded) {
  nlohmann::json json = {{"turns", nlohmann::json::array()},
                         {"zooms", nlohmann::json::array()},
                         {"turns_not_measured", recorded.left_out}};
  const auto of_held = [](const HeldViews& held) {
    return nlohmann::json{
        {"from_s", held.from_s}, {"to_s", held.to_s}, {"views", held.views}, {"lens_rms_px", held.lens_rms_px}};
  };
  for (const RecordedTurn& turn : recorded.turns) {
    nlohmann::json told = of_held(turn.held);
    told["hand_eye_held_aside_mm"] = turn.hand_eye_rms_mm;
    told["time_offset_ms"] = 1e3 * turn.offset_s;
    if (!turn.measured.relation) told["rotation_deg"] = turn.measured.setup.rotation_rad / kDegree;
    json["turns"].push_back(std::move(told));
  }
  for (const RecordedZoom& zoom : recorded.zooms) {
    nlohmann::json told = of_held(zoom.held);
    told["radius_px"] = zoom.measured.radius_px;
    told["focal_px"] = {zoom.measured.focal_px.x(), zoom.measured.focal_px.y()};
    told["focal_px_deviation"] = {zoom.focal_deviation_px.x(), zoom.focal_deviation_px.y()};
    json["zooms"].push_back(std::move(told));
  }
  return json;
}

}  // namespace perimap

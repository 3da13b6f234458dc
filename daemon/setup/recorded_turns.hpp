// What one recording of an angled scope tells, that is swung about a board, and turned in its camera head and zoomed in
// between: lens and hand-eye at each turn at which it was held, and the lens at other zooms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/fit_by_second_sensor.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/scope_rotation.hpp"

namespace perimap {

// One set-up that the function of the turn is fitted to.
struct MeasuredTurn {
  SetupAtRotation setup;  // its rotation by the field stop, where that tells it
  CameraModel lens;
  std::optional<Vector2d> stop_centre_px;  // the field stop tells the turn
  std::optional<HeldRelation> relation;    // the second sensor does
};

// While the scope was held.
struct HeldViews {
  double from_s = 0.0;  // since the recording's first frame
  double to_s = 0.0;
  std::size_t views = 0;  // of the board
  double lens_rms_px = 0.0;
};

struct RecordedTurn {
  MeasuredTurn measured;
  HeldViews held;
  double hand_eye_rms_mm = 0.0;  // held aside
  double offset_s = 0.0;         // of the clocks
};

// At another zoom or focus than that of the turns.
struct RecordedZoom {
  FocalAtRadius measured;
  Vector2d focal_deviation_px = Vector2d::Zero();
  HeldViews held;
};

struct RecordedTurns {
  std::vector<RecordedTurn> turns;
  std::vector<RecordedZoom> zooms;
  std::vector<std::string> left_out;  // stretches that tell nothing, each with why
};

// `board` needs the size of its squares. The zoom of the turns is the first one at which the scope was held for
// twelve seconds. Fails when the recording has no frames or no poses, or the scope was held at no turn for as long.
[[nodiscard]] Expected<RecordedTurns> turns_in_recording(
    const std::string& recording, const BoardWish& board, bool by_second_sensor,
    const std::function<void(std::uint64_t done, std::uint64_t all)>& progress);

[[nodiscard]] std::string text_of(const RecordedTurns& recorded);
[[nodiscard]] nlohmann::json json_of(const RecordedTurns& recorded);

}  // namespace perimap

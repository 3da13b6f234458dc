// A bench on which a set-up is measured: a board, a scope that a hand swings about it, a pointer, and the tracker that
// sees both. Everything is a function of the settings; nothing depends on time, threads or order of calls.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/board/board_pattern.hpp"
#include "drivers/standins/simulator/board_renderer.hpp"
#include "drivers/standins/simulator/hand_sway.hpp"
#include "drivers/standins/simulator/scope_setup.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// What is done on the bench.
enum class BenchAct : std::uint8_t {
  kBoard,      // the scope is swung about the board; the pointer's tip rests on its origin and is swung as well
  kStill,      // scope and pointer lie still; the camera is off
  kLandmarks,  // the pointer touches the landmarks of the patient's image one after the other; the camera is off
};

struct BenchSettings {
  BenchAct act = BenchAct::kBoard;
  BoardPattern board;
  std::uint64_t seed = 1;        // of motion and noise
  std::uint64_t setup_seed = 0;  // as SimulationSettings has it
  Duration duration = std::chrono::seconds(40);
  int width = 640;   // px
  int height = 480;  // px
  double frames_per_s = 15.0;
  double tracker_rate_hz = 100.0;
  Duration tracker_correlation{0};
  double swing = 1.0;  // how far the scope is swung, times the usual
  // Where the notch of the field stop is, which then leaves a round of the picture; the objective looks aside as the
  // scope is turned then (turned_setup()). None: all of the picture is seen, and the scope is as at 0.
  std::optional<double> notch_rad;
  double zoom = 1.0;  // of the picture and the field stop, likewise
  // In the order of their times: from then on the scope is turned in its camera head and zoomed, within two seconds,
  // until it is as said, and held so.
  struct Turn {
    Duration at{0};
    ScopeHeld to;
  };
  std::vector<Turn> turns;
  // A second tracked sensor, on the scope, tells how that is turned: the field stop lies outside the picture then.
  bool second_sensor = false;
  // The board has a tracked sensor of its own, and another hand holds it; the pointer rests on it all the same.
  bool board_is_held = false;
};

struct BenchLandmark {
  std::string name;
  Vector3d p_I = Vector3d::Zero();  // mm
};

class BenchScene {
 public:
  enum class Tool : std::uint8_t { kScope, kPointer, kSecondSensor, kBoard };

  // Errors name the setting that is out of range, in words of the command line.
  [[nodiscard]] static Expected<BenchScene> create(const BenchSettings& settings);

  [[nodiscard]] const BenchSettings& settings() const noexcept { return settings_; }
  // As at the start.
  [[nodiscard]] const ScopeSetup& setup() const noexcept { return setup_; }
  // As the scope is turned then.
  [[nodiscard]] ScopeSetup setup_at(Duration since) const noexcept;
  [[nodiscard]] Instant start() const noexcept { return start_; }
  // Those of the patient's image; the same whatever the act.
  [[nodiscard]] const std::vector<BenchLandmark>& landmarks() const noexcept { return landmarks_; }

  [[nodiscard]] std::span<const FrameStamp> frames() const noexcept { return frames_; }
  // Safe from several threads.
  void render(std::size_t index, std::span<std::uint8_t> image) const;

  // Of all tools at the same times, in order of their arrival.
  [[nodiscard]] std::size_t reading_count() const noexcept { return arrivals_.size(); }
  [[nodiscard]] TrackerSample reading(Tool tool, std::size_t index, const TrackerNoise& noise) const noexcept;

  // True poses, since the start; of the scope, the pointer and the board as if that were not moved.
  [[nodiscard]] Pose X_WC(Duration since) const noexcept;
  [[nodiscard]] Pose X_WT(Duration since) const noexcept;
  [[nodiscard]] const Pose& X_WB() const noexcept { return X_WB_; }

 private:
  explicit BenchScene(const BenchSettings& settings);

  // How the scope is held, and how often it was turned or zoomed until then; none while it is being turned.
  struct Turned {
    ScopeHeld held;
    std::optional<std::size_t> times;
  };
  [[nodiscard]] Turned turned_at(Duration since) const noexcept;
  [[nodiscard]] std::shared_ptr<const BoardRenderer> renderer_at(Duration since) const;

  void draw_landmarks();
  void time_devices();
  void draw_errors();
  [[nodiscard]] Vector3d touched_W(double t_s) const noexcept;
  [[nodiscard]] Pose true_pose(Tool tool, Duration since) const noexcept;
  // How a held board, and all that is about it, is elsewhere than at rest.
  [[nodiscard]] Pose X_WW(Duration since) const noexcept;

  // Of unit variance per axis.
  struct Error {
    Vector3d position = Vector3d::Zero();
    Vector3d rotation = Vector3d::Zero();
  };

  BenchSettings settings_;
  ScopeSetup unturned_;  // at a notch of 0 and a zoom of 1
  ScopeSetup setup_;
  Instant start_;
  Pose X_WB_;
  Matrix3d pointer_rest_ = Matrix3d::Identity();
  HandSway3 scope_turn_, scope_place_, pointer_turn_, board_turn_, board_place_;
  std::vector<BenchLandmark> landmarks_;
  // As it is held at first, and after each turn; none where the camera is off.
  std::vector<std::shared_ptr<const BoardRenderer>> renderers_;
  std::vector<FrameStamp> frames_;
  std::vector<Instant> times_;  // true, of each reading
  std::vector<Instant> arrivals_;
  std::vector<Error> errors_[4];  // of each tool
};

}  // namespace perimap

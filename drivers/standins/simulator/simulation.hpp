// A whole simulated session: a heart that beats to a real ECG, a hand-held scope, a pose tracker, and when each of
// their data would have arrived. Everything is a function of the settings; nothing depends on time, threads or order of
// calls.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/simulator/lens.hpp"
#include "drivers/standins/simulator/parallel_for.hpp"
#include "drivers/standins/simulator/procedure_view.hpp"
#include "drivers/standins/simulator/scene_renderer.hpp"
#include "drivers/standins/simulator/scope_path.hpp"
#include "drivers/standins/simulator/scope_setup.hpp"
#include "drivers/standins/simulator/simulation_settings.hpp"
#include "drivers/standins/simulator/tissue_texture.hpp"
#include "drivers/standins/simulator/view_obstacles.hpp"
#include "drivers/standins/truth/ground_truth.hpp"

namespace perimap {

class EcgScript;

// Norms in three dimensions: the standard deviation of one axis is 1 / sqrt(3) of them.
struct TrackerNoise {
  double position_rms_mm = 0.0;
  double rotation_rms_rad = 0.0;
};

class Simulation {
 public:
  struct Frame {
    FrameStamp stamp;
    Pose X_WC;
  };

  enum class Source : std::uint8_t { kCamera, kTracker, kEcg, kRespiration };
  struct Arrival {
    Instant arrival;
    Source source = Source::kCamera;
    std::uint32_t index = 0;  // into frames(), of tracker_sample(), into ecg(), respiration()
  };

  // Errors name the setting that is out of range, in words of the command line.
  [[nodiscard]] static Expected<Simulation> create(const SimulationSettings& settings,
                                                   const ParallelFor& parallel_for = serial_for);

  Simulation(Simulation&&) noexcept = default;
  Simulation& operator=(Simulation&&) = delete;
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;
  ~Simulation() = default;

  [[nodiscard]] const SimulationSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] Instant start() const noexcept { return start_; }
  // Stands for the recording's fixed epoch; the same for every recording, since nothing may depend on today.
  [[nodiscard]] std::int64_t utc_minus_monotonic_ns() const noexcept;
  // Both of a scope that is not turned: at a notch of 0 and a zoom of 1.
  [[nodiscard]] const ScopeLens& lens() const noexcept { return setup_.lens; }
  [[nodiscard]] const ScopeSetup& setup() const noexcept { return setup_; }
  // Camera frame C in the tracked sensor's frame S.
  [[nodiscard]] const Pose& hand_eye_X_SC() const noexcept { return setup_.X_SC; }
  [[nodiscard]] const GroundTruth& truth() const noexcept { return truth_; }
  [[nodiscard]] const ViewObstacles& obstacles() const noexcept { return obstacles_; }

  // Everything that arrives, in order of arrival; the order within a source is the order of its own stamps.
  [[nodiscard]] std::span<const Arrival> arrivals() const noexcept { return arrivals_; }
  [[nodiscard]] std::span<const Frame> frames() const noexcept { return frames_; }
  [[nodiscard]] std::span<const EcgBlock> ecg() const noexcept { return ecg_; }
  [[nodiscard]] std::span<const RespirationBlock> respiration() const noexcept { return respiration_; }
  [[nodiscard]] std::size_t tracker_sample_count() const noexcept { return tracker_stamps_.size(); }
  // A reading with this much noise; the same draw for any amount, so recordings of one rendering differ in scale alone.
  // While the tool is missing the pose is not a number.
  [[nodiscard]] TrackerSample tracker_sample(std::size_t index, const TrackerNoise& noise) const noexcept;

  // Of the second sensor at the same time, with errors of its own; where there is one.
  [[nodiscard]] TrackerSample second_sample(std::size_t index, const TrackerNoise& noise) const noexcept;

  // Of the patient's tool, likewise.
  [[nodiscard]] TrackerSample patient_sample(std::size_t index, const TrackerNoise& noise) const noexcept;

  // All that is true of a frame's camera, its lens as it was held then too.
  [[nodiscard]] CameraTruth camera_truth(const Frame& frame) const noexcept;

  // As it is held then; what is measured before the session is that of its start.
  [[nodiscard]] ScopeSetup setup_at(Duration since) const noexcept;
  // How the scope is held in its camera head then; with a field stop alone.
  [[nodiscard]] std::optional<ScopeHeld> held_at(Duration since) const noexcept;

  // Renders frames()[index] into width * height bytes. Safe from several threads, each with its own workspace.
  void render(std::size_t index, RenderWorkspace& workspace, std::span<std::uint8_t> image) const;

 private:
  struct TrackerStamp {
    Instant source_time;
    Instant arrival;
    std::size_t reads = 0;  // the stamp whose pose it gives: its own, but for a tracker that is stuck
    bool missing = false;
    Pose X_WS;                                   // true, but for what metal or electrosurgery makes of it
    Vector3d position_error = Vector3d::Zero();  // of unit variance per axis
    Vector3d rotation_error = Vector3d::Zero();
  };
  [[nodiscard]] static TrackerSample sample_of(const TrackerStamp& stamp, const TrackerStamp& reading,
                                               std::size_t index, const TrackerNoise& noise) noexcept;

  Simulation(SimulationSettings settings, Instant start, GroundTruth truth, ScopeSetup setup, Vector3d surface_W,
             const ScopePath& path);

  // Where the camera is, whatever its stamps say.
  [[nodiscard]] Pose X_WC_at(Duration since) const noexcept;
  // How often the scope has been turned until then, and whether it is being turned.
  [[nodiscard]] ScopeTurning turning_at(Duration since) const noexcept;
  [[nodiscard]] bool scope_turns() const noexcept;

  // The frame whose picture frames()[index] shows: its own, but for a camera that is stuck.
  [[nodiscard]] std::size_t pictured(std::size_t index) const noexcept;
  [[nodiscard]] FieldStop field_stop_at(Duration since) const noexcept;
  [[nodiscard]] FieldStop seen_field_stop_at(Duration since) const noexcept;
  [[nodiscard]] std::unique_ptr<const SceneRenderer> renderer_at(Duration since) const;

  // What the devices deliver, in the order of arrival at the end.
  void read_tracker();
  void read_second_sensor();
  void read_patient_tool();
  void read_ecg(const EcgScript& script);
  void read_respiration();
  void order_arrivals();

  SimulationSettings settings_;
  Instant start_;
  GroundTruth truth_;
  ScopeSetup setup_;
  ScopePath path_;
  ViewObstacles obstacles_;
  ProcedureView procedure_view_;
  Vector3d surface_W_;  // the point about which the scope moves; exposure is right there
  std::unique_ptr<const TissueTexture> texture_;
  std::vector<std::unique_ptr<const SceneRenderer>>
      renderers_;  // of each turn of the scope: before the first, after it ...
  std::vector<Frame> frames_;
  std::vector<TrackerStamp> tracker_stamps_;
  std::vector<TrackerStamp> second_stamps_;   // at the same times
  std::vector<TrackerStamp> patient_stamps_;  // likewise
  std::vector<EcgBlock> ecg_;
  std::vector<RespirationBlock> respiration_;
  std::vector<Arrival> arrivals_;
};

}  // namespace perimap

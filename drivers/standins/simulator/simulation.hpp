// A whole simulated session: a heart that beats to a real ECG, a hand-held scope, a pose tracker, and when each of
// their data would have arrived. Everything is a function of the settings; nothing depends on time, threads or order of
// calls.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/simulator/lens.hpp"
#include "drivers/standins/simulator/parallel_for.hpp"
#include "drivers/standins/simulator/scene_renderer.hpp"
#include "drivers/standins/simulator/scope_path.hpp"
#include "drivers/standins/simulator/scope_setup.hpp"
#include "drivers/standins/simulator/tissue_texture.hpp"
#include "drivers/standins/simulator/view_obstacles.hpp"
#include "drivers/standins/truth/ground_truth.hpp"

namespace perimap {

struct EcgRecord;

struct SimulationSettings {
  std::uint64_t seed = 1;
  std::uint64_t setup_seed = 0;  // draws scope, tracker and sensor (drawn_setup()); 0: the usual ones
  Duration duration = std::chrono::seconds(60);
  int width = 640;   // px
  int height = 480;  // px
  double frames_per_s = 30.0;
  std::string ecg_record = "100";
  std::optional<Duration> ecg_start;  // of the session, from the record's start; chosen by the seed when not given
  MotionLaw law = MotionLaw::kLinear;
  double respiration_mm = 0.0;
  Duration respiration_period = std::chrono::seconds(4);
  bool respiration_channel = false;  // a volume channel tells of the breathing
  double tracker_rate_hz = 100.0;
  // Time in which the tracker's error falls to 1/e of what it was (Gauss-Markov); 0: new at each reading.
  Duration tracker_correlation{0};
  double tracker_dropouts_per_min = 3.0;
  // From the session's start to begin, and for how long.
  struct Stretch {
    Duration begin, length;
  };
  std::vector<Stretch> ecg_off;  // the electrode is off, and the device says so
  // The device gives its last reading, or picture, again and again, with stamps and numbers that go on.
  std::vector<Stretch> tracker_stuck;
  std::vector<Stretch> camera_stuck;
  int camera_repeats = 1;  // each picture comes so often, as of a camera that is slower than its stamps say
  // What makes seeing hard.
  double scope_sweep = 1.0;     // see ScopePath
  double exposure_share = 0.0;  // of the frame period, about the capture: motion blur
  bool instrument = false;      // see ViewObstacles
  int glints = 0;
  double smoke = 0.0;
  // A field stop leaves a round of the picture: how the scope is held in its camera head at first, and to where it is
  // turned and zoomed during the session. The objective looks aside as it is turned (turned_setup()). None: all of the
  // picture is seen.
  std::optional<ScopeHeld> held;
  struct Turn {
    Duration at;  // begins, since the start
    ScopeHeld to;
    Duration length = std::chrono::seconds(1);
  };
  std::optional<Turn> turn;
  // A second tracked sensor, on the scope, tells of the turn: the field stop lies outside the picture then.
  bool second_sensor = false;
  std::vector<Stretch> second_lost;   // the tracker does not see it
  std::vector<Stretch> second_stuck;  // its last reading comes again and again
  bool scope_calibrated =
      true;  // the recording says what follows from a turn, as `perimap calibrate scope` measures it
};

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
    Pose X_WS;                                   // true
    Vector3d position_error = Vector3d::Zero();  // of unit variance per axis
    Vector3d rotation_error = Vector3d::Zero();
  };
  [[nodiscard]] static TrackerSample sample_of(const TrackerStamp& stamp, const TrackerStamp& reading,
                                               std::size_t index, const TrackerNoise& noise) noexcept;

  Simulation(SimulationSettings settings, Instant start, GroundTruth truth, ScopeSetup setup, Vector3d surface_W,
             const ScopePath& path);

  // The frame whose picture frames()[index] shows: its own, but for a camera that is stuck.
  [[nodiscard]] std::size_t pictured(std::size_t index) const noexcept;
  [[nodiscard]] FieldStop field_stop_at(Duration since) const noexcept;
  [[nodiscard]] FieldStop seen_field_stop_at(Duration since) const noexcept;
  [[nodiscard]] std::unique_ptr<const SceneRenderer> renderer_at(Duration since) const;

  // What the devices deliver, in the order of arrival at the end.
  void read_tracker();
  void read_second_sensor();
  void read_ecg(const EcgRecord& record, std::uint32_t first_sample);
  void read_respiration();
  void order_arrivals();

  SimulationSettings settings_;
  Instant start_;
  GroundTruth truth_;
  ScopeSetup setup_;
  ScopePath path_;
  ViewObstacles obstacles_;
  Vector3d surface_W_;  // the point about which the scope moves; exposure is right there
  std::unique_ptr<const TissueTexture> texture_;
  std::unique_ptr<const SceneRenderer> renderer_;
  std::unique_ptr<const SceneRenderer> turned_renderer_;  // after the turn, if there is one
  std::vector<Frame> frames_;
  std::vector<TrackerStamp> tracker_stamps_;
  std::vector<TrackerStamp> second_stamps_;  // at the same times
  std::vector<EcgBlock> ecg_;
  std::vector<RespirationBlock> respiration_;
  std::vector<Arrival> arrivals_;
};

}  // namespace perimap

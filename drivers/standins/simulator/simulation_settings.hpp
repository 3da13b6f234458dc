// What a simulated session is made from.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/procedure/procedure.hpp"
#include "drivers/standins/simulator/field_stop.hpp"
#include "drivers/standins/simulator/look.hpp"
#include "drivers/standins/simulator/played_trace.hpp"
#include "drivers/standins/truth/heart_motion.hpp"

namespace perimap {

struct SimulationSettings {
  std::uint64_t seed = 1;
  std::uint64_t setup_seed = 0;  // draws scope, tracker and sensor (drawn_setup()); 0: the usual ones
  Duration duration = std::chrono::seconds(60);
  int width = 640;   // px
  int height = 480;  // px
  double frames_per_s = 30.0;
  std::string ecg_record = "100";
  std::optional<Duration> ecg_start;  // of the session, from the record's start; chosen by the seed when not given
  // A recorded heart, whose motion and beats take the place of the mesh's and the ECG record's; none: null.
  std::shared_ptr<const HeartTrace> trace;
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
  // The last second of the ECG comes again and again; of the pictures the last two seconds.
  std::vector<Stretch> ecg_loops;
  std::vector<Stretch> camera_loops;
  int camera_repeats = 1;  // each picture comes so often, as of a camera that is slower than its stamps say
  // What makes seeing hard.
  Look look = Look::kRendered;
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
  bool patient_tool = false;          // a tool that is fixed to the organ, and tracked too
  std::vector<Stretch> second_lost;   // the tracker does not see it
  std::vector<Stretch> second_stuck;  // its last reading comes again and again
  bool scope_calibrated =
      true;  // the recording says what follows from a turn, as `perimap calibrate scope` measures it
  // What happens in it; nothing, or a script of events. Sessions with one may be longer than the ECG record.
  Procedure procedure;
};

// The error names the setting that is out of range, in words of the command line.
[[nodiscard]] Expected<void> check(const SimulationSettings& settings);

}  // namespace perimap

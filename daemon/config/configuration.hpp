// What the daemon can be told. One plain struct per component; every member has its default here and its limits in
// configuration_keys.cpp. Members of a file that is loaded over a base replace the base's, key by key.
#pragma once

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/estimation/precision.hpp"
#include "core/estimation/update_settings.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/rr_predictor.hpp"
#include "core/time/instant.hpp"
#include "drivers/ecg/modem_line.hpp"
#include "drivers/image/pixel_format.hpp"

namespace perimap {

struct SourceConfiguration {
  std::string name = "perimapd";        // the key `source` of every published sample
  std::string world_frame = "tracker";  // published as frame_id

  bool operator==(const SourceConfiguration&) const = default;
};

struct ReplayConfiguration {
  std::optional<std::filesystem::path> recording;  // absolute, or relative to the working directory, once loaded

  bool operator==(const ReplayConfiguration&) const = default;
};

struct CameraConfiguration {
  std::optional<std::string> device;                  // as parse_camera_endpoint() takes it
  std::optional<PixelFormat> format;                  // none: the camera's best
  int width = 0;                                      // 0: the calibration's
  int height = 0;                                     // likewise
  int input = -1;                                     // of a capture card; -1: as it is
  double frame_rate_hz = 0.0;                         // 0: the camera's
  double exposure_ms = 0.0;                           // 0: as it is
  double gain = -1.0;                                 // -1: as it is
  Duration delay{0};                                  // of the picture when it is stamped
  bool loop = true;                                   // a video begins anew at its end
  bool repeats_allowed = false;                       // pictures may come again within seconds
  std::optional<std::filesystem::path> calibration;   // none: the recording's own attachment
  std::optional<std::filesystem::path> turned_scope;  // of a scope that is turned in its camera head
  std::optional<std::filesystem::path> playback;      // a recording whose frames stand in for a camera
  double playback_start_s = 0.0;                      // CLOCK_MONOTONIC; 0: when the daemon starts

  [[nodiscard]] bool plays_video_in_loop() const { return device && device->starts_with("video:") && loop; }
  bool operator==(const CameraConfiguration&) const = default;
};

struct TrackerConfiguration {
  enum class Protocol { kNone, kNdi, kIgtl };

  Protocol protocol = Protocol::kNone;
  std::optional<std::string> port;                                // as parse_endpoint() takes it
  std::optional<std::string> sensor;                              // NDI: port handle; OpenIGTLink: name
  std::optional<std::string> reference;                           // likewise
  std::optional<std::string> pointer;                             // likewise
  std::optional<std::string> second_sensor;                       // likewise
  std::optional<std::string> patient_tool;                        // likewise
  std::vector<std::string> instruments;                           // likewise
  std::optional<std::filesystem::path> sensor_definition;         // NDI, uploaded
  std::optional<std::filesystem::path> reference_definition;      // NDI, uploaded
  std::optional<std::filesystem::path> pointer_definition;        // NDI, uploaded
  std::optional<std::filesystem::path> second_sensor_definition;  // NDI, uploaded
  std::optional<std::filesystem::path> patient_tool_definition;   // NDI, uploaded
  std::vector<std::filesystem::path> instrument_definitions;      // NDI, uploaded; beside `instruments`
  std::optional<std::filesystem::path> pointer_calibration;       // its tip
  std::vector<std::filesystem::path> instrument_calibrations;     // tips, each of the instrument that it names
  bool igtl_stamps_by_arrival = false;                            // not by the server's stamps
  double frame_rate_hz = 60.0;                                    // of NDI's frame numbers
  double translation_IW_mm[3] = {0.0, 0.0, 0.0};                  // registration X_IW
  double rotation_IW_wxyz[4] = {1.0, 0.0, 0.0, 0.0};              // registration X_IW, unit quaternion
  double position_deviation_mm = 0.0;                             // RMS of the 3-D norm
  double rotation_deviation_rad = 0.0;                            // RMS of the 3-D norm
  Duration error_correlation{0};                                  // in which the error falls to 1/e; 0: white
  Duration time_offset{0};  // added to the tracker's stamps to get the camera's time
  Duration maximum_extrapolation = std::chrono::milliseconds(20);
  double translation_SC_mm[3] = {0.0, 0.0, 0.0};      // hand-eye X_SC
  double rotation_SC_wxyz[4] = {1.0, 0.0, 0.0, 0.0};  // hand-eye X_SC, unit quaternion
  std::optional<std::string> hand_eye_date;           // on which it was measured, as calibration_date_of() takes it
  std::optional<std::string> hand_eye_sensor;         // of which it was

  bool operator==(const TrackerConfiguration&) const = default;
};

struct SetupConfiguration {
  double maximum_age_days = 30.0;  // of calibrations; 0: any

  bool operator==(const SetupConfiguration&) const = default;
};

struct EcgConfiguration {
  enum class Protocol { kNone, kMedlab, kBitalino, kCyton, kCan };

  Protocol protocol = Protocol::kNone;
  std::optional<std::string> port;  // as parse_endpoint() takes it
  int channel = 0;                  // of BITalino and Cyton; 0: the protocol's usual one
  int second_channel = 0;           // of these, with a second lead; 0: none
  double count_mV = 0.0;            // of Medlab and CAN; 0: the protocol's usual scale
  double can_sample_rate_hz = 360.0;
  int can_identifier = 0x2E0;
  bool can_extended = false;
  bool repeats_allowed = false;               // samples may come again within seconds
  bool r_trigger = false;                     // R peaks come from a trigger line, not from the samples
  std::optional<std::string> r_trigger_port;  // path of the serial port with that line
  ModemLine r_trigger_line = ModemLine::kCarrierDetect;
  bool r_trigger_rising = true;  // the line goes on at the R peak; otherwise off
  Duration r_trigger_delay{0};
  Duration r_trigger_deviation = std::chrono::milliseconds(4);

  bool operator==(const EcgConfiguration&) const = default;
};

struct PhaseConfiguration {
  std::optional<PhaseLaw> law;                    // none: by what the images show
  Duration lost_after = std::chrono::seconds(3);  // without an R peak
  bool from_image = true;
  Duration image_alone = std::chrono::seconds(10);  // without the ECG
  RrMethod predictor = RrMethod::kAutoregressive;

  bool operator==(const PhaseConfiguration&) const = default;
};

struct RespirationConfiguration {
  bool enabled = false;
  bool channel = false;
  int device_channel = 0;  // input of the ECG device; 0: none
  Duration shortest_period = std::chrono::seconds(2);
  Duration longest_period = std::chrono::seconds(10);
  double displacement_deviation_mm = 5.0;  // per axis, reckoned with while the phase is not known

  bool operator==(const RespirationConfiguration&) const = default;
};

struct PipelineConfiguration {
  enum class Release { kFrame, kClock, kBoth };

  Release release = Release::kFrame;
  double clock_rate_hz = 100.0;                      // of the clock's releases
  Duration latency = std::chrono::milliseconds(50);  // L: release minus capture
  Duration lead{0};                                  // valid time minus release
  Duration budget = std::chrono::milliseconds(12);   // computing time kept free before the release
  bool shedding = true;
  int workers = 2;
  Duration adoption_delay = std::chrono::milliseconds(500);  // D: from a housekeeping request to its adoption

  bool operator==(const PipelineConfiguration&) const = default;
};

struct FeaturesConfiguration {
  int maximum = 200;
  Duration detection_interval = std::chrono::milliseconds(333);
  double minimum_distance_px = 18.0;

  bool operator==(const FeaturesConfiguration&) const = default;
};

struct EstimationConfiguration {
  int harmonics = 8;  // H, cardiac
  Precision precision = Precision::kDouble;
  int start_observations = 60;
  std::vector<double> start_depths_mm = {50.0, 90.0, 160.0};
  double pixel_deviation_px = 0.3;
  UpdateMethod update = UpdateMethod::kLevenbergMarquardt;
  double step_factor = 1.0;  // the paper's gamma, for Gauss-Newton
  int iterations = 5;
  double tolerance = 1e-2;
  double gate_chi2 = 23.0;
  double prior_dc_deviation_mm = 40.0;
  double prior_harmonic_deviation_mm = 4.0;  // of harmonic 1; harmonic k has this / k^2
  double converged_deviation_mm = 1.0;       // 0, which recordings may hold: 1 mm

  bool operator==(const EstimationConfiguration&) const = default;
};

// 95 % of errors are to be within so much.
struct UseConfiguration {
  double display_mm = 5.0;
  double measure_mm = 3.0;
  double contact_mm = 2.0;

  bool operator==(const UseConfiguration&) const = default;
};

// A preoperative model of the organ, in the frame that poses are registered to.
struct ModelConfiguration {
  std::optional<std::filesystem::path> file;  // none: the surface's topology is its own
  double unit_mm = 1.0;                       // of its coordinates
  double phase = 0.75;                        // when it was imaged, as a share of the heart's cycle
  double shape_mm = 1.5;                      // what its shape may be off by along its normals
  double registration_mm = 1.0;               // what its place at the organ may be off by in each direction
  // The same mesh at other phases, so that it moves by itself; none: it is of one phase.
  std::vector<std::filesystem::path> other_files;
  std::vector<double> other_phases;  // of each file, as `phase`

  bool operator==(const ModelConfiguration&) const = default;
};

struct RealtimeConfiguration {
  int priority = 0;  // SCHED_FIFO; 0: not requested
  bool lock_memory = true;
  std::vector<int> cpus;  // empty: any

  bool operator==(const RealtimeConfiguration&) const = default;
};

struct DdsConfiguration {
  bool enabled = true;
  int domain = 0;
  Duration surface_deadline = std::chrono::milliseconds(200);  // offered period of `surface`; 0: none
  Duration surface_lifespan = std::chrono::milliseconds(200);  // 0: none
  Duration surface_model_interval = std::chrono::milliseconds(500);
  double maximum_MB_per_s = 50.0;                 // of surfaces and surface models to one reader, 1e6 bytes
  std::optional<std::filesystem::path> security;  // a folder of keys; none: without DDS Security

  bool operator==(const DdsConfiguration&) const = default;
};

struct RecordingConfiguration {
  bool record = false;
  std::string folder = ".";          // from the configuration's folder
  int memory_MB = 256;               // for frames on their way to the disk
  std::optional<std::string> group;  // may read them beside their owner

  bool operator==(const RecordingConfiguration&) const = default;
};

struct StatusConfiguration {
  Duration interval = std::chrono::seconds(1);

  bool operator==(const StatusConfiguration&) const = default;
};

struct LogConfiguration {
  enum class Level { kTrace, kDebug, kInfo, kWarning, kError };

  Level level = Level::kInfo;

  bool operator==(const LogConfiguration&) const = default;
};

struct ControlConfiguration {
  std::optional<std::string> socket;  // absolute; none: $RUNTIME_DIRECTORY/control of the service

  bool operator==(const ControlConfiguration&) const = default;
};

struct CheckpointConfiguration {
  std::optional<std::string> file;  // absolute; none: $STATE_DIRECTORY/checkpoint of the service
  Duration interval = std::chrono::seconds(2);
  Duration maximum_age = std::chrono::seconds(120);

  bool operator==(const CheckpointConfiguration&) const = default;
};

struct BlackBoxConfiguration {
  std::optional<std::string> folder;  // absolute; none: $STATE_DIRECTORY/black-box of the service
  Duration ring = std::chrono::minutes(5);
  Duration keep = std::chrono::hours(24 * 30);
  int maximum_MB = 1024;  // of all of it, 1e6 bytes

  bool operator==(const BlackBoxConfiguration&) const = default;
};

struct Configuration {
  SourceConfiguration source;
  ReplayConfiguration replay;
  CameraConfiguration camera;
  TrackerConfiguration tracker;
  SetupConfiguration setup;
  EcgConfiguration ecg;
  PhaseConfiguration phase;
  RespirationConfiguration respiration;
  PipelineConfiguration pipeline;
  FeaturesConfiguration features;
  EstimationConfiguration estimation;
  UseConfiguration use;
  ModelConfiguration model;
  RealtimeConfiguration realtime;
  DdsConfiguration dds;
  RecordingConfiguration recording;
  StatusConfiguration status;
  LogConfiguration log;
  ControlConfiguration control;
  CheckpointConfiguration checkpoint;
  BlackBoxConfiguration blackbox;

  bool operator==(const Configuration&) const = default;
};

// From one of the clock's releases to the next, whether or not it releases.
[[nodiscard]] inline Duration clock_period(const PipelineConfiguration& pipeline) noexcept {
  return Duration(std::llround(1e9 / pipeline.clock_rate_hz));
}

}  // namespace perimap

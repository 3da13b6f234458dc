#include "drivers/standins/session/session_writer.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "drivers/calibration/turned_scope_file.hpp"
#include "drivers/file/whole_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/foxglove_pose.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "drivers/recording/sensor_messages.hpp"
#include "drivers/standins/procedure/procedure_text.hpp"
#include "drivers/standins/session/calibrated_scope.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"
#include "drivers/standins/simulator/simulated_tool.hpp"
#include "drivers/standins/truth/truth_messages.hpp"

namespace perimap {
namespace {

constexpr double kRadians_per_degree = std::numbers::pi / 180.0;

const char* law_name(MotionLaw law) noexcept {
  switch (law) {
    case MotionLaw::kWarped:
      return "warped";
    case MotionLaw::kTimeLocked:
      return "time-locked";
    case MotionLaw::kLinear:
      break;
  }
  return "linear";
}

std::string description(const Simulation& simulation, const TrackerNoise& noise) {
  const SimulationSettings& s = simulation.settings();
  const double correlation_s = to_seconds(s.tracker_correlation);
  return fmt::format(
      "simulated heart: seed {}, {} s, {}x{} at {} Hz, ECG record {}, motion {}, respiration {} mm, tracker {} Hz with "
      "{} mm and {:.3g} deg RMS{}{}{}",
      s.seed, to_seconds(s.duration), s.width, s.height, s.frames_per_s, s.trace ? "made" : s.ecg_record,
      s.trace ? "of a trace" : law_name(s.law), s.respiration_mm, s.tracker_rate_hz, noise.position_rms_mm,
      noise.rotation_rms_rad / kRadians_per_degree,
      correlation_s > 0.0 ? fmt::format(", correlated over {} s", correlation_s) : "",
      s.look == Look::kRendered ? "" : fmt::format(", look {}", name_of(s.look)),
      s.procedure.empty() ? "" : fmt::format(", a procedure of {} events", s.procedure.events.size()));
}

// One recording under way.
class SessionWriter {
 public:
  static Expected<std::unique_ptr<SessionWriter>> create(const Simulation& simulation,
                                                         const SimulatedRecording& recording) {
    auto file = WholeFile::create(recording.path, WholeFile::Name::kPart, WholeFile::Readers::kOwner);
    if (!file) return tl::unexpected(file.error());
    auto sink = create_file(file->path().string(), recording.path.string());
    if (!sink) return tl::unexpected(sink.error());
    auto writer = RecordingWriter::create(*std::move(sink));
    if (!writer) return tl::unexpected(writer.error());
    auto session =
        std::unique_ptr<SessionWriter>(new SessionWriter(simulation, recording, *std::move(file), *std::move(writer)));
    if (const auto begun = session->begin(); !begun) return tl::unexpected(begun.error());
    return session;
  }

  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;
  ~SessionWriter() = default;

  // What arrives, after the events that have begun by then. Of a frame without pixels there is the truth alone.
  Expected<void> write(const Simulation::Arrival& arrival, std::span<const std::uint8_t> pixels) {
    if (auto written = write_events(arrival.arrival); !written) return written;
    switch (arrival.source) {
      case Simulation::Source::kCamera:
        return write_frame(simulation_.frames()[arrival.index], pixels);
      case Simulation::Source::kTracker:
        return write_readings(arrival.index);
      case Simulation::Source::kEcg:
        return write_ecg(simulation_.ecg()[arrival.index]);
      case Simulation::Source::kRespiration:
        break;
    }
    return write_respiration(simulation_.respiration()[arrival.index]);
  }

  Expected<void> finish() {
    if (auto written = write_events(Instant::max()); !written) return written;
    return writer_.finish().and_then([this] { return file_.finish(); });
  }

 private:
  SessionWriter(const Simulation& simulation, const SimulatedRecording& recording, WholeFile file,
                RecordingWriter writer)
      : simulation_(simulation), recording_(recording), file_(std::move(file)), writer_(std::move(writer)) {
    if (recording_.tool) probe_.emplace(simulation_);
  }

  Expected<void> write_frame(const Simulation::Frame& frame, std::span<const std::uint8_t> pixels) {
    if (!pixels.empty()) {
      if (auto written = write_picture(frame.stamp, pixels); !written) return written;
    }
    const auto truth = to_truth_camera(simulation_.camera_truth(frame));
    return writer_.write(truth_camera_, truth, frame.stamp.arrival, frame.stamp.capture,
                         static_cast<std::uint32_t>(frame.stamp.sequence));
  }

  Expected<void> write_picture(const FrameStamp& stamp, std::span<const std::uint8_t> pixels) {
    const int width = simulation_.settings().width;
    const GreyImage image{pixels.data(), width, simulation_.settings().height, width};
    const auto raw = borrow_raw_image(image, stamp.capture, kCameraFrame, packed_);
    return writer_.write(image_, raw, stamp.arrival, stamp.capture, static_cast<std::uint32_t>(stamp.sequence));
  }

  // Of all tools, in the order in which they are read.
  Expected<void> write_readings(std::size_t index) {
    const TrackerNoise& noise = recording_.noise;
    return write_tracker(simulation_.tracker_sample(index, noise))
        .and_then([&]() -> Expected<void> {
          if (!simulation_.settings().second_sensor) return {};
          return write_pose(second_, simulation_.second_sample(index, noise));
        })
        .and_then([&]() -> Expected<void> {
          if (!simulation_.settings().patient_tool) return {};
          return write_pose(patient_, simulation_.patient_sample(index, noise));
        })
        .and_then([&]() -> Expected<void> {
          if (!probe_) return {};
          return write_probe(index);
        });
  }

  Expected<void> write_probe(std::size_t index) {
    const TrackerSample sample = probe_->sample(index, recording_.noise);
    const ToolTruth& truth = probe_->truth(index);
    const perimap_TruthTool message{to_ns(truth.time),
                                    {truth.tip_W_mm.x(), truth.tip_W_mm.y(), truth.tip_W_mm.z()},
                                    truth.distance_mm,
                                    truth.touches};
    return write_pose(probe_channel_, sample).and_then([&] {
      return writer_.write(truth_probe_, message, sample.arrival, sample.source_time, sample.device_frame);
    });
  }

  Expected<void> write_pose(ChannelId channel, const TrackerSample& sample) {
    return writer_.write(channel, to_tracker_pose(sample), sample.arrival, sample.source_time, sample.device_frame);
  }

  Expected<void> write_tracker(const TrackerSample& sample) {
    auto written = write_pose(tracker_, sample);
    if (!written || sample.state != ToolState::kOk) return written;
    const auto viewer = borrow_pose_in_frame(sample.X_WS, sample.source_time, kWorldFrame);
    return writer_.write(viewer_, viewer, sample.arrival, sample.source_time, sample.device_frame);
  }

  Expected<void> write_ecg(const EcgBlock& block) {
    const perimap_EcgSamples message = borrow_ecg_samples(block);
    return writer_.write(ecg_, message, block.arrival, block.first_sample_time, block.device_sequence);
  }

  Expected<void> write_respiration(const RespirationBlock& block) {
    const perimap_RespirationSamples message = borrow_respiration_samples(block);
    return writer_.write(respiration_, message, block.arrival, block.first_sample_time, block.device_sequence);
  }

  // The events that have begun by then.
  Expected<void> write_events(Instant until) {
    const std::vector<ProcedureEvent>& events = simulation_.settings().procedure.events;
    for (; events_written_ < events.size(); ++events_written_) {
      const ProcedureEvent& event = events[events_written_];
      const Instant begin = simulation_.start() + event.at;
      if (begin > until) break;
      std::string kind(kind_of(event.what)), words = words_of(event);
      const perimap_TruthEvent message{kind.data(), words.data(), to_ns(begin),
                                       to_ns(simulation_.start() + event.end()), hides_the_organ(event.what)};
      const auto number = static_cast<std::uint32_t>(events_written_);
      if (auto written = writer_.write(truth_event_, message, begin, begin, number); !written) return written;
    }
    return {};
  }

  Expected<void> attach(std::string_view name, std::string_view media_type, const std::string& text) {
    return writer_.write_attachment(name, media_type, std::as_bytes(std::span(text)));
  }

  Expected<void> begin() {
    Expected<ChannelId> info = writer_.add_channel<perimap_RecordingInfo>(channels::kRecordingInfo);
    Expected<ChannelId> mesh = writer_.add_channel<perimap_TruthMesh>(channels::kTruthMesh);
    Expected<ChannelId> motion = writer_.add_channel<perimap_TruthMotion>(channels::kTruthMotion);
    Expected<ChannelId> truth_camera = writer_.add_channel<perimap_TruthCamera>(channels::kTruthCamera);
    Expected<ChannelId> image = writer_.add_channel<foxglove_RawImage>(channels::kCameraImage);
    Expected<ChannelId> tracker = writer_.add_channel<perimap_TrackerPose>(channels::kTrackerPose);
    Expected<ChannelId> viewer = writer_.add_channel<foxglove_PoseInFrame>(channels::kTrackerViewer);
    Expected<ChannelId> ecg = writer_.add_channel<perimap_EcgSamples>(channels::kEcgSamples);
    for (const auto* channel : {&info, &mesh, &motion, &truth_camera, &image, &tracker, &viewer, &ecg})
      if (!*channel) return tl::unexpected(channel->error());
    truth_camera_ = *truth_camera;
    image_ = *image;
    tracker_ = *tracker;
    viewer_ = *viewer;
    ecg_ = *ecg;
    if (simulation_.settings().second_sensor) {
      const auto second = writer_.add_channel<perimap_TrackerPose>(channels::kSecondSensor);
      if (!second) return tl::unexpected(second.error());
      second_ = *second;
    }
    if (simulation_.settings().patient_tool) {
      const auto patient = writer_.add_channel<perimap_TrackerPose>(channels::kPatientTool);
      if (!patient) return tl::unexpected(patient.error());
      patient_ = *patient;
    }
    if (simulation_.settings().respiration_channel) {
      const auto respiration = writer_.add_channel<perimap_RespirationSamples>(channels::kRespirationSamples);
      if (!respiration) return tl::unexpected(respiration.error());
      respiration_ = *respiration;
    }

    if (auto begun = begin_probe(); !begun) return begun;
    if (auto begun = begin_procedure(); !begun) return begun;
    if (auto begun = begin_trace(); !begun) return begun;

    std::string generator = fmt::format("perimap simulate {}", PERIMAP_VERSION);
    std::string text = description(simulation_, recording_.noise);
    std::string world = kWorldFrame;
    const perimap_RecordingInfo facts{generator.data(), text.data(), simulation_.utc_minus_monotonic_ns(),
                                      world.data()};
    std::vector<std::int64_t> r_peaks_ns;
    const auto truth_mesh = borrow_truth_mesh(simulation_.truth().mesh());
    const auto truth_motion = borrow_truth_motion(simulation_.truth().motion(), r_peaks_ns);
    const Instant start = simulation_.start();
    return attach_set_up()
        .and_then([&] { return writer_.write(*info, facts, start, start, 0); })
        .and_then([&] { return writer_.write(*mesh, truth_mesh, start, start, 0); })
        .and_then([&] { return writer_.write(*motion, truth_motion, start, start, 0); });
  }

  Expected<void> attach_set_up() {
    if (!recording_.set_up_told) return {};
    return attach(attachments::kCalibration, "application/yaml", simulation_.setup_at(Duration(0)).lens.opencv_yaml())
        .and_then([&] {
          return attach(attachments::kConfiguration, "application/toml",
                        simulated_configuration(simulation_, recording_.noise));
        })
        .and_then([&] { return attach_turned_scope(); });
  }

  Expected<void> begin_probe() {
    if (!probe_) return {};
    const std::string name = "instrument/" + SimulatedTool::kName;
    const auto poses = writer_.add_channel<perimap_TrackerPose>(std::string(channels::kTrackedTools) + name);
    if (!poses) return tl::unexpected(poses.error());
    const auto truth = writer_.add_channel<perimap_TruthTool>(std::string(channels::kTruthTool) + name);
    if (!truth) return tl::unexpected(truth.error());
    probe_channel_ = *poses;
    truth_probe_ = *truth;
    if (!recording_.set_up_told) return {};
    return attach(std::string(attachments::kTips) + name + ".json", "application/json", SimulatedTool::calibration());
  }

  // Its script, and where it moves the organ; its events follow in their time.
  Expected<void> begin_procedure() {
    const Procedure& procedure = simulation_.settings().procedure;
    if (procedure.empty()) return {};
    const auto organ = writer_.add_channel<perimap_TruthProcedure>(channels::kTruthProcedure);
    if (!organ) return tl::unexpected(organ.error());
    const auto event = writer_.add_channel<perimap_TruthEvent>(channels::kTruthEvent);
    if (!event) return tl::unexpected(event.error());
    truth_event_ = *event;
    ProcedureBuffers buffers;
    const auto message = borrow_truth_procedure(simulation_.truth(), buffers);
    const Instant start = simulation_.start();
    return writer_.write(*organ, message, start, start, 0).and_then([&] {
      return attach(attachments::kProcedure, "application/toml", to_toml(procedure));
    });
  }

  // What moves the surface, where a recorded trace does.
  Expected<void> begin_trace() {
    const SurfaceTrace& trace = simulation_.truth().trace();
    if (trace.empty()) return {};
    const auto channel = writer_.add_channel<perimap_TruthTrace>(channels::kTruthTrace);
    if (!channel) return tl::unexpected(channel.error());
    TraceBuffers buffers;
    const auto message = borrow_truth_trace(trace, buffers);
    return writer_.write(*channel, message, simulation_.start(), simulation_.start(), 0);
  }

  Expected<void> attach_turned_scope() {
    const auto scope = calibrated_scope(simulation_);
    if (!scope) return tl::unexpected(scope.error());
    if (!*scope) return {};
    return attach(attachments::kTurnedScope, "application/json", format_turned_scope(**scope));
  }

  static inline const std::string kCameraFrame = "camera";
  static inline const std::string kWorldFrame = "tracker";

  const Simulation& simulation_;
  SimulatedRecording recording_;
  WholeFile file_;  // goes after what writes to it
  RecordingWriter writer_;
  std::size_t events_written_ = 0;
  ChannelId truth_event_;
  ChannelId image_, truth_camera_, tracker_, second_, patient_, viewer_, ecg_, respiration_;
  ChannelId probe_channel_, truth_probe_;
  std::optional<SimulatedTool> probe_;  // where there is one
  std::vector<std::uint8_t> packed_;
};

}  // namespace

std::string simulated_configuration(const Simulation& simulation, const TrackerNoise& noise) {
  const Pose X_SC = simulation.setup_at(Duration(0)).X_SC;
  double q[4];
  rotation_to_wxyz(X_SC.R, q);
  const double correlation_s = to_seconds(simulation.settings().tracker_correlation);
  const double offset_ms = 1e3 * to_seconds(simulation.setup().tracker_offset);
  return fmt::format(
      "version = 1\n\n"
      "[tracker]\n"
      "position_deviation_mm = {:#}\n"
      "rotation_deviation_deg = {:#}\n"
      "{}{}"
      "hand_eye_translation_SC_mm = [{:#}, {:#}, {:#}]\n"
      "hand_eye_rotation_SC_wxyz = [{:#}, {:#}, {:#}, {:#}]\n\n"
      "{}",
      noise.position_rms_mm, noise.rotation_rms_rad / kRadians_per_degree,
      correlation_s > 0.0 ? fmt::format("error_correlation_s = {:#}\n", correlation_s) : "",
      offset_ms > 0.0 ? fmt::format("time_offset_ms = {:#}\n", offset_ms) : "", X_SC.t.x(), X_SC.t.y(), X_SC.t.z(),
      q[0], q[1], q[2], q[3], simulation.settings().respiration_mm > 0.0 ? "\n[respiration]\nenabled = true\n" : "");
}

Expected<bool> write_simulation(const Simulation& simulation, const std::vector<SimulatedRecording>& recordings,
                                unsigned threads, const std::function<bool(std::uint64_t frames)>& progress) {
  std::vector<std::unique_ptr<SessionWriter>> writers;
  for (const SimulatedRecording& recording : recordings) {
    auto writer = SessionWriter::create(simulation, recording);
    if (!writer) return tl::unexpected(writer.error());
    writers.push_back(*std::move(writer));
  }
  FrameRenderer frames(simulation, threads);
  for (const Simulation::Arrival& arrival : simulation.arrivals()) {
    const bool is_frame = arrival.source == Simulation::Source::kCamera;
    const std::span<const std::uint8_t> pixels = is_frame ? frames.next() : std::span<const std::uint8_t>();
    for (const auto& writer : writers) {
      if (auto written = writer->write(arrival, pixels); !written) return tl::unexpected(written.error());
    }
    if (is_frame && !progress(arrival.index + 1)) return false;
  }
  for (const auto& writer : writers)
    if (auto done = writer->finish(); !done) return tl::unexpected(done.error());
  return true;
}

Expected<void> write_without_pictures(const Simulation& simulation, const SimulatedRecording& recording) {
  auto writer = SessionWriter::create(simulation, recording);
  if (!writer) return tl::unexpected(writer.error());
  for (const Simulation::Arrival& arrival : simulation.arrivals()) {
    if (auto written = (*writer)->write(arrival, {}); !written) return written;
  }
  return (*writer)->finish();
}

}  // namespace perimap

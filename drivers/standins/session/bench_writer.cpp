#include "drivers/standins/session/bench_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "drivers/file/whole_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/foxglove_pose.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "drivers/recording/sensor_messages.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"

namespace perimap {
namespace {

const char* name_of(BenchAct act) {
  switch (act) {
    case BenchAct::kStill:
      return "scope and pointer at rest";
    case BenchAct::kLandmarks:
      return "landmarks touched with the pointer";
    case BenchAct::kBoard:
      break;
  }
  return "scope swung about a board";
}

std::string description_of(const BenchScene& scene, const TrackerNoise& noise) {
  const BenchSettings& s = scene.settings();
  return fmt::format(
      "simulated bench: {}, {}, seed {}, set-up {}, {} s, {}x{} at {} Hz, tracker {} Hz with {} mm and "
      "{:.3g} deg RMS",
      name_of(s.act), s.board.name, s.seed, s.setup_seed, to_seconds(s.duration), s.width, s.height, s.frames_per_s,
      s.tracker_rate_hz, noise.position_rms_mm, noise.rotation_rms_rad / kDegree);
}

// Frames rendered some ahead, so that several threads have work.
class RenderedFrames {
 public:
  RenderedFrames(const BenchScene& scene, unsigned threads)
      : scene_(scene), threads_(std::max(1U, threads)), parallel_for_(threaded_for(threads_)), images_(4 * threads_) {
    const BenchSettings& s = scene.settings();
    for (auto& image : images_) {
      image.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
    }
  }

  // Frame after frame, from 0 on.
  std::span<const std::uint8_t> of(std::size_t index) {
    if (index % images_.size() == 0) {
      const std::size_t count = std::min(images_.size(), scene_.frames().size() - index);
      parallel_for_(static_cast<int>(count), [&](int k) {
        scene_.render(index + static_cast<std::size_t>(k), images_[static_cast<std::size_t>(k)]);
      });
    }
    return images_[index % images_.size()];
  }

 private:
  const BenchScene& scene_;
  unsigned threads_;
  ParallelFor parallel_for_;
  std::vector<std::vector<std::uint8_t>> images_;
};

class BenchWriter {
 public:
  BenchWriter(const BenchScene& scene, const TrackerNoise& noise, RecordingWriter writer)
      : scene_(scene), noise_(noise), writer_(std::move(writer)) {}

  Expected<void> begin() {
    const auto info = writer_.add_channel<perimap_RecordingInfo>(channels::kRecordingInfo);
    const auto scope = writer_.add_channel<perimap_TrackerPose>(channels::kTrackerPose);
    const auto pointer = writer_.add_channel<perimap_TrackerPose>(std::string(channels::kTrackedTools) + "pointer");
    const auto viewer = writer_.add_channel<foxglove_PoseInFrame>(channels::kTrackerViewer);
    const auto image = writer_.add_channel<foxglove_RawImage>(channels::kCameraImage);
    const auto ecg = writer_.add_channel<perimap_EcgSamples>(channels::kEcgSamples);
    for (const auto* channel : {&info, &scope, &pointer, &viewer, &image, &ecg}) {
      if (!*channel) return tl::unexpected(channel->error());
    }
    if (scene_.settings().second_sensor) {
      const auto second = writer_.add_channel<perimap_TrackerPose>(channels::kSecondSensor);
      if (!second) return tl::unexpected(second.error());
      second_ = *second;
    }
    if (scene_.settings().board_is_held) {
      const auto board =
          writer_.add_channel<perimap_TrackerPose>(std::string(channels::kTrackedTools) + "instrument/board");
      if (!board) return tl::unexpected(board.error());
      board_ = *board;
    }
    scope_ = *scope, pointer_ = *pointer, viewer_ = *viewer, image_ = *image, ecg_ = *ecg;
    std::string generator = fmt::format("perimap simulate {}", PERIMAP_VERSION);
    std::string text = description_of(scene_, noise_);
    std::string world = kWorldFrame;
    constexpr std::int64_t kEpoch_ns = 1'750'000'000'000'000'000;  // as Simulation has it
    const perimap_RecordingInfo facts{generator.data(), text.data(), kEpoch_ns, world.data()};
    return writer_.write(*info, facts, scene_.start(), scene_.start(), 0);
  }

  Expected<void> write_frame(std::size_t index, std::span<const std::uint8_t> pixels) {
    const FrameStamp& stamp = scene_.frames()[index];
    const BenchSettings& s = scene_.settings();
    const auto raw =
        borrow_raw_image(GreyImage{pixels.data(), s.width, s.height, s.width}, stamp.capture, kCameraFrame, packed_);
    return writer_.write(image_, raw, stamp.arrival, stamp.capture, static_cast<std::uint32_t>(stamp.sequence));
  }

  Expected<void> write_reading(std::size_t index) {
    const TrackerSample scope = scene_.reading(BenchScene::Tool::kScope, index, noise_);
    const TrackerSample pointer = scene_.reading(BenchScene::Tool::kPointer, index, noise_);
    const auto viewer = borrow_pose_in_frame(scope.X_WS, scope.source_time, kWorldFrame);
    return writer_.write(scope_, to_tracker_pose(scope), scope.arrival, scope.source_time, scope.device_frame)
        .and_then([&] { return writer_.write(viewer_, viewer, scope.arrival, scope.source_time, scope.device_frame); })
        .and_then([&] {
          return writer_.write(pointer_, to_tracker_pose(pointer), pointer.arrival, pointer.source_time,
                               pointer.device_frame);
        })
        .and_then([&] { return write_also(second_, BenchScene::Tool::kSecondSensor, index); })
        .and_then([&] { return write_also(board_, BenchScene::Tool::kBoard, index); })
        .and_then([&] { return write_ecg(scope.arrival); });
  }

  Expected<void> finish() { return writer_.finish(); }

 private:
  // A tool that not every bench has.
  Expected<void> write_also(const std::optional<ChannelId>& channel, BenchScene::Tool tool, std::size_t index) {
    if (!channel) return {};
    const TrackerSample sample = scene_.reading(tool, index, noise_);
    return writer_.write(*channel, to_tracker_pose(sample), sample.arrival, sample.source_time, sample.device_frame);
  }

  // Of a device whose electrodes nobody wears; whoever plays a recording asks for one. Blocks that have come by then.
  Expected<void> write_ecg(Instant now) {
    EcgBlock block;
    block.sample_period = std::chrono::milliseconds(4);
    block.count = 10;
    block.lead_off = true;
    while (scene_.start() + (ecg_samples_ + block.count) * block.sample_period <= now) {
      block.first_sample_time = scene_.start() + ecg_samples_ * block.sample_period;
      block.device_sequence = static_cast<std::uint32_t>(ecg_samples_);
      block.arrival = now;
      ecg_samples_ += block.count;
      auto written =
          writer_.write(ecg_, borrow_ecg_samples(block), now, block.first_sample_time, block.device_sequence);
      if (!written) return written;
    }
    return {};
  }

  static inline const std::string kCameraFrame = "camera";
  static inline const std::string kWorldFrame = "tracker";

  const BenchScene& scene_;
  TrackerNoise noise_;
  RecordingWriter writer_;
  ChannelId image_, scope_, pointer_, viewer_, ecg_;
  std::optional<ChannelId> second_, board_;
  std::int64_t ecg_samples_ = 0;
  std::vector<std::uint8_t> packed_;
};

}  // namespace

Expected<void> write_bench(const BenchScene& scene, const std::filesystem::path& path, const TrackerNoise& noise,
                           unsigned threads, const std::function<void(std::uint64_t done)>& progress) {
  auto file = WholeFile::create(path, WholeFile::Name::kPart, WholeFile::Readers::kOwner);
  if (!file) return tl::unexpected(file.error());
  auto sink = create_file(file->path().string(), path.string());
  if (!sink) return tl::unexpected(sink.error());
  auto recording = RecordingWriter::create(*std::move(sink));
  if (!recording) return tl::unexpected(recording.error());
  BenchWriter writer(scene, noise, *std::move(recording));
  if (auto begun = writer.begin(); !begun) return begun;
  RenderedFrames rendered(scene, threads);
  // Whatever arrives first; both in the order of their arrival.
  std::size_t frame = 0;
  std::size_t reading = 0;
  while (frame < scene.frames().size() || reading < scene.reading_count()) {
    const bool frame_is_next =
        frame < scene.frames().size() &&
        (reading == scene.reading_count() ||
         scene.frames()[frame].arrival <= scene.reading(BenchScene::Tool::kScope, reading, noise).arrival);
    auto written = frame_is_next ? writer.write_frame(frame, rendered.of(frame)) : writer.write_reading(reading);
    if (!written) return written;
    frame_is_next ? ++frame : ++reading;
    if (frame_is_next) progress(frame);
  }
  return writer.finish().and_then([&] { return file->finish(); });
}

std::string true_setup_of(const BenchScene& scene, const TrackerNoise& noise) {
  const ScopeSetup& setup = scene.setup();
  const ScopeLens& lens = setup.lens;
  double q_SC[4];
  double q_IW[4];
  rotation_to_wxyz(setup.X_SC.R, q_SC);
  rotation_to_wxyz(setup.X_IW.R, q_IW);
  const auto three = [](const Vector3d& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); };
  const auto four = [](const double(&q)[4]) { return fmt::format("[{}, {}, {}, {}]", q[0], q[1], q[2], q[3]); };
  return fmt::format(
      "{{\n"
      "  \"camera\": {{\"focal_px\": [{}, {}], \"principal_point_px\": [{}, {}], \"distortion_coefficients\": [{}, {}, "
      "{}, {}, {}]}},\n"
      "  \"hand_eye\": {{\"translation_mm\": {}, \"rotation_wxyz\": {}, \"time_offset_ms\": {}}},\n"
      "  \"tool\": {{\"tip_mm\": {}}},\n"
      "  \"tracker\": {{\"position_deviation_mm\": {}, \"rotation_deviation_deg\": {}, \"error_correlation_s\": {}}},\n"
      "  \"registration\": {{\"translation_mm\": {}, \"rotation_wxyz\": {}}},\n"
      "  \"scope_rotation_deg\": {},\n"
      "  \"zoom\": {}\n"
      "}}\n",
      lens.fx, lens.fy, lens.cx, lens.cy, lens.k1, lens.k2, lens.p1, lens.p2, lens.k3, three(setup.X_SC.t), four(q_SC),
      1e3 * to_seconds(setup.tracker_offset), three(setup.tip_T), noise.position_rms_mm,
      noise.rotation_rms_rad / kDegree, to_seconds(scene.settings().tracker_correlation), three(setup.X_IW.t),
      four(q_IW), scene.settings().notch_rad ? fmt::format("{}", *scene.settings().notch_rad / kDegree) : "null",
      scene.settings().zoom);
}

std::string landmark_table_of(const BenchScene& scene) {
  std::string table = "name,x,y,z\n";
  for (const BenchLandmark& landmark : scene.landmarks()) {
    const Vector3d m = 1e-3 * landmark.p_I;
    table += fmt::format("{},{:.6f},{:.6f},{:.6f}\n", landmark.name, m.x(), m.y(), m.z());
  }
  return table;
}

}  // namespace perimap

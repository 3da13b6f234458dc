// How many frames a second can be recorded: 1920 x 1080 grey, as a recording (chunks, CRC, zstd level 1), as one
// without compression, and as bare bytes, all to the same folder; what the check sums take of it; and whether a session
// of 60 frames a second is recorded whole, with what the disk takes beside it.
//
// recording_bench [FOLDER [SECONDS]]   (default: /tmp, 10 s of session)
#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/realtime/deadline.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/crc32.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "interleaved_timing.hpp"
#include "machine_text.hpp"

namespace perimap::bench {
namespace {

constexpr int kWidth = 1920, kHeight = 1080;
constexpr int kFramesACall = 8;  // four chunks
constexpr int kRounds = 12;
constexpr int kProcessorCalls = 3;
constexpr double kSessionRate_hz = 60.0;
constexpr std::size_t kSessionMemory = std::size_t{256} << 20U;  // recording.memory_MB as it is by default

// Smooth shading under the noise of a sensor, 1.2 grey levels: noise is what does not compress.
std::vector<std::vector<std::uint8_t>> frames() {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0.0F, 1.2F);
  std::vector<std::vector<std::uint8_t>> all(kFramesACall);
  for (auto& frame : all) {
    frame.reserve(std::size_t{kWidth} * kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double shade =
            120.0 + 50.0 * std::sin(x * 0.02) * std::cos(y * 0.017) + 20.0 * std::sin(x * 0.3 + y * 0.2);
        frame.push_back(static_cast<std::uint8_t>(std::lround(shade + noise(random))));
      }
    }
  }
  return all;
}

void must(const Expected<void>& done) {
  if (done) return;
  std::fprintf(stderr, "recording_bench: %s\n", done.error().message.c_str());
  std::exit(1);
}

// Frames into one recording, as the recorder's thread writes them.
class Recording {
 public:
  Recording(const std::string& path, std::optional<int> zstd_level) {
    McapWriterOptions options;
    options.zstd_level = zstd_level;
    writer_.emplace(RecordingWriter::create(path, options).value());
    camera_ = writer_->add_channel<foxglove_RawImage>(channels::kCameraImage).value();
  }

  void write(const std::vector<std::vector<std::uint8_t>>& frames) {
    for (const auto& pixels : frames) {
      now_ += std::chrono::microseconds(16667);
      CameraFrame frame;
      frame.stamp = {sequence_++, now_, now_};
      frame.width = kWidth;
      frame.stride = kWidth;
      frame.height = kHeight;
      frame.bytes = std::as_bytes(std::span(pixels));
      must(writer_->write(camera_, borrow_raw_image(frame, name_), now_, now_, static_cast<std::uint32_t>(sequence_)));
    }
  }

 private:
  std::optional<RecordingWriter> writer_;
  ChannelId camera_;
  Instant now_{std::chrono::seconds(1)};
  std::uint64_t sequence_ = 0;
  std::string name_ = "camera";
};

// Of this process so far.
double processor_ms() {
  std::timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) / 1e6;
}

// Of the processor, ms a frame, the least of a few: what remains of the time when others have the machine too.
double processor_ms(Candidate& candidate) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kProcessorCalls; ++i) {
    const double before = processor_ms();
    candidate.call();
    least = std::min(least, (processor_ms() - before) / candidate.updates);
  }
  return least;
}

// What the folder's disk takes, until it has it, MB/s.
double disk_MB_per_s(const std::filesystem::path& file, const std::vector<std::vector<std::uint8_t>>& frames) {
  constexpr int kFrames = 240;
  const auto sink = create_file(file.string()).value();
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kFrames; ++i) {
    must(sink->write(std::as_bytes(std::span(frames[static_cast<std::size_t>(i) % frames.size()]))));
  }
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 || ::fdatasync(descriptor) != 0) must(fail(file.string() + ": cannot be synchronised"));
  ::close(descriptor);
  const double megabytes = 1e-6 * kFrames * static_cast<double>(frames[0].size());
  const double rate = megabytes / seconds_since(start);
  std::filesystem::remove(file);
  return rate;
}

// Frames at their times, as a camera's thread gives them, beside the thread that writes.
void record_session(const std::filesystem::path& file, const std::vector<std::vector<std::uint8_t>>& frames,
                    double seconds) {
  ThreadLauncher threads{SchedulingSettings{}};
  auto recorder = SessionRecorder::create(file, {"recording_bench", "", "tracker", {}, {}, {}}, kSessionMemory).value();
  recorder->start(threads);
  const double before = processor_ms();
  const Instant start = MonotonicClock::now();
  const auto count = static_cast<std::uint64_t>(seconds * kSessionRate_hz);
  Duration latest{0};
  for (std::uint64_t i = 0; i < count; ++i) {
    const Instant due = start + from_seconds(static_cast<double>(i) / kSessionRate_hz);
    sleep_until(due);
    const Instant now = MonotonicClock::now();
    latest = std::max(latest, now - due);
    CameraFrame frame;
    frame.stamp = {i, due, now};
    frame.width = kWidth;
    frame.stride = kWidth;
    frame.height = kHeight;
    frame.bytes = std::as_bytes(std::span(frames[i % frames.size()]));
    recorder->frame(frame);
  }
  const double given_s = to_seconds(MonotonicClock::now() - start);
  recorder->stop();
  const double ended_s = to_seconds(MonotonicClock::now() - start);
  const SessionRecorder::Summary summary = recorder->summary();
  const double megabytes = static_cast<double>(std::filesystem::file_size(file)) / 1e6;
  std::printf(
      "\nsession: %llu frames in %.1f s (%.0f Hz; the thread that gave them woke up to %.0f ms late), "
      "%llu recorded, %llu not; on the disk %.1f s after the last\n",
      static_cast<unsigned long long>(count), given_s, kSessionRate_hz, 1e3 * to_seconds(latest),
      static_cast<unsigned long long>(summary.recorded), static_cast<unsigned long long>(summary.frames_not_recorded),
      ended_s - given_s);
  std::printf("it takes %.0f MB/s of the camera and %.0f MB/s of the disk; processor %.2f ms a frame, %.0f %% of one\n",
              1e-6 * kSessionRate_hz * kWidth * kHeight, megabytes / given_s,
              (processor_ms() - before) / static_cast<double>(count), (processor_ms() - before) / (10.0 * given_s));
  if (!recorder->reason().empty()) std::printf("stopped: %s\n", recorder->reason().c_str());
  std::filesystem::remove(file);
}

void run(const std::filesystem::path& folder, double session_s) {
  const auto all = frames();
  const std::string bare = (folder / "recording_bench.bytes").string();
  const std::string stored = (folder / "recording_bench.stored.mcap").string();
  const std::string packed = (folder / "recording_bench.zstd.mcap").string();
  Recording with_zstd(packed, 1);
  Recording without(stored, std::nullopt);
  const auto sink = create_file(bare).value();
  std::vector<Candidate> candidates;
  candidates.emplace_back("bare bytes", kFramesACall, [&] {
    for (const auto& frame : all) must(sink->write(std::as_bytes(std::span(frame))));
  });
  candidates.emplace_back("recording, stored", kFramesACall, [&] { without.write(all); });
  candidates.emplace_back("recording, zstd 1", kFramesACall, [&] { with_zstd.write(all); });
  std::uint32_t sum = 0;  // of the one's, less the other's
  candidates.emplace_back("CRC, zlib", kFramesACall, [&] {
    for (const auto& frame : all) sum += static_cast<std::uint32_t>(crc32_z(0, frame.data(), frame.size()));
  });
  candidates.emplace_back("CRC, ours", kFramesACall, [&] {
    for (const auto& frame : all) sum -= crc32_update(0, std::as_bytes(std::span(frame)));
  });
  time_interleaved(candidates, kRounds);

  if (sum != 0) {
    std::fprintf(stderr, "recording_bench: the check sums differ\n");
    std::exit(1);
  }
  print_machine(PERIMAP_REVISION);
  std::printf("folder: %s; %d x %d grey, %d frames a call, %d rounds\n\n", folder.c_str(), kWidth, kHeight,
              kFramesACall, kRounds);
  std::printf("%-20s %9s %9s %9s %12s %11s %12s\n", "ms a frame", "median", "p99", "max", "processor", "frames/s",
              "MB a frame");
  const double written = (2.0 * kRounds + kProcessorCalls) * kFramesACall;
  for (Candidate& c : candidates) {
    const double processor = processor_ms(c);
    std::printf("%-20s %9.2f %9.2f %9.2f %12.2f %11.0f", c.name.c_str(), c.median() / 1e6, c.quantile(0.99) / 1e6,
                c.quantile(1.0) / 1e6, processor, 1e9 / c.median());
    const std::string path = c.name == "bare bytes"          ? bare
                             : c.name == "recording, stored" ? stored
                             : c.name == "recording, zstd 1" ? packed
                                                             : std::string();
    if (!path.empty()) std::printf(" %12.2f", static_cast<double>(std::filesystem::file_size(path)) / written / 1e6);
    std::printf("\n");
  }
  for (const std::string& path : {bare, stored, packed}) std::filesystem::remove(path);
  const std::filesystem::path session = folder / "recording_bench.session.mcap";
  std::printf("\ndisk: %.0f MB/s before the session", disk_MB_per_s(bare, all));
  record_session(session, all, session_s);
  std::printf("disk: %.0f MB/s after it\n", disk_MB_per_s(bare, all));
}

}  // namespace
}  // namespace perimap::bench

int main(int argc, char** argv) {
  perimap::bench::run(argc > 1 ? argv[1] : "/tmp", argc > 2 ? std::atof(argv[2]) : 10.0);
  return 0;
}

// How many frames a second can be recorded: 1920 x 1080 grey, as a recording (chunks, CRC, zstd level 1), as one
// without compression, and as bare bytes, all to the same folder.
//
// recording_bench [FOLDER]   (default: /tmp)
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "interleaved_timing.hpp"
#include "machine_text.hpp"

namespace perimap::bench {
namespace {

constexpr int kWidth = 1920, kHeight = 1080;
constexpr int kFramesACall = 8;  // four chunks
constexpr int kRounds = 12;

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

// Of the processor, ms a frame: what remains of the time when others have the machine too.
double processor_ms(Candidate& candidate) {
  const auto used = [] {
    std::timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) / 1e6;
  };
  const double before = used();
  candidate.call();
  return (used() - before) / candidate.updates;
}

void run(const std::filesystem::path& folder) {
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
  time_interleaved(candidates, kRounds);

  print_machine(PERIMAP_REVISION);
  std::printf("folder: %s; %d x %d grey, %d frames a call, %d rounds\n\n", folder.c_str(), kWidth, kHeight,
              kFramesACall, kRounds);
  std::printf("%-20s %9s %9s %9s %12s %11s %12s\n", "ms a frame", "median", "p99", "max", "processor", "frames/s",
              "MB a frame");
  const double written = (2.0 * kRounds + 1.0) * kFramesACall;
  for (Candidate& c : candidates) {
    const double processor = processor_ms(c);
    const std::string& path = c.name == "bare bytes" ? bare : c.name == "recording, stored" ? stored : packed;
    std::printf("%-20s %9.2f %9.2f %9.2f %12.2f %11.0f %12.2f\n", c.name.c_str(), c.median() / 1e6,
                c.quantile(0.99) / 1e6, c.quantile(1.0) / 1e6, processor, 1e9 / c.median(),
                static_cast<double>(std::filesystem::file_size(path)) / written / 1e6);
  }
  for (const std::string& path : {bare, stored, packed}) std::filesystem::remove(path);
}

}  // namespace
}  // namespace perimap::bench

int main(int argc, char** argv) {
  perimap::bench::run(argc > 1 ? argv[1] : "/tmp");
  return 0;
}

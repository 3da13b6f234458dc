// Writes a clip of beating, wet tissue that begins anew without a jump of its beat: write_wet_tissue FILE BEATS SEED
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "drivers/video/video_file.hpp"
#include "tests/simulated/wet_tissue.hpp"

namespace perimap {
namespace {

Expected<void> write(const char* file, int beats, std::uint64_t seed) {
  WetTissueSettings settings;
  settings.seed = seed;
  WetTissue tissue(settings);
  auto writer = VideoWriter::create(file, settings.width, settings.height, settings.frames_per_s);
  if (!writer) return tl::unexpected(writer.error());
  const int frames = static_cast<int>(std::lround(beats * settings.beat_s * settings.frames_per_s));
  for (int number = 0; number < frames; ++number) {
    const WetTissue::Frame frame = tissue.frame(number);
    const VideoFrame shown{static_cast<std::uint64_t>(number), frame.colour, frame.grey};
    if (auto written = (*writer)->write(shown, {}); !written) return written;
  }
  return (*writer)->finish();
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const auto written = perimap::write(argv[1], std::atoi(argv[2]), std::strtoull(argv[3], nullptr, 10));
  if (!written) std::fprintf(stderr, "%s\n", written.error().message.c_str());
  return written ? 0 : 1;
}

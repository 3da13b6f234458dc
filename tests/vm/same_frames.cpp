// Whether the frames of one recording have come through a device into another.
// same_frames PLAYED SEEN: prints how many frames of SEEN are frames of PLAYED byte for byte, and of how many.
#include <array>
#include <cstdio>
#include <set>
#include <string_view>
#include <vector>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {
namespace {

template <class Take>
Expected<void> each_frame(const char* recording, Take take) {
  constexpr std::array<std::string_view, 1> kFrames{channels::kCameraImage};
  auto reader = ReplayReader::open(recording, ReadMode::kStrict, kFrames);
  if (!reader) return tl::unexpected(reader.error());
  for (;;) {
    auto event = reader->next();
    if (!event) return tl::unexpected(event.error());
    if (!*event) return {};
    take(std::move(std::get<FrameEvent>(**event).pixels));
  }
}

int run(const char* played, const char* seen) {
  std::set<std::vector<std::uint8_t>> known;
  int same = 0, all = 0;
  const auto compared =
      each_frame(played, [&](std::vector<std::uint8_t> pixels) { known.insert(std::move(pixels)); }).and_then([&] {
        return each_frame(seen, [&](const std::vector<std::uint8_t>& pixels) {
          ++all;
          if (known.contains(pixels)) ++same;
        });
      });
  if (!compared) {
    (void)std::fprintf(stderr, "same_frames: %s\n", compared.error().message.c_str());
    return 1;
  }
  std::printf("%d of %d\n", same, all);
  return 0;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 3) {
    (void)std::fprintf(stderr, "same_frames PLAYED SEEN\n");
    return 2;
  }
  return perimap::run(argv[1], argv[2]);
}

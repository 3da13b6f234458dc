// Prints how large a video's frames are, and how many come in a second: video_size FILE
#include <cstdio>

#include "drivers/video/video_file.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto reader = perimap::VideoReader::open(argv[1]);
  if (!reader) return std::fprintf(stderr, "%s\n", reader.error().message.c_str()), 1;
  const auto frame = (*reader)->next();
  if (!frame || *frame == nullptr) return 1;
  std::printf("%d %d %g\n", (*frame)->grey.width, (*frame)->grey.height, (*reader)->frames_per_s());
}

// make_black_box_corpus FOLDER: seeds for fuzz_black_box, in FOLDER/black_box.
#include <perimap.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>

#include "daemon/black_box/entry.hpp"
#include "daemon/black_box/segment_header.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap::black_box {
namespace {

void save(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

template <class T>
std::string cdr_of_nothing() {
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(T{});
  if (!bytes) throw std::runtime_error(bytes.error().message);
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

// As the fuzzer takes what is to have digests that fit.
std::string compact(EntryKind kind, std::string content) {
  constexpr std::size_t kUnit = 8;  // 2^3, of the three upper bits of the first byte
  content.resize((content.size() + kUnit - 1) / kUnit * kUnit, ' ');
  std::string bytes;
  bytes += static_cast<char>((3U << 5U) | static_cast<unsigned>(kind));
  bytes += static_cast<char>(content.size() / kUnit);
  return bytes + content;
}

void write_corpus(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  SegmentHeader header;
  header.number = 3;
  header.present.push_back({1, 2, 3, {}, 0, {}, true, 5});
  const std::string samples = compact(EntryKind::kSurface, cdr_of_nothing<perimap_Surface>()) +
                              compact(EntryKind::kPhase, cdr_of_nothing<perimap_Phase>()) +
                              compact(EntryKind::kStatus, cdr_of_nothing<perimap_Status>());
  const std::string end = compact(EntryKind::kLetGo, R"({"segment":1,"why":"removed by others"})") +
                          compact(EntryKind::kEnd, R"({"why":"perimapd has ended"})");
  save(folder / "entries", compact(EntryKind::kHeader, text_of(header)) + samples + end);
  std::string segment = segment_begin();
  Digest chain = begin_digest();
  segment += frame_of({EntryKind::kHeader, {1, 2}, text_of(header)}, chain);
  segment += frame_of({EntryKind::kEnd, {1, 2}, R"({"why":"perimapd has ended"})"}, chain);
  save(folder / "segment", segment);
}

}  // namespace
}  // namespace perimap::black_box

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_black_box_corpus FOLDER\n", stderr);
    return 2;
  }
  try {
    perimap::black_box::write_corpus(std::filesystem::path(argv[1]) / "black_box");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_black_box_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}

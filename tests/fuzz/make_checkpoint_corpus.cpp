// make_checkpoint_corpus FOLDER: seeds for fuzz_checkpoint, in FOLDER/checkpoint.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/unit/checkpoint/samples.hpp"

namespace perimap {
namespace {

constexpr std::size_t kHeader = 16;

void save(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

// Bodies, which no CRC closes to the fuzzer: without features, with one, and as they are without breathing.
void write_corpus(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  Checkpoint checkpoint = test::checkpoint_sample();
  save(folder / "file", test::file_of(checkpoint, 1));
  save(folder / "empty", test::file_of(checkpoint, 0).substr(kHeader));
  save(folder / "one", test::file_of(checkpoint, 1).substr(kHeader));
  save(folder / "two", test::file_of(checkpoint, 2).substr(kHeader));
  checkpoint.memory.ecg.clear();
  checkpoint.memory.respiration = {};
  save(folder / "still", test::file_of(checkpoint, 0).substr(kHeader));
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_checkpoint_corpus FOLDER\n", stderr);
    return 2;
  }
  try {
    perimap::write_corpus(std::filesystem::path(argv[1]) / "checkpoint");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_checkpoint_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}

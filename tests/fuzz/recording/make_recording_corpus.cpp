// make_recording_corpus FOLDER: seeds for fuzz_mcap and fuzz_cdr.
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/recording/recording_writer.hpp"
#include "tests/unit/recording/every_type.hpp"
#include "tests/unit/recording/memory_file.hpp"
#include "tests/unit/recording/samples.hpp"

namespace perimap {
namespace {

using test::Bytes;

void save(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

constexpr std::string_view kAttachment = "text";

// Short schemas, so that the fuzzer spends itself on the container.
Bytes small_file(const McapWriterOptions& options) {
  Bytes bytes;
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), options).value();
  const auto schema = writer.add_schema("perimap::TrackerPose", kSchemaEncoding, "idl").value();
  const auto channel = writer.add_channel(schema, "tracker/pose", kMessageEncoding, {{"key", "value"}}).value();
  CdrSerializer serializer;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const auto data = serializer.serialize(*test::make_sample<perimap_TrackerPose>(i)).value();
    static_cast<void>(writer.write_message({channel, i, i, i, data}));
    if (i % 2 == 1) static_cast<void>(writer.flush());
  }
  static_cast<void>(writer.write_attachment("a", "text/plain", std::as_bytes(std::span(kAttachment)), 0, 0));
  static_cast<void>(writer.write_metadata("scene", {{"seed", "1"}}));
  static_cast<void>(writer.finish());
  return bytes;
}

// CRCs of 0 mean "none", so that a change elsewhere gets past them.
void clear_crcs(Bytes& bytes) {
  std::size_t at = mcap::kMagic.size();
  while (at < bytes.size() - mcap::kMagic.size()) {
    std::uint64_t length = 0;
    std::memcpy(&length, &bytes[at + 1], sizeof(length));
    const auto opcode = static_cast<mcap::Opcode>(bytes[at]);
    const std::size_t content = at + mcap::kRecordHeaderBytes;
    at = content + length;
    if (opcode == mcap::Opcode::kChunk) {
      std::memset(&bytes[content + 8 + 8 + 8], 0, 4);
    } else if (opcode == mcap::Opcode::kDataEnd || opcode == mcap::Opcode::kFooter ||
               opcode == mcap::Opcode::kAttachment) {
      std::memset(&bytes[at - 4], 0, 4);
    }
  }
}

void write_corpus(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "mcap");
  std::filesystem::create_directories(folder / "cdr");
  McapWriterOptions plain;
  plain.zstd_level = std::nullopt;
  for (const auto& [name, options] : {std::pair("zstd", McapWriterOptions{}), std::pair("plain", plain)}) {
    Bytes bytes = small_file(options);
    save(folder / "mcap" / name, bytes);
    clear_crcs(bytes);
    save(folder / "mcap" / (std::string(name) + "_without_crcs"), bytes);
    bytes.resize(bytes.size() / 2);
    save(folder / "mcap" / (std::string(name) + "_cut"), bytes);
  }
  unsigned type = 0;
  test::for_every_type([&]<class T>() {
    CdrSerializer serializer;
    const auto message = serializer.serialize(*test::make_sample<T>(1)).value();
    Bytes bytes{static_cast<std::byte>(type++)};
    bytes.insert(bytes.end(), message.begin(), message.end());
    save(folder / "cdr" / std::string(topic_type<T>().descriptor->m_typename), bytes);
  });
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_recording_corpus FOLDER\n", stderr);
    return 2;
  }
  try {
    perimap::write_corpus(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_recording_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}

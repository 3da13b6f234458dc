#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <optional>

#include "drivers/recording/mcap_reader.hpp"
#include "drivers/recording/mcap_writer.hpp"
#include "tests/unit/recording/memory_file.hpp"

namespace perimap {
namespace {

constexpr std::uint32_t kMessages = 3;  // of a chunk

// Chunk c has the messages 3 c to 3 c + 2, each logged at 1000 + its number.
test::Bytes write_chunks(std::uint32_t chunks) {
  test::Bytes bytes;
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), {}).value();
  const auto schema = writer.add_schema("demo::Type", "omgidl", "module demo { };").value();
  const auto channel = writer.add_channel(schema, "ecg/samples", "cdr").value();
  constexpr std::array<std::byte, 40> kData{};
  for (std::uint32_t i = 0; i < chunks * kMessages; ++i) {
    EXPECT_TRUE(writer.write_message({channel, i, 1000 + i, 900 + i, kData}));
    if (i % kMessages == kMessages - 1) {
      EXPECT_TRUE(writer.flush());
    }
  }
  EXPECT_TRUE(writer.finish());
  return bytes;
}

// None: at the end.
std::optional<std::uint32_t> next_of(McapReader& reader) {
  const auto message = reader.next();
  EXPECT_TRUE(message) << message.error().message;
  if (!message || !*message) return std::nullopt;
  return (*message)->sequence;
}

TEST(McapSeek, GoesOnWithTheChunkOfThatInstantWithAndWithoutAnIndex) {
  const test::Bytes whole = write_chunks(5);
  test::Bytes cut = whole;
  cut.resize(cut.size() - 20);  // without its footer it is scanned
  for (const test::Bytes& bytes : {whole, cut}) {
    auto reader = McapReader::open(test::source_of(bytes), ReadMode::kWhole);
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_EQ(reader->times().first_ns, 1000U);
    EXPECT_EQ(reader->times().last_ns, 1014U);
    EXPECT_EQ(next_of(*reader), 0U);
    for (const std::uint32_t chunk : {3U, 1U, 4U, 0U}) {
      // The last message of a chunk: the whole chunk is given again.
      reader->seek(1000 + chunk * kMessages + 2);
      EXPECT_EQ(next_of(*reader), chunk * kMessages);
    }
    reader->seek(0);
    for (std::uint32_t i = 0; i < 5 * kMessages; ++i) EXPECT_EQ(next_of(*reader), i);
    EXPECT_EQ(next_of(*reader), std::nullopt);
    reader->seek(1015);
    EXPECT_EQ(next_of(*reader), std::nullopt);
  }
}

TEST(McapSeek, AFileWithoutMessagesHasNoTimes) {
  const test::Bytes bytes = write_chunks(0);
  auto reader = McapReader::open(test::source_of(bytes), ReadMode::kWhole);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_FALSE(reader->times().any());
  reader->seek(1);
  EXPECT_EQ(next_of(*reader), std::nullopt);
}

}  // namespace
}  // namespace perimap

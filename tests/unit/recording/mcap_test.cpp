#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "drivers/recording/mcap_reader.hpp"
#include "drivers/recording/mcap_writer.hpp"
#include "tests/unit/damage/damage.hpp"
#include "tests/unit/recording/memory_file.hpp"

namespace perimap {
namespace {

using mcap::Opcode;
using test::Bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct OwnedMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  Bytes data;
  bool operator==(const OwnedMessage&) const = default;
};

// A file with what is in it, as the writer was told.
struct Written {
  Bytes bytes;
  std::vector<std::vector<OwnedMessage>> chunks;
};

Bytes random_bytes(std::mt19937& random, std::size_t size) {
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random() % 17);
  return bytes;
}

constexpr std::string_view kAttachmentText = "camera_matrix: []\n";

Written write_file(std::size_t chunk_count, std::size_t message_bytes, McapWriterOptions options = {}) {
  Written written;
  options.chunk_bytes = std::size_t{1} << 30;
  options.chunk_duration = std::chrono::hours(1);
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(written.bytes), options).value();
  const auto schema = writer.add_schema("demo::Type", "omgidl", "module demo { };").value();
  const std::uint16_t ids[] = {writer.add_channel(schema, "camera/image", "cdr", {{"unit", "1"}}).value(),
                               writer.add_channel(schema, "ecg/samples", "cdr").value()};
  std::mt19937 random(20130506);
  std::uint32_t sequence = 0;
  for (std::size_t c = 0; c < chunk_count; ++c) {
    auto& chunk = written.chunks.emplace_back();
    for (int m = 0; m < 3; ++m) {
      ++sequence;
      chunk.push_back({ids[m % 2], sequence, 1'000'000 + sequence, 900'000 + sequence,
                       random_bytes(random, m == 2 ? 0 : message_bytes + random() % 5)});
      const OwnedMessage& message = chunk.back();
      EXPECT_TRUE(writer.write_message(
          {message.channel_id, message.sequence, message.log_time_ns, message.publish_time_ns, message.data}));
    }
    EXPECT_TRUE(writer.flush());
    if (c == 0) {
      EXPECT_TRUE(writer.write_attachment("calibration.yaml", "application/yaml",
                                          std::as_bytes(std::span(kAttachmentText)), 5, 6));
      EXPECT_TRUE(writer.write_metadata("scene", {{"seed", "1"}}));
    }
  }
  EXPECT_TRUE(writer.finish());
  return written;
}

std::vector<OwnedMessage> joined(const std::vector<std::vector<OwnedMessage>>& chunks) {
  std::vector<OwnedMessage> all;
  for (const auto& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
  return all;
}

struct Outcome {
  std::vector<OwnedMessage> messages;
  std::vector<Error> damage;
  std::optional<Error> error;
};

Outcome read_all(McapReader& reader) {
  Outcome outcome;
  while (true) {
    const auto message = reader.next();
    if (!message) {
      outcome.error = message.error();
      break;
    }
    if (!*message) break;
    outcome.messages.push_back({(*message)->channel_id, (*message)->sequence, (*message)->log_time_ns,
                                (*message)->publish_time_ns, Bytes((*message)->data.begin(), (*message)->data.end())});
  }
  outcome.damage = reader.damage();
  return outcome;
}

Outcome read_all(std::span<const std::byte> bytes, ReadMode mode) {
  auto reader = McapReader::open(test::source_of(bytes), mode);
  if (!reader) return {{}, {}, reader.error()};
  return read_all(*reader);
}

struct RecordPlace {
  Opcode opcode;
  std::size_t offset;
  std::size_t end;
};

// Of a file that is whole.
std::vector<RecordPlace> records_of(const Bytes& bytes) {
  std::vector<RecordPlace> places;
  std::size_t at = mcap::kMagic.size();
  while (at < bytes.size() - mcap::kMagic.size()) {
    std::uint64_t length = 0;
    std::memcpy(&length, &bytes[at + 1], sizeof(length));
    const std::size_t end = at + mcap::kRecordHeaderBytes + length;
    places.push_back({static_cast<Opcode>(bytes[at]), at, end});
    at = end;
  }
  return places;
}

std::vector<RecordPlace> records_of(const Bytes& bytes, Opcode opcode) {
  std::vector<RecordPlace> places = records_of(bytes);
  std::erase_if(places, [&](const RecordPlace& place) { return place.opcode != opcode; });
  return places;
}

void set_u64(Bytes& bytes, std::size_t at, std::uint64_t value) { std::memcpy(&bytes[at], &value, sizeof(value)); }

// The messages of the chunks that end before `length`.
std::vector<OwnedMessage> whole_before(const Written& written, std::size_t length) {
  std::vector<OwnedMessage> whole;
  const auto places = records_of(written.bytes, Opcode::kChunk);
  for (std::size_t c = 0; c < places.size(); ++c) {
    if (places[c].end <= length) whole.insert(whole.end(), written.chunks[c].begin(), written.chunks[c].end());
  }
  return whole;
}

void expect_cut_is_told(const Written& written, std::size_t length) {
  SCOPED_TRACE("cut at byte " + std::to_string(length));
  const auto cut = std::span(written.bytes).first(length);

  const Outcome strict = read_all(cut, ReadMode::kStrict);
  ASSERT_TRUE(strict.error.has_value());
  EXPECT_THAT(strict.error->message, StartsWith("byte "));

  const Outcome whole = read_all(cut, ReadMode::kWhole);
  if (length < mcap::kMagic.size()) {
    ASSERT_TRUE(whole.error.has_value());
    EXPECT_THAT(whole.error->message, StartsWith("byte " + std::to_string(length) + ":"));
    return;
  }
  EXPECT_FALSE(whole.error.has_value()) << whole.error->message;
  EXPECT_EQ(whole.messages, whole_before(written, length));
  ASSERT_FALSE(whole.damage.empty());
  EXPECT_THAT(whole.damage.front().message, StartsWith("byte " + std::to_string(length) + ":"));
}

TEST(McapWriter, WritesEqualBytesForEqualCalls) { EXPECT_EQ(write_file(3, 40).bytes, write_file(3, 40).bytes); }

TEST(McapWriter, StartsANewChunkAtTheSizeBound) {
  Bytes bytes;
  McapWriterOptions options;
  options.chunk_bytes = 1000;
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), options).value();
  const auto channel = writer.add_channel(0, "raw", "").value();
  const Bytes data(400);
  for (std::uint32_t i = 0; i < 4; ++i) ASSERT_TRUE(writer.write_message({channel, i, i, i, data}));
  const Bytes large(5000);
  ASSERT_TRUE(writer.write_message({channel, 4, 4, 4, large}));
  ASSERT_TRUE(writer.finish());
  EXPECT_EQ(records_of(bytes, Opcode::kChunk).size(), 3U);
  EXPECT_EQ(read_all(bytes, ReadMode::kStrict).messages.size(), 5U);
}

TEST(McapWriter, StartsANewChunkAtTheTimeBound) {
  Bytes bytes;
  McapWriterOptions options;
  options.chunk_duration = std::chrono::milliseconds(10);
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), options).value();
  const auto channel = writer.add_channel(0, "raw", "").value();
  for (std::uint32_t i = 0; i < 20; ++i) ASSERT_TRUE(writer.write_message({channel, i, i * 2'000'000U, 0, {}}));
  ASSERT_TRUE(writer.finish());
  EXPECT_EQ(records_of(bytes, Opcode::kChunk).size(), 4U);  // 0..10, 12..22, 24..34, 36..38 ms
}

TEST(McapWriter, FinishesWhenDestroyed) {
  Bytes bytes;
  {
    auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), {}).value();
    const auto channel = writer.add_channel(0, "raw", "").value();
    ASSERT_TRUE(writer.write_message({channel, 0, 0, 0, {}}));
  }
  const Outcome outcome = read_all(bytes, ReadMode::kStrict);
  EXPECT_FALSE(outcome.error.has_value());
  EXPECT_EQ(outcome.messages.size(), 1U);
}

TEST(McapWriter, RefusesAChannelThatWasNotAdded) {
  Bytes bytes;
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), {}).value();
  EXPECT_FALSE(writer.write_message({1, 0, 0, 0, {}}));
  EXPECT_FALSE(writer.add_channel(7, "raw", ""));
}

TEST(McapWriter, RefusesToWriteAfterTheEnd) {
  Bytes bytes;
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes), {}).value();
  const auto channel = writer.add_channel(0, "raw", "").value();
  ASSERT_TRUE(writer.finish());
  EXPECT_TRUE(writer.finish());
  EXPECT_FALSE(writer.write_message({channel, 0, 0, 0, {}}));
}

TEST(McapWriter, KeepsTheFirstErrorOfTheSinkAndWritesNothingMore) {
  Bytes bytes;
  auto writer = McapWriter::create(std::make_unique<test::MemorySink>(bytes, 300), {}).value();
  const auto channel = writer.add_channel(0, "raw", "").value();
  std::mt19937 random(1);
  const Bytes data = random_bytes(random, 2000);
  ASSERT_TRUE(writer.write_message({channel, 0, 0, 0, data}));
  const auto flushed = writer.flush();
  ASSERT_FALSE(flushed);
  EXPECT_EQ(flushed.error().message, "no space left on device");
  const std::size_t before = bytes.size();
  EXPECT_EQ(writer.write_message({channel, 1, 1, 1, {}}).error().message, "no space left on device");
  EXPECT_EQ(writer.finish().error().message, "no space left on device");
  EXPECT_EQ(bytes.size(), before);
}

TEST(McapReader, GivesBackWhatWasWritten) {
  const Written written = write_file(3, 40);
  auto reader = McapReader::open(test::source_of(written.bytes), ReadMode::kStrict).value();
  const Outcome outcome = read_all(reader);
  EXPECT_FALSE(outcome.error.has_value());
  EXPECT_EQ(outcome.messages, joined(written.chunks));
  ASSERT_EQ(reader.channels().size(), 2U);
  EXPECT_EQ(reader.channels().at(1).topic, "camera/image");
  EXPECT_EQ(reader.channels().at(1).metadata.at("unit"), "1");
  ASSERT_EQ(reader.schemas().size(), 1U);
  EXPECT_EQ(reader.schemas().at(1).name, "demo::Type");
  EXPECT_EQ(reader.schemas().at(1).data, "module demo { };");
  ASSERT_EQ(reader.attachment_names(), std::vector<std::string>{"calibration.yaml"});
  const auto attachment = reader.read_attachment("calibration.yaml");
  ASSERT_TRUE(attachment) << attachment.error().message;
  EXPECT_EQ(attachment->media_type, "application/yaml");
  EXPECT_EQ(attachment->log_time_ns, 5U);
  EXPECT_EQ(attachment->create_time_ns, 6U);
  EXPECT_TRUE(std::ranges::equal(attachment->data, std::as_bytes(std::span(kAttachmentText))));
  EXPECT_THAT(reader.read_attachment("nothing").error().message, HasSubstr("\"nothing\""));
}

TEST(McapReader, ReadsChunksThatAreNotCompressed) {
  McapWriterOptions options;
  options.zstd_level = std::nullopt;
  const Written written = write_file(3, 40, options);
  const Outcome outcome = read_all(written.bytes, ReadMode::kStrict);
  EXPECT_FALSE(outcome.error.has_value());
  EXPECT_EQ(outcome.messages, joined(written.chunks));
}

TEST(McapReader, GivesOnlySelectedChannelsAndStartsOver) {
  const Written written = write_file(3, 40);
  auto reader = McapReader::open(test::source_of(written.bytes), ReadMode::kStrict).value();
  ASSERT_TRUE(reader.next().value().has_value());
  reader.select(std::set<std::uint16_t>{2});
  const Outcome selected = read_all(reader);
  EXPECT_FALSE(selected.error.has_value());
  ASSERT_EQ(selected.messages.size(), 3U);
  for (const OwnedMessage& message : selected.messages) EXPECT_EQ(message.channel_id, 2);
  reader.select(std::nullopt);
  EXPECT_EQ(read_all(reader).messages, joined(written.chunks));
}

TEST(McapReader, RefusesAnEmptyFile) {
  for (const ReadMode mode : {ReadMode::kStrict, ReadMode::kWhole}) {
    const auto reader = McapReader::open(test::source_of({}), mode);
    ASSERT_FALSE(reader);
    EXPECT_EQ(reader.error().message, "byte 0: the recording is empty");
  }
}

TEST(McapReader, RefusesAFileOfAnotherKind) {
  const std::string text(1000, '#');
  for (const ReadMode mode : {ReadMode::kStrict, ReadMode::kWhole}) {
    const auto reader = McapReader::open(test::source_of(std::as_bytes(std::span(text))), mode);
    ASSERT_FALSE(reader);
    EXPECT_EQ(reader.error().message, "byte 0: this is not an MCAP recording");
  }
}

TEST(McapReader, ReadsWholeChunksOfASmallFileCutAtAnyByte) {
  const Written written = write_file(3, 30);
  for (std::size_t length = 1; length < written.bytes.size(); ++length) expect_cut_is_told(written, length);
}

TEST(McapReader, ReadsWholeChunksOfALargerFileCutAtManyBytes) {
  const Written written = write_file(12, 20'000);
  std::mt19937 random(7);
  for (int i = 0; i < 150; ++i) expect_cut_is_told(written, 1 + random() % (written.bytes.size() - 1));
  for (const RecordPlace& place : records_of(written.bytes)) {
    expect_cut_is_told(written, place.offset);
    expect_cut_is_told(written, place.offset + 5);
    expect_cut_is_told(written, place.end - 1);
  }
}

// Strict: told, wherever it is. Whole: told, and nothing wrong is given out.
void expect_flip_is_told(const Written& written, std::size_t at, std::byte mask) {
  SCOPED_TRACE("flipped byte " + std::to_string(at));
  Bytes flipped = written.bytes;
  flipped[at] ^= mask;
  auto reader = McapReader::open(test::source_of(flipped), ReadMode::kStrict);
  std::optional<Error> error;
  if (!reader) {
    error = reader.error();
  } else {
    error = read_all(*reader).error;
  }
  ASSERT_TRUE(error.has_value());
  EXPECT_THAT(error->message, StartsWith("byte "));

  const Outcome whole = read_all(flipped, ReadMode::kWhole);
  if (at < mcap::kMagic.size()) {
    EXPECT_TRUE(whole.error.has_value());
    return;
  }
  EXPECT_FALSE(whole.error.has_value());
  EXPECT_FALSE(whole.damage.empty());
  std::vector<OwnedMessage> expected;
  const auto places = records_of(written.bytes, Opcode::kChunk);
  for (std::size_t c = 0; c < places.size(); ++c) {
    if (at >= places[c].offset && at < places[c].end) continue;
    expected.insert(expected.end(), written.chunks[c].begin(), written.chunks[c].end());
  }
  // The chunk that was hit may still be whole where the byte is not part of its messages (its times).
  if (whole.messages.size() != expected.size()) {
    EXPECT_EQ(whole.messages, joined(written.chunks));
  } else {
    EXPECT_EQ(whole.messages, expected);
  }
}

TEST(McapReader, TellsAnyFlippedByteOfASmallFile) {
  const Written written = write_file(3, 30);
  for (std::size_t at = 0; at < written.bytes.size(); ++at) expect_flip_is_told(written, at, std::byte{0x10});
}

TEST(McapReader, TellsFlippedBytesOfALargerFile) {
  const Written written = write_file(12, 20'000);
  std::mt19937 random(8);
  for (int i = 0; i < 150; ++i) {
    expect_flip_is_told(written, random() % written.bytes.size(), std::byte{1} << static_cast<int>(random() % 8));
  }
}

TEST(McapReader, NamesTheChunkThatIsDamaged) {
  Written written = write_file(3, 30);
  const RecordPlace chunk = records_of(written.bytes, Opcode::kChunk)[1];
  written.bytes[chunk.end - 10] ^= std::byte{1};
  const Outcome outcome = read_all(written.bytes, ReadMode::kWhole);
  ASSERT_EQ(outcome.damage.size(), 1U);
  EXPECT_THAT(outcome.damage[0].message, StartsWith("byte " + std::to_string(chunk.offset) + ": the chunk"));
}

TEST(McapReader, TellsAnAttachmentThatIsDamaged) {
  Written written = write_file(1, 30);
  const RecordPlace place = records_of(written.bytes, Opcode::kAttachment).at(0);
  written.bytes[place.end - 8] ^= std::byte{1};
  auto reader = McapReader::open(test::source_of(written.bytes), ReadMode::kStrict).value();
  const auto attachment = reader.read_attachment("calibration.yaml");
  ASSERT_FALSE(attachment);
  EXPECT_THAT(attachment.error().message, AllOf(StartsWith("byte " + std::to_string(place.offset)), HasSubstr("CRC")));
}

TEST(McapReader, RefusesAbsurdLengthsWithoutAllocatingThem) {
  const Written written = write_file(2, 30);
  for (const std::uint64_t absurd : {std::uint64_t{1} << 40, std::uint64_t{1} << 62, ~std::uint64_t{0}}) {
    for (const RecordPlace& place : records_of(written.bytes)) {
      Bytes bytes = written.bytes;
      set_u64(bytes, place.offset + 1, absurd);
      EXPECT_TRUE(read_all(bytes, ReadMode::kStrict).error.has_value()) << place.offset;
      EXPECT_FALSE(read_all(bytes, ReadMode::kWhole).error.has_value()) << place.offset;
    }
    const RecordPlace chunk = records_of(written.bytes, Opcode::kChunk).at(0);
    for (const std::size_t field : {std::size_t{16}, std::size_t{36}}) {  // unpacked size, size of the records
      Bytes bytes = written.bytes;
      set_u64(bytes, chunk.offset + mcap::kRecordHeaderBytes + field, absurd);
      const Outcome outcome = read_all(bytes, ReadMode::kStrict);
      ASSERT_TRUE(outcome.error.has_value());
      EXPECT_THAT(outcome.error->message, StartsWith("byte " + std::to_string(chunk.offset) + ":"));
    }
  }
}

// A chunk of zeros packs 256 MiB into a few kB; a size beyond what zstd can pack is refused before it is allocated.
TEST(McapReader, RefusesAnUnpackedSizeThatThePackedCannotHold) {
  Written written = write_file(1, 30);
  const RecordPlace chunk = records_of(written.bytes, Opcode::kChunk).at(0);
  set_u64(written.bytes, chunk.offset + mcap::kRecordHeaderBytes + 16, mcap::kMaxChunkBytes);
  const Outcome outcome = read_all(written.bytes, ReadMode::kStrict);
  ASSERT_TRUE(outcome.error.has_value());
  EXPECT_THAT(outcome.error->message, HasSubstr("cannot unpack to"));
}

TEST(McapReader, NamesACompressionItDoesNotKnow) {
  Written written = write_file(1, 30);
  const RecordPlace chunk = records_of(written.bytes, Opcode::kChunk).at(0);
  std::memcpy(&written.bytes[chunk.offset + mcap::kRecordHeaderBytes + 32], "brot", 4);
  const Outcome outcome = read_all(written.bytes, ReadMode::kStrict);
  ASSERT_TRUE(outcome.error.has_value());
  EXPECT_THAT(outcome.error->message, HasSubstr("\"brot\""));
}

TEST(McapReader, FindsTheNextChunkBehindADamagedLengthWhenThereIsNoIndex) {
  const Written written = write_file(5, 5'000);
  const auto chunks = records_of(written.bytes, Opcode::kChunk);
  for (const std::uint64_t wrong : {std::uint64_t{100}, std::uint64_t{1} << 50}) {
    Bytes bytes(written.bytes.begin(), written.bytes.begin() + static_cast<std::ptrdiff_t>(chunks[4].end));
    set_u64(bytes, chunks[1].offset + 1, wrong);
    const Outcome outcome = read_all(bytes, ReadMode::kWhole);
    EXPECT_FALSE(outcome.error.has_value());
    auto expected = written.chunks;
    expected.erase(expected.begin() + 1);
    EXPECT_EQ(outcome.messages, joined(expected)) << wrong;
  }
}

TEST(McapReader, ReadsAFileWithoutASummary) {
  Written written = write_file(2, 30);
  const RecordPlace data_end = records_of(written.bytes, Opcode::kDataEnd).at(0);
  Bytes bytes(written.bytes.begin(), written.bytes.begin() + static_cast<std::ptrdiff_t>(data_end.end));
  Bytes footer(mcap::kRecordHeaderBytes + mcap::kFooterContentBytes);
  footer[0] = static_cast<std::byte>(Opcode::kFooter);
  footer[1] = std::byte{mcap::kFooterContentBytes};
  bytes.insert(bytes.end(), footer.begin(), footer.end());
  for (const std::uint8_t byte : mcap::kMagic) bytes.push_back(std::byte{byte});
  auto reader = McapReader::open(test::source_of(bytes), ReadMode::kStrict);
  ASSERT_TRUE(reader) << reader.error().message;
  const Outcome outcome = read_all(*reader);
  EXPECT_FALSE(outcome.error.has_value());
  EXPECT_EQ(outcome.messages, joined(written.chunks));
  EXPECT_EQ(reader->attachment_names().size(), 1U);
}

TEST(McapReader, ReadsAFileWithoutMessages) {
  const Written written = write_file(0, 0);
  const Outcome outcome = read_all(written.bytes, ReadMode::kStrict);
  EXPECT_FALSE(outcome.error.has_value());
  EXPECT_TRUE(outcome.messages.empty());
}

TEST(McapReader, SurvivesGarbledFiles) {
  const Written written = write_file(3, 60);
  std::mt19937 random(9);
  for (int round = 0; round < 3000; ++round) {
    Bytes bytes = written.bytes;
    const int changes = 1 + static_cast<int>(random() % 6);
    for (int i = 0; i < changes; ++i) {
      bytes[mcap::kMagic.size() + random() % (bytes.size() - mcap::kMagic.size())] = static_cast<std::byte>(random());
    }
    if (random() % 2 == 0) bytes.resize(mcap::kMagic.size() + random() % bytes.size());
    const Outcome outcome = read_all(bytes, ReadMode::kWhole);
    EXPECT_FALSE(outcome.error.has_value()) << outcome.error->message;
    EXPECT_EQ(outcome.damage.empty(), bytes == written.bytes);
  }
}

TEST(McapReader, BitFlipsAndCutsAreNeverTakenForWhole) {
  const Written written = write_file(3, 60);
  test::Damage damage;
  for (int trial = 0; trial < test::Damage::kCopies; ++trial) {
    const Bytes damaged = damage.copy_of(written.bytes);
    const Outcome outcome = read_all(damaged, ReadMode::kStrict);
    EXPECT_TRUE(outcome.error.has_value()) << trial << ": " << damaged.size();
  }
}

}  // namespace
}  // namespace perimap

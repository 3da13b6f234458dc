#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/crc32.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/foxglove_pose.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "tests/unit/recording/memory_file.hpp"
#include "tests/unit/recording/samples.hpp"

namespace perimap {
namespace {

using test::Bytes;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The current directory of the test program is a build folder.
class TemporaryFile {
 public:
  TemporaryFile() : path_(std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".mcap") {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

Bytes small_recording() {
  Bytes bytes;
  auto writer = RecordingWriter::create(std::make_unique<test::MemorySink>(bytes)).value();
  const ChannelId pose = writer.add_channel<perimap_TrackerPose>(channels::kTrackerPose).value();
  const ChannelId ecg = writer.add_channel<perimap_EcgSamples>(channels::kEcgSamples).value();
  for (std::uint32_t i = 0; i < 5; ++i) {
    const Instant source_time = from_ns(1'000'000 * i);
    const Instant arrival = source_time + std::chrono::microseconds(300);
    EXPECT_TRUE(writer.write(pose, *test::make_sample<perimap_TrackerPose>(i), arrival, source_time, i));
    EXPECT_TRUE(writer.write(ecg, *test::make_sample<perimap_EcgSamples>(i), arrival, source_time, i));
  }
  const std::string text = "seed = 1\n";
  EXPECT_TRUE(writer.write_attachment(attachments::kConfiguration, "application/toml", std::as_bytes(std::span(text))));
  EXPECT_TRUE(writer.finish());
  return bytes;
}

TEST(Recording, GivesSamplesBackWithTheirTimes) {
  auto reader = RecordingReader::open(test::source_of(small_recording()), "demo.mcap", ReadMode::kStrict).value();
  for (std::uint32_t i = 0; i < 5; ++i) {
    auto message = reader.next();
    ASSERT_TRUE(message && *message);
    EXPECT_EQ((*message)->channel, channels::kTrackerPose);
    EXPECT_EQ((*message)->type, "perimap::TrackerPose");
    EXPECT_EQ((*message)->source_time, from_ns(1'000'000 * i));
    EXPECT_EQ((*message)->arrival, from_ns(1'000'000 * i + 300'000));
    EXPECT_EQ((*message)->sequence, i);
    const auto pose = reader.decode<perimap_TrackerPose>(**message);
    ASSERT_TRUE(pose) << pose.error().message;
    EXPECT_EQ(test::to_json(**pose), test::to_json(*test::make_sample<perimap_TrackerPose>(i)));
    message = reader.next();
    ASSERT_TRUE(message && *message);
    EXPECT_EQ((*message)->channel, channels::kEcgSamples);
  }
  EXPECT_FALSE(reader.next().value().has_value());
  EXPECT_EQ(reader.attachment(attachments::kConfiguration).value(), "seed = 1\n");
}

TEST(Recording, ListsChannelsWithTheSchemaTheyWereRecordedWith) {
  const auto reader = RecordingReader::open(test::source_of(small_recording()), "demo.mcap", ReadMode::kStrict).value();
  const auto channels = reader.channels();
  ASSERT_EQ(channels.size(), 2U);
  EXPECT_EQ(channels[0].name, "tracker/pose");
  EXPECT_EQ(channels[0].type, "perimap::TrackerPose");
  EXPECT_THAT(channels[0].schema_text, HasSubstr("struct TrackerPose {"));
}

TEST(Recording, GivesOnlySelectedChannels) {
  auto reader = RecordingReader::open(test::source_of(small_recording()), "demo.mcap", ReadMode::kStrict).value();
  const std::string_view names[] = {channels::kEcgSamples};
  ASSERT_TRUE(reader.select(names));
  int count = 0;
  while (auto message = reader.next().value()) {
    EXPECT_EQ(message->channel, channels::kEcgSamples);
    ++count;
  }
  EXPECT_EQ(count, 5);
  const std::string_view missing[] = {channels::kCameraImage};
  EXPECT_EQ(reader.select(missing).error().message, "demo.mcap: there is no channel \"camera/image\"");
}

TEST(Recording, RefusesToDecodeAnotherType) {
  auto reader = RecordingReader::open(test::source_of(small_recording()), "demo.mcap", ReadMode::kStrict).value();
  const auto message = reader.next().value();
  ASSERT_TRUE(message);
  const auto decoded = reader.decode<perimap_EcgSamples>(*message);
  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().message,
              AllOf(HasSubstr("demo.mcap: byte "), HasSubstr("tracker/pose"), HasSubstr("perimap::EcgSamples")));
}

TEST(Recording, RefusesToWriteAnotherTypeOrATimeBeforeTheEpoch) {
  Bytes bytes;
  auto writer = RecordingWriter::create(std::make_unique<test::MemorySink>(bytes)).value();
  const ChannelId ecg = writer.add_channel<perimap_EcgSamples>(channels::kEcgSamples).value();
  const auto wrong = writer.write(ecg, perimap_TrackerPose{}, from_ns(0), from_ns(0), 0);
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, AllOf(HasSubstr("perimap::EcgSamples"), HasSubstr("perimap::TrackerPose")));
  EXPECT_FALSE(writer.write(ecg, perimap_EcgSamples{}, from_ns(0), from_ns(-1), 0));
  EXPECT_TRUE(writer.write(ecg, perimap_EcgSamples{}, from_ns(0), from_ns(0), 0));
}

TEST(Crc32, IsThatOfTheStandardAndGoesOn) {
  const std::string text = "123456789";
  const auto bytes = std::as_bytes(std::span(text));
  EXPECT_EQ(crc32_update(0, bytes), 0xCBF43926U);
  EXPECT_EQ(crc32_update(crc32_update(0, bytes.first(4)), bytes.subspan(4)), 0xCBF43926U);
  EXPECT_EQ(crc32_update(0x1234U, {}), 0x1234U);
}

// More than is on its way to the disk at a time.
TEST(FileSink, WritesEveryByteOfALargeFile) {
  const TemporaryFile file;
  constexpr std::size_t kPiece = 3'000'001, kPieces = 9;
  Bytes all(kPiece * kPieces);
  std::uint32_t value = 1;
  for (std::byte& b : all) b = static_cast<std::byte>((value = value * 1664525U + 1013904223U) >> 24U);
  const auto sink = create_file(file.path()).value();
  for (std::size_t i = 0; i < kPieces; ++i) ASSERT_TRUE(sink->write(std::span(all).subspan(i * kPiece, kPiece)));
  ASSERT_TRUE(sink->close());
  std::ifstream in(file.path(), std::ios::binary);
  const std::string read((std::istreambuf_iterator<char>(in)), {});
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(read)), std::span<const std::byte>(all)));
}

TEST(FileSink, WritesToWhatIsNoFileOnADisk) {
  const auto sink = create_file("/dev/null").value();
  const Bytes piece(std::size_t{20} << 20U);
  EXPECT_TRUE(sink->write(piece));
  EXPECT_TRUE(sink->write(piece));
  EXPECT_TRUE(sink->close());
}

TEST(FileSink, SaysThatTheDiskIsFull) {
  const auto sink = create_file("/dev/full").value();
  EXPECT_EQ(sink->write(Bytes(1)).error().message, "/dev/full: cannot write: No space left on device");
}

TEST(Recording, GoesThroughAFile) {
  const TemporaryFile file;
  {
    auto writer = RecordingWriter::create(file.path()).value();
    const ChannelId pose = writer.add_channel<perimap_TrackerPose>(channels::kTrackerPose).value();
    ASSERT_TRUE(writer.write(pose, *test::make_sample<perimap_TrackerPose>(3), from_ns(2), from_ns(1), 0));
    ASSERT_TRUE(writer.finish());
  }
  auto reader = RecordingReader::open(file.path());
  ASSERT_TRUE(reader) << reader.error().message;
  const auto message = reader->next().value();
  ASSERT_TRUE(message);
  EXPECT_EQ(test::to_json(*reader->decode<perimap_TrackerPose>(*message).value()),
            test::to_json(*test::make_sample<perimap_TrackerPose>(3)));
}

TEST(Recording, IsReadableUpToTheLastFlushWhileItIsWritten) {
  const TemporaryFile file;
  auto writer = RecordingWriter::create(file.path()).value();
  const ChannelId pose = writer.add_channel<perimap_TrackerPose>(channels::kTrackerPose).value();
  ASSERT_TRUE(writer.write(pose, perimap_TrackerPose{}, from_ns(1), from_ns(1), 0));
  ASSERT_TRUE(writer.flush());
  ASSERT_TRUE(writer.write(pose, perimap_TrackerPose{}, from_ns(2), from_ns(2), 1));
  EXPECT_FALSE(RecordingReader::open(file.path(), ReadMode::kStrict));
  auto reader = RecordingReader::open(file.path(), ReadMode::kWhole).value();
  ASSERT_TRUE(reader.next().value().has_value());
  EXPECT_FALSE(reader.next().value().has_value());
  EXPECT_THAT(reader.damage().at(0).message, HasSubstr("not finished"));
}

TEST(Recording, NamesTheFileThatCannotBeOpened) {
  EXPECT_THAT(RecordingReader::open("no/such/file.mcap").error().message, HasSubstr("no/such/file.mcap: "));
  EXPECT_THAT(RecordingReader::open(".").error().message, HasSubstr(".: cannot open: Is a directory"));
  EXPECT_THAT(RecordingWriter::create("no/such/file.mcap").error().message, HasSubstr("no/such/file.mcap: "));
}

TEST(FoxgloveImage, BorrowsContiguousPixelsAndPacksOthers) {
  const std::vector<std::uint8_t> pixels{1, 2, 3, 0, 4, 5, 6, 0};
  std::vector<std::uint8_t> packed;
  const std::string frame_id = "camera";
  const Instant time = from_ns(12'345'678'901);
  const auto message = borrow_raw_image({pixels.data(), 3, 2, 4}, time, frame_id, packed);
  EXPECT_EQ(message.timestamp.sec, 12U);
  EXPECT_EQ(message.timestamp.nsec, 345'678'901U);
  EXPECT_EQ(message.step, 3U);
  EXPECT_THAT(std::vector<int>(message.data._buffer, message.data._buffer + message.data._length),
              ElementsAre(1, 2, 3, 4, 5, 6));
  const auto borrowed = borrow_raw_image({pixels.data(), 4, 2, 4}, time, frame_id, packed);
  EXPECT_EQ(borrowed.data._buffer, pixels.data());

  const auto frame = borrow_camera_frame(message);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->width, 3);
  EXPECT_EQ(frame->height, 2);
  EXPECT_EQ(frame->format, PixelFormat::kGrey);
  EXPECT_EQ(frame->bytes[5], std::byte{6});
}

TEST(FoxgloveImage, KeepsTheRowsOfACameraAndNothingBehindThem) {
  const std::vector<std::byte> bytes(100, std::byte{1});
  const std::string frame_id = "camera";
  CameraFrame frame;
  frame.format = PixelFormat::kYuyv;
  frame.width = 4;
  frame.height = 3;
  frame.stride = 10;
  frame.bytes = bytes;
  const auto message = borrow_raw_image(frame, frame_id);
  EXPECT_STREQ(message.encoding, "yuyv");
  EXPECT_EQ(message.step, 10U);
  EXPECT_EQ(message.data._length, 30U);
  const auto back = borrow_camera_frame(message);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->format, PixelFormat::kYuyv);
  EXPECT_EQ(back->stride, 10U);
}

TEST(FoxgloveImage, RefusesSizesThatDoNotFitAndOtherEncodings) {
  std::vector<std::uint8_t> pixels(6);
  std::vector<std::uint8_t> packed;
  const std::string frame_id = "camera";
  const auto whole = borrow_raw_image({pixels.data(), 3, 2, 3}, from_ns(0), frame_id, packed);
  ASSERT_TRUE(borrow_camera_frame(whole));
  auto image = whole;
  image.height = 3;
  EXPECT_FALSE(borrow_camera_frame(image));
  image = whole;
  image.height = image.step = 0xffffffffU;
  EXPECT_FALSE(borrow_camera_frame(image));
  image = whole;
  image.step = 2;
  EXPECT_FALSE(borrow_camera_frame(image));
  image = whole;
  std::string other = "rgb8";
  image.encoding = other.data();
  EXPECT_THAT(borrow_camera_frame(image).error().message, HasSubstr("\"rgb8\""));
  image.encoding = nullptr;
  EXPECT_FALSE(borrow_camera_frame(image));
}

TEST(FoxglovePose, IsInMetresWithTheScalarPartLast) {
  const std::string frame_id = "tracker";
  const double wxyz[4] = {0.6, 0.8, 0.0, 0.0};
  const auto message = borrow_pose_in_frame(pose_from_wxyz({10, 20, 30}, wxyz), from_ns(1), frame_id);
  EXPECT_DOUBLE_EQ(message.pose.position.y, 0.020);
  EXPECT_NEAR(message.pose.orientation.x, 0.8, 1e-12);
  EXPECT_NEAR(message.pose.orientation.w, 0.6, 1e-12);
  EXPECT_STREQ(message.frame_id, "tracker");
}

}  // namespace
}  // namespace perimap

#include "daemon/runtime/session_recorder.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <thread>
#include <vector>

#include "counted_allocations.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/standins/emulator/played_session.hpp"
#include "tests/unit/camera/made_jpeg.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;
constexpr std::size_t kMemory = std::size_t{1} << 20U;

class SessionRecording : public ::testing::Test {
 protected:
  SessionRecording() {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-record-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    file_ = folder_ / "session.mcap";
  }
  ~SessionRecording() override { std::filesystem::remove_all(folder_); }
  SessionRecording(const SessionRecording&) = delete;
  SessionRecording& operator=(const SessionRecording&) = delete;

  std::unique_ptr<SessionRecorder> recorder(std::size_t memory = kMemory) const {
    auto created =
        SessionRecorder::create(file_, {"test", "test", "tracker", {}, {}, "camera_matrix", "version = 1\n"}, memory);
    EXPECT_TRUE(created) << created.error().message;
    return std::move(*created);
  }

  CameraFrame frame(std::uint64_t sequence, Instant arrival, PixelFormat format = PixelFormat::kYuyv) {
    // Random, so that frames stay as large on the disk as they are.
    for (std::byte& b : pixels_) b = static_cast<std::byte>(random_());
    CameraFrame f;
    f.stamp = {sequence, arrival - milliseconds(20), arrival};
    f.format = format;
    f.width = kWidth;
    f.height = kHeight;
    f.stride = format == PixelFormat::kMjpg ? 0 : 2 * kWidth;
    f.bytes = pixels_;
    return f;
  }
  static TrackerSample pose(std::uint32_t count, Instant arrival) {
    TrackerSample s;
    s.device_frame = count;
    s.source_time = arrival - milliseconds(5);
    s.arrival = arrival;
    s.state = count % 2 == 0 ? ToolState::kOk : ToolState::kOutOfVolume;
    return s;
  }
  static EcgBlock block(std::uint32_t count, Instant arrival) {
    EcgBlock b;
    b.device_sequence = count;
    b.first_sample_time = arrival - milliseconds(4);
    b.arrival = arrival;
    b.sample_period = milliseconds(4);
    b.count = 1;
    b.mV[0] = 0.25F;
    return b;
  }

  ThreadLauncher threads{SchedulingSettings{}};
  std::filesystem::path folder_;
  std::filesystem::path file_;
  std::minstd_rand random_{1};
  std::array<std::byte, std::size_t{2} * kWidth * kHeight> pixels_;
};

struct Counts {
  int frames = 0, poses = 0, valid_poses = 0, blocks = 0;
  std::uint64_t last_frame = 0;
  std::vector<Error> damage;
};

Counts read(const std::filesystem::path& file, ReadMode mode = ReadMode::kStrict) {
  Counts counts;
  auto reader = ReplayReader::open(file.string(), mode);
  EXPECT_TRUE(reader) << reader.error().message;
  if (!reader) return counts;
  for (;;) {
    const auto event = reader->next();
    EXPECT_TRUE(event) << event.error().message;
    if (!event || !*event) break;
    if (const auto* frame = std::get_if<FrameEvent>(&**event)) {
      ++counts.frames;
      EXPECT_EQ(frame->stamp.sequence, counts.last_frame + 1);
      counts.last_frame = frame->stamp.sequence;
    } else if (const auto* pose = std::get_if<TrackerSample>(&**event)) {
      ++counts.poses;
      if (pose->state == ToolState::kOk) ++counts.valid_poses;
    } else {
      ++counts.blocks;
    }
  }
  counts.damage = reader->damage();
  return counts;
}

TEST_F(SessionRecording, OtherToolsHaveChannelsOfTheirOwnThatAReplayPassesOver) {
  SensorRecordingFacts facts{"test", "test", "tracker", {}, {}, "camera_matrix", "version = 1\n"};
  facts.tools = {"tracker/reference", "tracker/pointer"};
  {
    auto session = SessionRecorder::create(file_, facts, kMemory);
    ASSERT_TRUE(session) << session.error().message;
    (*session)->start(threads);
    (*session)->frame(frame(1, MonotonicClock::now()));
    (*session)->ecg(block(1, MonotonicClock::now()));
    for (std::uint32_t i = 1; i <= 10; ++i) {
      const Instant now = MonotonicClock::now();
      ToolSample tool;
      static_cast<TrackerSample&>(tool) = pose(i, now);
      tool.error_mm = 0.25;
      for (tool.tool = 0; tool.tool < 2; ++tool.tool) (*session)->tool(tool);
      (*session)->pose(pose(i, now));
    }
    (*session)->stop();
    EXPECT_EQ((*session)->reason(), "");
    EXPECT_EQ((*session)->summary().recorded, 32U);
  }
  const Counts counts = read(file_);
  EXPECT_EQ(counts.poses, 10);
  EXPECT_EQ(counts.frames, 1);

  auto reader = RecordingReader::open(file_.string());
  ASSERT_TRUE(reader) << reader.error().message;
  const std::string_view pointer[] = {"tracker/pointer"};
  ASSERT_TRUE(reader->select(pointer));
  std::uint32_t count = 0;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    const auto told = reader->decode<perimap_TrackerPose>(**message);
    ASSERT_TRUE(told) << told.error().message;
    EXPECT_EQ((*told)->device_frame, ++count);
    EXPECT_EQ((*told)->error_mm, 0.25);
  }
  EXPECT_EQ(count, 10U);

  // An emulated tracker plays them again, but for the reference, whose frame the others may be in.
  const auto played = PlayedSession::read(file_.string());
  ASSERT_TRUE(played) << played.error().message;
  const auto tools = played->tools(Instant(std::chrono::seconds(1)));
  ASSERT_EQ(tools.size(), 1U);
  EXPECT_EQ(tools.front().first, "pointer");
  EXPECT_EQ(tools.front().second.size(), 10U);
}

TEST_F(SessionRecording, OfThreeThreadsReplaysInOrderOfArrival) {
  const auto session = recorder();
  session->start(threads);
  constexpr int kEach = 60;
  std::thread camera([&] {
    for (int i = 1; i <= kEach; ++i) {
      session->frame(frame(static_cast<std::uint64_t>(i), MonotonicClock::now()));
      std::this_thread::sleep_for(milliseconds(3));
    }
  });
  std::thread tracker([&] {
    for (int i = 1; i <= kEach; ++i) {
      session->pose(pose(static_cast<std::uint32_t>(i), MonotonicClock::now()));
      std::this_thread::sleep_for(milliseconds(2));
    }
  });
  for (int i = 1; i <= kEach; ++i) {
    session->ecg(block(static_cast<std::uint32_t>(i), MonotonicClock::now()));
    std::this_thread::sleep_for(milliseconds(1));
  }
  camera.join();
  tracker.join();
  session->stop();
  EXPECT_EQ(session->reason(), "");
  const auto summary = session->summary();
  EXPECT_FALSE(summary.stopped);
  EXPECT_EQ(summary.recorded, 3U * kEach);
  EXPECT_EQ(summary.frames_not_recorded + summary.other_not_recorded, 0U);
  const Counts counts = read(file_);
  EXPECT_EQ(counts.frames, kEach);
  EXPECT_EQ(counts.poses, kEach);
  EXPECT_EQ(counts.valid_poses, kEach / 2);
  EXPECT_EQ(counts.blocks, kEach);
}

TEST_F(SessionRecording, KeepsFramesInTheCamerasOwnFormat) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, [](int x, int) { return static_cast<std::uint8_t>(100 + x); });
  const Instant now = MonotonicClock::now();
  auto session = recorder();
  session->start(threads);
  CameraFrame compressed = frame(1, now, PixelFormat::kMjpg);
  compressed.bytes = jpeg;
  session->frame(compressed);
  session->pose(pose(2, now));
  session->ecg(block(1, now));
  session->stop();
  auto reader = RecordingReader::open(file_.string()).value();
  bool seen = false;
  for (auto message = reader.next().value(); message; message = reader.next().value()) {
    if (message->type != "foxglove::CompressedImage") continue;
    const auto image = reader.decode<foxglove_CompressedImage>(*message).value();
    const auto bytes = std::as_bytes(std::span(image->data._buffer, image->data._length));
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), jpeg.begin(), jpeg.end()));
    seen = true;
  }
  EXPECT_TRUE(seen);
  // And a replay sees its luma, and the colour.
  int frames = 0;
  auto replay = ReplayReader::open(file_.string(), ReadMode::kStrict).value();
  for (auto event = replay.next().value(); event; event = replay.next().value()) {
    const auto* shown = std::get_if<FrameEvent>(&*event);
    if (shown == nullptr) continue;
    ++frames;
    EXPECT_NEAR(shown->pixels[10], 110, 4);
    const ColourImage colour = shown->colour();
    ASSERT_NE(colour.bgr, nullptr);
    EXPECT_GT(colour.row(0)[1], colour.row(0)[0] + 40);  // of chroma 90, 90
  }
  EXPECT_EQ(frames, 1);
}

TEST_F(SessionRecording, OfAFrameThatCanNotBeDecodedReplaysWithoutItAndSaysSo) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, [](int x, int) { return static_cast<std::uint8_t>(100 + x); });
  const Instant now = MonotonicClock::now();
  auto session = recorder();
  session->start(threads);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    CameraFrame compressed = frame(i, now, PixelFormat::kMjpg);
    compressed.bytes = std::span(jpeg).first(i == 2 ? jpeg.size() / 3 : jpeg.size());
    session->frame(compressed);
  }
  session->pose(pose(2, now));
  session->ecg(block(1, now));
  session->stop();
  auto replay = ReplayReader::open(file_.string(), ReadMode::kStrict).value();
  std::vector<std::uint64_t> frames;
  for (auto event = replay.next().value(); event; event = replay.next().value()) {
    if (const auto* shown = std::get_if<FrameEvent>(&*event)) frames.push_back(shown->stamp.sequence);
  }
  EXPECT_EQ(frames, (std::vector<std::uint64_t>{1, 3}));
  ASSERT_EQ(replay.damage().size(), 1U);
  EXPECT_THAT(replay.damage()[0].message, AllOf(HasSubstr(file_.string()), HasSubstr("1 frames could not be decoded")));
}

TEST_F(SessionRecording, OfOneThatIsPlayedHasItsFramesAsTheyCame) {
  const auto jpeg = test::make_jpeg(kWidth, kHeight, [](int x, int) { return static_cast<std::uint8_t>(100 + x); });
  for (const PixelFormat format : {PixelFormat::kMjpg, PixelFormat::kYuyv}) {
    SCOPED_TRACE(pixel_format_name(format));
    const Instant now = MonotonicClock::now();
    CameraFrame came = frame(1, now, format);
    if (format == PixelFormat::kMjpg) came.bytes = jpeg;
    file_ = folder_ / fmt::format("played-{}.mcap", pixel_format_name(format));
    auto first = recorder();
    first->start(threads);
    first->frame(came);
    first->pose(pose(2, now));
    first->ecg(block(1, now));
    first->stop();
    auto played = ReplayReader::open(file_.string(), ReadMode::kStrict).value();
    file_ += ".again";
    auto again = recorder();
    again->start(threads);
    {
      ReplayFeeder feeder(std::move(played), {nullptr, again.get()});
      feeder.start(threads);
      while (!feeder.ended()) std::this_thread::sleep_for(milliseconds(5));
    }
    again->stop();
    auto reader = ReplayReader::open(file_.string(), ReadMode::kStrict).value();
    reader.keep_frames_as_they_came();
    int frames = 0;
    for (auto event = reader.next().value(); event; event = reader.next().value()) {
      const auto* shown = std::get_if<FrameEvent>(&*event);
      if (shown == nullptr) continue;
      ++frames;
      EXPECT_EQ(shown->as_it_came().format, format);
      EXPECT_TRUE(std::equal(came.bytes.begin(), came.bytes.end(), shown->bytes.begin(), shown->bytes.end()));
    }
    EXPECT_EQ(frames, 1);
  }
}

TEST_F(SessionRecording, CountsFramesThatFindNoRoomAndTakesNothingFromTheHeap) {
  const auto session = recorder(3 * pixels_.size());
  const Instant now = MonotonicClock::now();
  // Nobody writes yet.
  const long allocations = test::allocations_of([&] {
    for (std::uint64_t i = 1; i <= 10; ++i) session->frame(frame(i, now));
    session->pose(pose(2, now));
    session->ecg(block(1, now));
  });
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(session->summary().frames_not_recorded, 7U);
  session->start(threads);
  session->stop();
  EXPECT_EQ(session->summary().recorded, 5U);
  EXPECT_EQ(read(file_).frames, 3);
}

TEST_F(SessionRecording, OneThatComesAfterLaterOnesKeepsTheOrder) {
  const auto session = recorder();
  session->start(threads);
  const Instant now = MonotonicClock::now();
  session->frame(frame(1, now));
  session->ecg(block(1, now));
  ASSERT_TRUE(wait_until([&] { return session->summary().recorded == 2; }));
  session->pose(pose(2, now - milliseconds(100)));
  session->stop();
  const Counts counts = read(file_);
  EXPECT_EQ(counts.frames + counts.poses + counts.blocks, 3);
}

TEST_F(SessionRecording, AFullDiskStopsItAndNothingElse) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{200'000, before.rlim_max};
  const auto session = recorder();
  session->start(threads);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::uint64_t given = 0;
  const bool stopped = wait_until([&] {
    session->frame(frame(++given, MonotonicClock::now()));
    session->pose(pose(2, MonotonicClock::now()));
    session->ecg(block(1, MonotonicClock::now()));
    return session->summary().stopped;
  });
  session->frame(frame(++given, MonotonicClock::now()));
  session->stop();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_TRUE(stopped);
  EXPECT_THAT(session->reason(), HasSubstr("session.mcap: cannot write: File too large"));
  const auto summary = session->summary();
  EXPECT_EQ(summary.recorded + summary.frames_not_recorded + summary.other_not_recorded, 3 * given - 2);
  EXPECT_GE(summary.frames_not_recorded, 1U);
}

// What was pushed into the recorder is not lost with the process, but for the last second or so.
TEST_F(SessionRecording, ACrashLeavesWhatWasWrittenReadable) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto session = recorder(8 * kMemory);
    session->start(threads);
    for (std::uint64_t i = 1;; ++i) {
      session->frame(frame(i, MonotonicClock::now()));
      session->pose(pose(2, MonotonicClock::now()));
      session->ecg(block(1, MonotonicClock::now()));
      std::this_thread::sleep_for(milliseconds(1));
    }
  }
  // More than a chunk can be: the first is whole, whatever is being written.
  constexpr std::uintmax_t kMoreThanAChunk = 5'000'000;
  std::error_code error;
  const bool grew = wait_until([&] { return std::filesystem::file_size(file_, error) > kMoreThanAChunk && !error; });
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_TRUE(grew);
  const Counts counts = read(file_, ReadMode::kWhole);
  EXPECT_GT(counts.frames, 30);
  EXPECT_GT(counts.poses, 30);
  EXPECT_FALSE(counts.damage.empty());
}

TEST_F(SessionRecording, IsEndedWholeAndBegunAnewInAnotherFileWhileTheDevicesGoOn) {
  const SensorRecordingFacts facts{"test", "test", "tracker", {}, {}, "camera_matrix", "version = 1\n"};
  SessionRecorder session(kMemory);
  session.start(threads);
  EXPECT_FALSE(session.summary().asked);
  EXPECT_FALSE(session.close()) << "there is nothing to end";
  std::uint64_t sequence = 0;
  const auto give = [&](int n) {
    for (int i = 0; i < n; ++i) {
      const Instant now = MonotonicClock::now();
      session.frame(frame(++sequence, now));
      session.pose(pose(2, now));
      session.ecg(block(1, now));
      std::this_thread::sleep_for(milliseconds(2));
    }
  };
  give(5);  // nobody asks for these
  const std::filesystem::path second = folder_ / "second.mcap";
  for (const std::filesystem::path& file : {file_, second}) {
    ASSERT_TRUE(session.open(file, facts));
    EXPECT_FALSE(session.open(folder_ / "third.mcap", facts)) << "one is open";
    EXPECT_EQ(session.file(), file);
    EXPECT_TRUE(session.summary().asked);
    sequence = 0;
    give(20);
    ASSERT_TRUE(session.close());
    EXPECT_FALSE(session.summary().asked);
    // Whole as soon as close() has returned.
    const Counts counts = read(file);
    EXPECT_EQ(counts.frames, 20);
    EXPECT_EQ(counts.poses, 20);
    EXPECT_EQ(counts.blocks, 20);
    give(7);
  }
  session.stop();
  const auto summary = session.summary();
  EXPECT_EQ(summary.files, 2U);
  EXPECT_EQ(summary.recorded, 120U);
  EXPECT_EQ(summary.frames_not_recorded + summary.other_not_recorded, 0U) << "what was not asked for is not missing";
}

TEST_F(SessionRecording, ThatCouldNotBeBegunCountsAsStoppedUntilItIsAskedForNoMore) {
  SessionRecorder session(kMemory);
  session.start(threads);
  EXPECT_FALSE(session.open(folder_ / "not there" / "session.mcap", {}));
  EXPECT_TRUE(session.summary().asked);
  EXPECT_TRUE(session.summary().stopped);
  EXPECT_NE(session.reason(), "");
  const auto closed = session.close();
  ASSERT_FALSE(closed);
  EXPECT_THAT(closed.error().message, HasSubstr("not there"));
  EXPECT_FALSE(session.summary().asked);
  EXPECT_FALSE(session.summary().stopped);
}

TEST_F(SessionRecording, OverwritesNothing) {
  { const auto session = recorder(); }
  const auto again = SessionRecorder::create(file_, {}, kMemory);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().message, HasSubstr("is there already"));
}

TEST(RecordingFacts, LeaveOutWhatTheDriversHaveDoneAlready) {
  Configuration configuration;
  configuration.camera.device = "v4l2:/dev/video0";
  configuration.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  configuration.tracker.port = "/dev/ttyUSB0";
  configuration.tracker.translation_IW_mm[0] = 5.0;
  configuration.tracker.position_deviation_mm = 1.4;
  const auto facts = recording_facts(configuration, std::nullopt, "test");
  ASSERT_TRUE(facts.configuration);
  EXPECT_THAT(*facts.configuration, HasSubstr("position_deviation_mm = 1.4"));
  EXPECT_THAT(*facts.configuration, ::testing::Not(HasSubstr("video0")));
  EXPECT_THAT(*facts.configuration, ::testing::Not(HasSubstr("ttyUSB0")));
  EXPECT_THAT(*facts.configuration, ::testing::Not(HasSubstr("registration")));
  EXPECT_FALSE(facts.calibration);
}

TEST(RecordingPath, TellsWhenItBegan) {
  const std::chrono::system_clock::time_point at(std::chrono::seconds(1'795'304'701));
  EXPECT_EQ(recording_path("/data", at), "/data/perimap-20261121-234501.mcap");
}

}  // namespace
}  // namespace perimap

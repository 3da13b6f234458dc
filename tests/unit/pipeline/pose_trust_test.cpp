#include "core/pipeline/pose_trust.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace perimap {
namespace {

using std::chrono::milliseconds;

// A tracker that reads every 10 ms and a camera of 30 frames/s, before which the scope sways.
struct Trust : ::testing::Test {
  static constexpr int kWidth = 16, kHeight = 12;

  PipelineCounters counters;
  PoseTrust trust{PoseHistorySettings{}, nullptr, counters};
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{2, 0});
  std::vector<std::uint8_t> now = std::vector<std::uint8_t>(kWidth * kHeight, 50);
  std::vector<std::uint8_t> before = now;
  int read_ms = 0;
  int frame = 0;
  std::optional<Pose> stuck_at;  // what the tracker gives again and again
  bool picture_stands = false;
  FrameRecord* record = nullptr;

  [[nodiscard]] static Pose pose_at(int ms) {
    Pose pose;
    pose.t = Vector3d(20.0 * std::sin(0.002 * ms), 0.0, 100.0);
    return pose;
  }

  PoseTrust::Told next_frame() {
    const int ms = 33 * ++frame;
    for (; read_ms <= ms + 20; read_ms += 10) {
      TrackerSample sample;
      sample.source_time = sample.arrival = Instant(milliseconds(1000 + read_ms));
      sample.state = ToolState::kOk;
      sample.X_WS = stuck_at ? *stuck_at : pose_at(read_ms);
      trust.add(sample);
    }
    const Instant capture(milliseconds(1000 + ms));
    record = &history->append({static_cast<std::uint64_t>(frame), capture, capture + milliseconds(12)});
    before = now;
    if (!picture_stands) now[static_cast<std::size_t>(frame % (kWidth * kHeight))] ^= 1U;
    return trust.begin_frame(*record, *history, {now.data(), kWidth, kHeight, kWidth},
                             {before.data(), kWidth, kHeight, kWidth});
  }
};

TEST_F(Trust, TellsThePoseThatTheTrackerRead) {
  for (int i = 0; i < 30; ++i) {
    const PoseTrust::Told told = next_frame();
    ASSERT_TRUE(told.pose.valid());
    EXPECT_NEAR((told.pose.X_WC.t - pose_at(33 * frame).t).norm(), 0.0, 0.01);
    EXPECT_FALSE(told.mistaken_since);
    EXPECT_FALSE(record->repeated);
  }
  EXPECT_FALSE(trust.doubts().pose_repeated);
  EXPECT_FALSE(trust.doubts().picture_repeated);
}

TEST_F(Trust, AReadingThatIsGivenAgainAndAgainAfterTheCameraHadMovedIsNoPoseAndWasNone) {
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(next_frame().pose.valid());
  const int stuck_ms = read_ms - 10;
  stuck_at = pose_at(stuck_ms);
  std::optional<std::uint64_t> mistaken_since;
  int frames = 0;
  while (!mistaken_since) {
    ASSERT_LT(++frames, 30);
    mistaken_since = next_frame().mistaken_since;
  }
  EXPECT_GE(33 * frames, 450);
  EXPECT_TRUE(trust.doubts().pose_repeated);
  const Instant since = history->find(*mistaken_since)->stamp.capture;
  EXPECT_GE(since, Instant(milliseconds(1000 + stuck_ms)));
  EXPECT_LT(since, Instant(milliseconds(1000 + stuck_ms + 34)));
  const PoseTrust::Told told = next_frame();
  EXPECT_FALSE(told.pose.valid());
  EXPECT_FALSE(told.mistaken_since) << "it is said once";
  stuck_at.reset();
  static_cast<void>(next_frame());
  EXPECT_TRUE(next_frame().pose.valid());
}

TEST_F(Trust, APictureThatIsGivenAgainIsSaidAtOnceAndDoubtedWhenItLasts) {
  for (int i = 0; i < 5; ++i) static_cast<void>(next_frame());
  picture_stands = true;
  static_cast<void>(next_frame());
  EXPECT_TRUE(record->repeated);
  EXPECT_FALSE(trust.doubts().picture_repeated);
  for (int i = 0; i < 16; ++i) static_cast<void>(next_frame());
  EXPECT_TRUE(trust.doubts().picture_repeated);
  EXPECT_EQ(counters.frames_repeated.get(), 17U);
}

}  // namespace
}  // namespace perimap

#include "drivers/standins/emulator/pose_track.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "drivers/standins/emulator/igtl_emulator.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Instant kStart = Instant(std::chrono::seconds(100));
constexpr Instant kRecorded = Instant(std::chrono::seconds(7));

// A tool that moves along x by 1 mm a millisecond.
std::vector<TrackerSample> moving(const std::vector<int>& at_ms) {
  std::vector<TrackerSample> samples;
  for (const int t : at_ms) {
    TrackerSample sample;
    sample.source_time = kRecorded + milliseconds(t);
    sample.state = ToolState::kOk;
    sample.X_WS.t = Vector3d(t, 0.0, 0.0);
    samples.push_back(sample);
  }
  return samples;
}

TEST(PoseTrack, IsWhereTheToolWasWhateverTheGapsBetweenItsReadings) {
  // The mean rate of all would be 46 Hz, and frame 12 would be long after the end.
  const PoseTrack track = PoseTrack::of_samples(kStart, moving({0, 10, 20, 120, 130}));
  EXPECT_NEAR(track.rate_hz(), 100.0, 1e-9);
  for (const int frame : {0, 1, 2, 12, 13}) {
    ASSERT_EQ(track.at(frame).state, ToolState::kOk) << frame;
    EXPECT_NEAR(track.at(frame).X_TO.t.x(), 10.0 * frame, 1e-9);
  }
  for (const int frame : {-1, 3, 7, 11, 14}) EXPECT_EQ(track.at(frame).state, ToolState::kMissing) << frame;
}

TEST(PoseTrack, IsWhereTheToolWasWhenReadingsCameUnevenly) {
  const PoseTrack track = PoseTrack::of_samples(kStart, moving({0, 7, 21, 33, 40, 48, 60}));
  EXPECT_NEAR(track.rate_hz(), 100.0, 1e-9);
  for (int frame = 0; frame <= 6; ++frame) {
    ASSERT_EQ(track.at(frame).state, ToolState::kOk) << frame;
    EXPECT_NEAR(track.at(frame).X_TO.t.x(), 10.0 * frame, 1e-6);
  }
}

TEST(PoseTrack, IsMissingWhereTheToolWas) {
  std::vector<TrackerSample> samples = moving({0, 10, 20, 30});
  samples[1].state = ToolState::kOutOfVolume;
  const PoseTrack track = PoseTrack::of_samples(kStart, samples);
  EXPECT_EQ(track.at(0).state, ToolState::kOk);
  EXPECT_EQ(track.at(1).state, ToolState::kOutOfVolume);
  EXPECT_EQ(track.at(2).state, ToolState::kOk);
}

TEST(PoseTrack, OverOpenIgtlinkEachReadingIsSentAtItsOwnTime) {
  const PoseTrack track = PoseTrack::of_samples(kStart, moving({0, 7, 21, 121, 133}));
  class Link final : public LinkControl {
   public:
    using LinkControl::send;
    void send(std::span<const std::byte> /*bytes*/) override { ++messages; }
    void set_line_rate(int /*baud*/) override {}
    void send_break() override {}
    void fail(std::string /*reason*/) override {}
    int messages = 0;
  } link;
  IgtlEmulator device(track, {}, {});
  device.on_open(link, kStart - milliseconds(1));
  int sent = 0;
  for (const int t : {0, 7, 21, 121, 133}) {
    EXPECT_EQ(device.next_time(), kStart + milliseconds(t));
    device.on_time(link, device.next_time());
    EXPECT_EQ(link.messages, ++sent);
  }
  EXPECT_EQ(device.next_time(), kNever);
}

TEST(PoseTrack, AConnectionLaterBeginsWithTheNewestReading) {
  const PoseTrack track = PoseTrack::of_samples(kStart, moving({0, 7, 21, 121, 133}));
  EXPECT_EQ(track.index_at(milliseconds(-5)), 0U);
  EXPECT_EQ(track.index_at(milliseconds(20)), 1U);
  EXPECT_EQ(track.index_at(milliseconds(120)), 2U);
  EXPECT_EQ(track.index_at(milliseconds(500)), 4U);
}

}  // namespace
}  // namespace perimap

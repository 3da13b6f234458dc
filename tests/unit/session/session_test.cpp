#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "daemon/evaluation/session/session_page.hpp"
#include "daemon/publishing/sample_recorder.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const Instant kBegin = from_ns(0) + 100s;

void name(char* source, char* stream, const std::string& stream_name) {
  std::copy_n("perimapd", 9, source);
  std::copy_n(stream_name.c_str(), stream_name.size() + 1, stream);
}

perimap_Surface surface_of(int i, const std::string& stream) {
  perimap_Surface surface{};
  surface.sample_sequence = surface.frame_sequence = static_cast<std::uint64_t>(i);
  // Good from 2 s to 6 s; the pose is missing for a second of that.
  surface.state = i < 20 ? perimap_SURFACE_INVALID : perimap_SURFACE_GOOD;
  surface.reason = i < 20 ? perimap_SURFACE_REASON_NOTHING_MAPPED : perimap_SURFACE_REASON_NONE;
  if (i >= 30 && i < 40) {
    surface.state = perimap_SURFACE_DEGRADED;
    surface.reason = perimap_SURFACE_REASON_POSE_MISSING;
  }
  const Instant release = kBegin + i * 100ms;
  surface.release_time_ns = surface.valid_time_ns = to_ns(release);
  surface.capture_time_ns = to_ns(release - 50ms);
  surface.valid_until_ns = to_ns(release + 100ms);
  surface.release_utc_ns = 1'795'000'000'000'000'000 + i * 100'000'000LL;
  name(surface.source, surface.stream, stream);
  return surface;
}

class Session : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "perimap-session-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    file_ = (fs::path(folder) / "samples.mcap").string();
  }
  void TearDown() override { fs::remove_all(fs::path(file_).parent_path()); }

  // Eight seconds at 10 Hz, in which nothing comes between 6 s and 8 s; statuses each second, a beat each 0.8 s.
  void write(bool statuses, const std::string& stream = "frame",
             perimap_SetupState set_up = perimap_SETUP_CONSISTENT) const {
    auto recorder = SampleRecorder::create(file_, "test");
    ASSERT_TRUE(recorder) << recorder.error().message;
    for (int i = 0; i <= 80; ++i) {
      const Instant receipt = kBegin + i * 100ms;
      if (i > 60 && i < 80) continue;
      ASSERT_TRUE(recorder->write(surface_of(i, stream), receipt));
      perimap_Phase phase{};
      name(phase.source, phase.stream, stream);
      phase.state = perimap_PHASE_LOCKED;
      phase.beats = static_cast<std::uint64_t>(i / 8);
      phase.last_r_peak_time_ns = to_ns(kBegin + (i / 8) * 800ms);
      ASSERT_TRUE(recorder->write(phase, receipt));
      if (!statuses || i % 10 != 0) continue;
      perimap_Status status{};
      name(status.source, status.stream, stream);
      std::copy_n("9.8.7", 6, status.version);
      // As of a perimapd that was there before, and began anew at 4 s.
      status.run_id[0] = i < 40 ? 1 : 2;
      status.samples_from_late_update = i < 40 ? 100U + static_cast<unsigned>(i) / 10U : 4U;
      status.samples = i < 40 ? 1000U + static_cast<unsigned>(i) : 40U;
      status.setup.state = i < 30 ? perimap_SETUP_UNKNOWN : set_up;
      status.setup.numbers[0] = 0.035;
      status.setup.blamed[0] = set_up == perimap_SETUP_DOUBTED;
      perimap_SourceStatus tracker{};
      tracker.kind = perimap_SOURCE_TRACKER;
      tracker.state = i >= 30 && i < 40 ? perimap_SOURCE_CLOSED : perimap_SOURCE_OK;
      tracker.received = i < 40 ? 500U : 90U;
      tracker.dropped = i < 40 ? 200U : 10U;
      status.sources = {1, 1, &tracker, false};
      ASSERT_TRUE(recorder->write(status, receipt));
    }
    ASSERT_TRUE(recorder->finish());
  }

  [[nodiscard]] Expected<SessionRecord> read() const { return read_session({file_, "", "", ""}); }

  std::string file_;
};

const SessionStrip& strip_of(const SessionRecord& record, const std::string& name) {
  for (const SessionStrip& strip : record.strips) {
    if (strip.name() == name) return strip;
  }
  ADD_FAILURE() << "no strip " << name;
  return record.strips.front();
}

TEST_F(Session, TellsForHowLongSurfacesWereWhatAndWhy) {
  write(true);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_DOUBLE_EQ(record->length_s, 8.0);
  EXPECT_DOUBLE_EQ(record->first_good_s.value(), 2.0);
  ASSERT_EQ(record->shares.size(), 3U);
  EXPECT_EQ(record->shares[0].what, "good");
  EXPECT_NEAR(record->shares[0].seconds, 3.1, 1e-6);  // the one before the gap holds for a tenth
  EXPECT_EQ(record->shares[0].spans, 3U);  // the last surface is one of its own: nothing is known of the time before it
  EXPECT_NEAR(record->shares[0].longest_begin_s, 4.0, 1e-6);
  EXPECT_EQ(record->shares[1].what, "invalid: nothing mapped");
  EXPECT_NEAR(record->shares[1].seconds, 2.0, 1e-6);
  EXPECT_EQ(record->shares[2].what, "degraded: pose missing");
  EXPECT_EQ(record->shares[2].reason, perimap_SURFACE_REASON_POSE_MISSING);
  EXPECT_EQ(
      session_verdict(*record),
      "Surfaces were good for 38.8 % of 8.0 s, to be used with care for 12.5 %, and of no use for 25.0 %; for 23.7 % "
      "none came. The first good one came after 2.0 s.");
}

TEST_F(Session, AnswersFirstWhatCanBeReliedOnAndWhatStoodInTheWay) {
  write(true);
  auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ(
      session_answer(*record),
      "From the first good surface on, after 2.0 s, surfaces were good for 51.7 % of 6.0 s. What stood in the way "
      "most: no surface came, 1.9 s.");
  EXPECT_THAT(session_page(*record), HasSubstr("class=\"verdict\">From the first good surface on"));
  record->first_good_s.reset();
  EXPECT_THAT(
      session_answer(*record),
      StartsWith("Not one surface of this session was good. What stood in the way most: invalid: nothing mapped, "
                 "2.0 s (nothing is mapped yet; what helps: move the scope"));
  record->length_s = 0.0;
  EXPECT_THAT(session_answer(*record), HasSubstr("nothing can be told"));
}

TEST_F(Session, OfADoubtedSetUpSaysFirstThatAndWhatIsOff) {
  write(true, "frame", perimap_SETUP_DOUBTED);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_THAT(session_answer(*record),
              AllOf(StartsWith("Do not rely on positions of this session: from 3.0 s on its set-up was doubted, "),
                    HasSubstr("the camera is turned by 2.0 deg against the hand-eye")));
  EXPECT_THAT(session_concerns(*record).front(), StartsWith("Times that the set-up was doubted: "));
}

TEST_F(Session, ShowsDevicesHeartAndSetUpOverTheSameTime) {
  write(true);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  const auto& tracker = strip_of(*record, "tracker").spans();
  ASSERT_GE(tracker.size(), 3U);
  EXPECT_EQ(tracker[1].what, "closed");
  EXPECT_EQ(tracker[1].tone, Tone::kBad);
  EXPECT_NEAR(tracker[1].begin_s, 3.0, 1e-6);
  EXPECT_NEAR(tracker[1].end_s, 4.0, 1e-6);
  EXPECT_EQ(strip_of(*record, "set-up watch").spans().back().what, "consistent");
  ASSERT_FALSE(record->rhythm.empty());
  for (std::size_t i = 0; i + 1 < record->rhythm.size(); ++i) EXPECT_NEAR(record->rhythm[i].interval_s, 0.8, 1e-9);
}

TEST_F(Session, NamesWhatIsToBeLookedAt) {
  write(true);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  const auto concerns = session_concerns(*record);
  EXPECT_THAT(concerns, Contains("Surfaces published and not received: 19"));
  EXPECT_THAT(concerns, Contains(HasSubstr("rest on the state before, because their update was late: 7 of 70")));
  EXPECT_THAT(concerns, Contains("Samples of the tracker that were lost on the way: 10 of 100"));
  EXPECT_THAT(concerns, Not(Contains(HasSubstr("No status"))));
}

TEST_F(Session, SaysSoWhereNoStatusWasRecorded) {
  write(false);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_THAT(session_concerns(*record), Contains(HasSubstr("No status was recorded")));
  EXPECT_THAT(session_page(*record), HasSubstr("No status was recorded"));
}

TEST_F(Session, IsAPageThatAsksNothingElsewhereAndEscapesWhatFilesSay) {
  write(true);
  auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  record->files.front().configuration = "name = \"<script>\"";
  const std::string page = session_page(*record);
  EXPECT_THAT(page, HasSubstr("degraded: pose missing: 3.00 s to 4.00 s"));
  EXPECT_THAT(page, HasSubstr("2026-11-18"));
  EXPECT_THAT(page, HasSubstr("9.8.7"));
  EXPECT_THAT(page, HasSubstr("look at the tracker"));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, Not(HasSubstr("href=")));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
}

TEST_F(Session, RefusesAFileWithoutSurfacesAndAStreamThatIsNotThere) {
  write(true, "clock");
  const auto wrong = read_session({file_, "", "", "frame"});
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("it has perimapd, clock"));
  auto recorder = SampleRecorder::create(file_, "test");
  ASSERT_TRUE(recorder && recorder->finish());
  const auto none = read();
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("perimap watch --record"));
}

TEST_F(Session, IsReadAsFarAsItsFileIsWhole) {
  write(true);
  fs::resize_file(file_, fs::file_size(file_) - 9);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_THAT(session_concerns(*record), Contains(HasSubstr("A file is damaged")));
}

TEST_F(Session, CountsNoSurfaceBeyondTheInstantUntilWhichItHolds) {
  auto recorder = SampleRecorder::create(file_, "test");
  ASSERT_TRUE(recorder) << recorder.error().message;
  for (int i = 20; i < 30; ++i) {
    perimap_Surface surface = surface_of(i, "frame");
    surface.valid_until_ns = surface.release_time_ns + 30'000'000;
    // The last three come 40 ms late.
    ASSERT_TRUE(recorder->write(surface, from_ns(surface.release_time_ns) + (i < 27 ? 0ms : 40ms)));
  }
  ASSERT_TRUE(recorder->finish());
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  ASSERT_FALSE(record->shares.empty());
  EXPECT_EQ(record->shares[0].what, "good");
  EXPECT_NEAR(record->shares[0].seconds, 7 * 0.03, 1e-6);
  EXPECT_THAT(session_page(*record), HasSubstr("received too late"));
  EXPECT_FALSE(record->virtual_time);
}

TEST_F(Session, TellsNoDelaysOfAReplayInVirtualTime) {
  write(false);
  const auto record = read();
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_TRUE(record->virtual_time);
  EXPECT_THAT(session_page(*record), Not(HasSubstr("capture to receipt")));
}

TEST_F(Session, IsNotReadTwiceFromTheSameFile) {
  write(true);
  const auto twice = read_session({file_, file_, "", ""});
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message, HasSubstr("given twice"));
}

TEST(SessionStripTest, WhatWasSaidHoldsUntilSomethingElseIsSaidOrForAsLongAsItHolds) {
  SessionStrip strip("state");
  strip.say(0.0, "a", Tone::kWell, 0.5);
  strip.say(0.4, "a", Tone::kWell, 0.5);
  strip.say(0.8, "b", Tone::kBad, 0.5);
  strip.say(2.0, "b", Tone::kBad, 0.5);
  strip.say(1.0, "c", Tone::kBad, 0.5);  // out of order
  strip.end(2.2);
  ASSERT_EQ(strip.spans().size(), 3U);
  EXPECT_DOUBLE_EQ(strip.spans()[0].end_s, 0.8);
  EXPECT_DOUBLE_EQ(strip.spans()[1].end_s, 1.3);
  EXPECT_DOUBLE_EQ(strip.spans()[2].begin_s, 2.0);
  EXPECT_DOUBLE_EQ(strip.spans()[2].end_s, 2.2);
}

TEST(SessionStripTest, WhatIsBadIsToldWithoutColourAndManyChangesTogether) {
  SessionStrip strip("state");
  strip.say(0.0, "a", Tone::kBad, 2.0);
  strip.say(1.0, "b", Tone::kWell, 2.0);
  strip.end(1.0);
  EXPECT_THAT(strips_svg({strip}, 1.0), HasSubstr("url(#bad)\"><title>a"));
  EXPECT_EQ(strips_svg({}, 1.0), "");
  EXPECT_EQ(strips_svg({strip}, 0.0), "");
  SessionStrip flicker("state");
  for (int i = 0; i < 100000; ++i)
    flicker.say(0.01 * i, i % 2 == 0 ? "a" : "b", i % 2 == 0 ? Tone::kWell : Tone::kBad, 1.0);
  flicker.end(1000.0);
  const std::string svg = strips_svg({flicker}, 1000.0);
  EXPECT_LT(svg.size(), 300000U);
  EXPECT_THAT(svg, HasSubstr("changes: "));
}

}  // namespace
}  // namespace perimap

#include "daemon/publishing/sample_recorder.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <map>

#include "daemon/dds/bounded_string.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

TEST(SampleRecorder, WhatIsWrittenIsReadBackWithReceiptAndSourceTimes) {
  std::string name = (std::filesystem::temp_directory_path() / "perimap-samples-XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  ASSERT_GE(descriptor, 0);
  close(descriptor);
  Expected<SampleRecorder> recorder = SampleRecorder::create(name, "test");
  ASSERT_TRUE(recorder) << recorder.error().message;
  perimap_SurfaceFeature feature{};
  feature.id = 42;
  perimap_Surface surface{};
  dds::assign(surface.frame_id, "tracker");
  surface.features._buffer = &feature;
  surface.features._length = surface.features._maximum = 1;
  for (std::uint64_t i = 0; i < 3; ++i) {
    surface.sample_sequence = i;
    surface.release_time_ns = 1000 + static_cast<std::int64_t>(i);
    surface.release_utc_ns = surface.release_time_ns + 77;
    ASSERT_TRUE(recorder->write(surface, from_ns(2000 + static_cast<std::int64_t>(i))));
  }
  perimap_Phase phase{};
  phase.time_ns = 5;
  ASSERT_TRUE(recorder->write(phase, from_ns(3000)));
  perimap_SurfaceModel model{};
  ASSERT_TRUE(recorder->write(model, from_ns(3000)));
  perimap_Status status{};
  ASSERT_TRUE(recorder->write(status, from_ns(3000)));
  perimap_ToolDistance tool{};
  dds::assign(tool.tool, "pointer");
  tool.release_time_ns = 2001;
  tool.distances_mm[2] = 4.5;
  for (tool.sample_sequence = 1; tool.sample_sequence <= 2; ++tool.sample_sequence) {
    ASSERT_TRUE(recorder->write(tool, from_ns(3001)));
  }
  ASSERT_TRUE(recorder->finish());

  Expected<RecordingReader> reader = RecordingReader::open(name);
  ASSERT_TRUE(reader) << reader.error().message;
  std::map<std::string, int> messages;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    const RecordedMessage& recorded = **message;
    ++messages[std::string(recorded.type)];
    if (recorded.type == "perimap::Surface") {
      const auto read = reader->decode<perimap_Surface>(recorded);
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ((*read)->features._buffer[0].id, 42U);
      EXPECT_EQ(recorded.arrival, from_ns(2000 + recorded.sequence));
      EXPECT_EQ(recorded.source_time, from_ns(1000 + recorded.sequence));
    } else if (recorded.type == "perimap::ToolDistance") {
      const auto read = reader->decode<perimap_ToolDistance>(recorded);
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(recorded.channel, "tool");
      EXPECT_EQ(recorded.source_time, from_ns(2001));
      EXPECT_STREQ((*read)->tool, "pointer");
      EXPECT_EQ((*read)->distances_mm[2], 4.5);
    } else if (recorded.type == "perimap::RecordingInfo") {
      const auto read = reader->decode<perimap_RecordingInfo>(recorded);
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ((*read)->utc_minus_monotonic_ns, 77);
      EXPECT_STREQ((*read)->world_frame_id, "tracker");
    }
  }
  const std::map<std::string, int> expected{{"perimap::RecordingInfo", 1}, {"perimap::Surface", 3},
                                            {"perimap::SurfaceModel", 1},  {"perimap::ToolDistance", 2},
                                            {"perimap::Phase", 1},         {"perimap::Status", 1}};
  EXPECT_EQ(messages, expected);
  std::filesystem::remove(name);
}

}  // namespace
}  // namespace perimap

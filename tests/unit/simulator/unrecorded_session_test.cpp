// A session that is replayed without a recording gives what the recording would.
#include "drivers/standins/session/unrecorded_session.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/angle/angle.hpp"
#include "drivers/standins/session/session_writer.hpp"

namespace perimap {
namespace {

constexpr TrackerNoise kNoise{1.4, 0.01};

// All devices that there are, and a tool that is missing at times, when a pose is not a number.
SimulationSettings many_devices() {
  SimulationSettings settings;
  settings.width = 64;
  settings.height = 64;
  settings.duration = std::chrono::seconds(3);
  settings.tracker_dropouts_per_min = 30.0;
  settings.held = ScopeHeld{20.0 * kDegree, 1.0};
  settings.second_sensor = true;
  settings.patient_tool = true;
  settings.respiration_mm = 5.0;
  settings.respiration_channel = true;
  return settings;
}

void put(std::string& bytes, const void* value, std::size_t size) {
  bytes.append(static_cast<const char*>(value), size);
}
template <class Value>
void put(std::string& bytes, const Value& value) {
  static_assert(std::is_trivially_copyable_v<Value>);
  put(bytes, &value, sizeof value);
}

void put_pose(std::string& bytes, const TrackerSample& sample) {
  put(bytes, sample.source_time), put(bytes, sample.arrival), put(bytes, sample.device_frame), put(bytes, sample.state);
  put(bytes, sample.X_WS.R.data(), 9 * sizeof(double));
  put(bytes, sample.X_WS.t.data(), 3 * sizeof(double));
  put(bytes, sample.error_mm);
}

template <class Block>
void put_block(std::string& bytes, const Block& block) {
  put(bytes, block.first_sample_time), put(bytes, block.arrival), put(bytes, block.device_sequence);
  put(bytes, block.sample_period), put(bytes, block.count);
  for (const float value : block.samples()) put(bytes, value);
}

// What a pipeline would see of it.
std::string bytes_of(const ReplayEvent& event) {
  std::string bytes(1, static_cast<char>(event.index()));
  if (const auto* frame = std::get_if<FrameEvent>(&event)) {
    put(bytes, frame->stamp.sequence), put(bytes, frame->stamp.capture), put(bytes, frame->stamp.arrival);
    put(bytes, frame->width), put(bytes, frame->height), put(bytes, frame->format);
    put(bytes, frame->pixels.data(), frame->pixels.size());
    bytes += frame->bgr.empty() ? "grey" : "colour";
  } else if (const auto* pose = std::get_if<TrackerSample>(&event)) {
    put_pose(bytes, *pose);
  } else if (const auto* tool = std::get_if<ToolPose>(&event)) {
    put(bytes, tool->role);
    put_pose(bytes, tool->sample);
  } else if (const auto* ecg = std::get_if<EcgBlock>(&event)) {
    put_block(bytes, *ecg);
    put(bytes, ecg->lead_off);
  } else {
    put_block(bytes, std::get<RespirationBlock>(event));
  }
  return bytes;
}

template <class Source>
std::vector<std::string> all_of(Source& source) {
  std::vector<std::string> events;
  for (auto event = source.next(); event && *event; event = source.next()) events.push_back(bytes_of(**event));
  return events;
}

ReplayReader opened(const std::string& path) {
  auto reader = ReplayReader::open(path, ReadMode::kStrict);
  EXPECT_TRUE(reader) << reader.error().message;
  return *std::move(reader);
}

TEST(UnrecordedSession, GivesTheEventsOfItsRecordingForAnyNumberOfThreads) {
  const auto path =
      std::filesystem::temp_directory_path() / ("perimap_unrecorded_" + std::to_string(getpid()) + ".mcap");
  const auto simulation = Simulation::create(many_devices());
  ASSERT_TRUE(simulation) << simulation.error().message;
  ASSERT_TRUE(write_simulation(*simulation, {{path, kNoise}}, 1, [](std::uint64_t) { return true; }));
  ReplayReader recorded = opened(path.string());
  const std::vector<std::string> expected = all_of(recorded);
  const auto recorded_bytes = std::filesystem::file_size(path);
  std::filesystem::remove(path);
  ASSERT_GT(expected.size(), 300U);

  for (const unsigned threads : {1U, 3U}) {
    auto again = Simulation::create(many_devices());
    ASSERT_TRUE(again) << again.error().message;
    const auto session = UnrecordedSession::create(*std::move(again), kNoise, threads);
    ASSERT_TRUE(session) << session.error().message;
    EXPECT_EQ(session->width(), 64);
    EXPECT_EQ(session->height(), 64);
    EXPECT_LT(std::filesystem::file_size(session->recording()), recorded_bytes);
    ReplayReader sensors = opened(session->recording());
    const auto events = all_of(*session->events(sensors));
    ASSERT_EQ(events.size(), expected.size());
    for (std::size_t i = 0; i < events.size(); ++i) ASSERT_EQ(events[i], expected[i]) << "event " << i;
  }
}

// Its threads wait for room then, or render.
TEST(UnrecordedSession, CanBeLeftInTheMiddle) {
  auto simulation = Simulation::create(many_devices());
  ASSERT_TRUE(simulation) << simulation.error().message;
  const auto session = UnrecordedSession::create(*std::move(simulation), kNoise, 2);
  ASSERT_TRUE(session) << session.error().message;
  ReplayReader sensors = opened(session->recording());
  const auto events = session->events(sensors);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(events->next());
}

}  // namespace
}  // namespace perimap

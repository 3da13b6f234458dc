// What a recording brings along of the configuration that it was made with, and what one may not bring along.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "begun_recording.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_recording.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

CameraModel camera() {
  CameraModel model;
  model.width = model.height = 4;
  model.fx = model.fy = 4.0;
  model.cx = model.cy = 2.0;
  return model;
}

// A whole recording with these facts.
void record(const BegunRecording& recording, const SensorRecordingFacts& facts) {
  const auto recorder = recording.begin(facts);
  ASSERT_TRUE(recorder);
  ThreadLauncher threads({});
  recorder->start(threads);
  recorder->stop();
  ASSERT_FALSE(recorder->summary().stopped) << recorder->reason();
}

TEST(RecordedConfiguration, IsWhatDescribesTheSessionAndTheCamerasCalibration) {
  Configuration live;
  live.source.name = "theatre 3";
  live.dds.domain = 7;
  live.pipeline.workers = 5;
  live.checkpoint.file = "/var/lib/perimap/checkpoint";
  live.camera.device = "v4l2:/dev/video0";
  live.tracker.port = "/dev/ttyUSB0";
  live.tracker.position_deviation_mm = 0.7;
  live.tracker.translation_SC_mm[2] = 12.5;
  live.tracker.translation_IW_mm[0] = 3.0;  // the driver has applied it to the poses
  live.phase.law = PhaseLaw::kWarped;
  live.respiration.enabled = true;
  live.respiration.device_channel = 4;
  live.estimation.harmonics = 6;
  const BegunRecording recording;
  record(recording, recording_facts(live, camera(), "test"));
  const auto basis = recorded_basis(recording.file(), std::nullopt, ReadMode::kStrict);
  ASSERT_TRUE(basis) << basis.error().error.message;
  EXPECT_TRUE(basis->passed_over.empty());
  EXPECT_EQ(basis->camera.fx, 4.0);
  Configuration expected;
  expected.source.world_frame = live.source.world_frame;
  expected.tracker.position_deviation_mm = 0.7;
  expected.tracker.translation_SC_mm[2] = 12.5;
  expected.phase.law = PhaseLaw::kWarped;
  expected.respiration.enabled = true;
  expected.estimation.harmonics = 6;
  EXPECT_EQ(basis->configuration, expected);
}

TEST(RecordedConfiguration, OfAVideoThatWasPlayedInALoopSaysThatItsPicturesMayComeAgain) {
  const auto pipeline_of = [](const Configuration& live) {
    const BegunRecording recording;
    record(recording, recording_facts(live, camera(), "test"));
    const auto setup = prepare_replay(recording.file(), std::nullopt, ReadMode::kStrict);
    EXPECT_TRUE(setup) << setup.error().error.message;
    return setup ? setup->pipeline : PipelineSettings{};
  };
  Configuration live;
  live.camera.device = "v4l2:/dev/video0";
  EXPECT_FALSE(pipeline_of(live).pictures_may_loop);
  EXPECT_FALSE(pipeline_of(live).ecg_may_loop);
  live.camera.repeats_allowed = live.ecg.repeats_allowed = true;
  EXPECT_TRUE(pipeline_of(live).pictures_may_loop);
  EXPECT_TRUE(pipeline_of(live).ecg_may_loop);
  live = {};
  live.camera.device = "video:/tmp/organ.mp4";
  EXPECT_TRUE(pipeline_of(live).pictures_may_loop);
  live.camera.loop = false;
  EXPECT_FALSE(pipeline_of(live).pictures_may_loop);
}

TEST(RecordedConfiguration, BringsTheTipsOfItsToolsAlong) {
  const BegunRecording recording;
  const std::string tip = recording.folder() + "/probe.json";
  std::ofstream(tip) << R"({"tool": "0E", "tip_mm": [1, 2, 150.5],)"
                     << R"("covariance": [[0.04, 0.01, 0], [0.01, 0.09, 0], [0, 0, 0.16]]})";
  Configuration live;
  live.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  live.tracker.pointer = "0C";
  live.tracker.instruments = {"0E"};
  live.tracker.instrument_calibrations = {tip};
  record(recording, recording_facts(live, camera(), "test"));
  const auto setup = prepare_replay(recording.file(), std::nullopt, ReadMode::kStrict);
  ASSERT_TRUE(setup) << setup.error().error.message;
  ASSERT_EQ(setup->tools.size(), 2U);
  EXPECT_EQ(setup->tools[0].name, "pointer");
  EXPECT_FALSE(setup->tools[0].tip);
  EXPECT_EQ(setup->tools[1].name, "instrument/0E");
  ASSERT_TRUE(setup->tools[1].tip);
  EXPECT_EQ(setup->tools[1].tip->p_OT_mm, Vector3d(1.0, 2.0, 150.5));
  EXPECT_EQ(setup->tools[1].tip->covariance_O_mm2(1, 1), 0.09);
  EXPECT_EQ(setup->tools[1].tip->covariance_O_mm2(0, 1), 0.01);
}

TEST(RecordedConfiguration, ATipThatCannotBeReadIsRefusedByItsName) {
  for (const char* text : {"", "{", "[]", R"({"tip_mm": [0, 0]})", R"({"tip_mm": [0, 0, 1e9], "covariance": []})"}) {
    SensorRecordingFacts facts = recording_facts(Configuration(), camera(), "test");
    facts.tips.emplace_back("pointer", text);
    const BegunRecording recording;
    record(recording, facts);
    const auto setup = prepare_replay(recording.file(), std::nullopt, ReadMode::kStrict);
    ASSERT_FALSE(setup) << text;
    EXPECT_THAT(setup.error().error.message, HasSubstr(":tip/pointer.json: "));
  }
}

TEST(RecordedConfiguration, AHandEyeOfAnotherSensorThanWasRecordedIsRefused) {
  Configuration live;
  live.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  live.tracker.sensor = "0A";
  live.tracker.pointer = "0C";
  const BegunRecording recording;
  record(recording, recording_facts(live, camera(), "test"));
  const auto basis = recorded_basis(recording.file(), std::nullopt, ReadMode::kStrict);
  ASSERT_TRUE(basis) << basis.error().error.message;
  EXPECT_EQ(basis->sensor, "0A");
  EXPECT_FALSE(basis->configuration.tracker.sensor) << "a recording does not choose the tools of a tracker";
  EXPECT_FALSE(basis->configuration.tracker.pointer);
  const std::string file = recording.folder() + "/other.toml";
  for (const char* tracker : {"hand_eye_sensor = \"0B\"\n", "hand_eye_sensor = \"0B\"\nsensor = \"0B\"\n"}) {
    std::ofstream(file) << "version = 1\n[tracker]\n" << tracker;
    const auto refused = prepare_replay(recording.file(), file, ReadMode::kStrict);
    ASSERT_FALSE(refused) << tracker;
    EXPECT_THAT(refused.error().error.message,
                HasSubstr("other.toml:3:19: key 'tracker.hand_eye_sensor': expected \"0A\""));
  }
  std::ofstream(file) << "version = 1\n[tracker]\nhand_eye_sensor = \"0A\"\n";
  const auto fits = prepare_replay(recording.file(), file, ReadMode::kStrict);
  EXPECT_TRUE(fits) << fits.error().error.message;
}

TEST(RecordedConfiguration, ThatSaysMoreIsRefusedByNameOrPassedOverWithTheRestOfADamagedRecording) {
  SensorRecordingFacts facts = recording_facts({}, camera(), "test");
  facts.configuration =
      "version = 1\n[tracker]\nposition_deviation_mm = 0.7\n[checkpoint]\nfile = \"/tmp/overwritten\"\n"
      "[control]\nsocket = \"/tmp/socket\"\n";
  const BegunRecording recording;
  record(recording, facts);
  const auto refused = recorded_basis(recording.file(), std::nullopt, ReadMode::kStrict);
  ASSERT_FALSE(refused);
  EXPECT_FALSE(refused.error().configuration) << "it is the recording that is wrong";
  EXPECT_THAT(refused.error().error.message, HasSubstr(":5:1: key 'checkpoint.file': expected of a recording"));
  EXPECT_THAT(refused.error().error.message, HasSubstr(":7:1: key 'control.socket': expected of a recording"));
  const auto whole = recorded_basis(recording.file(), std::nullopt, ReadMode::kWhole);
  ASSERT_TRUE(whole) << whole.error().error.message;
  EXPECT_FALSE(whole->configuration.checkpoint.file);
  EXPECT_FALSE(whole->configuration.control.socket);
  EXPECT_EQ(whole->configuration.tracker.position_deviation_mm, 0.7);
  ASSERT_EQ(whole->passed_over.size(), 2U);
  EXPECT_THAT(whole->passed_over[0].message, HasSubstr("key 'checkpoint.file'"));
  // Whoever replays it may say all that.
  const std::string file = recording.folder() + "/own.toml";
  std::ofstream(file) << "version = 1\n[checkpoint]\nfile = \"/tmp/mine\"\n";
  const auto own = recorded_basis(recording.file(), file, ReadMode::kWhole);
  ASSERT_TRUE(own) << own.error().error.message;
  EXPECT_EQ(own->configuration.checkpoint.file, "/tmp/mine");
}

}  // namespace
}  // namespace perimap

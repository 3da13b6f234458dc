// What is exported for viewers, read back by this project's own readers: each message of each channel.
#include "daemon/bridge/export/view_export.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "daemon/bridge/messages/view_layout.hpp"
#include "daemon/bridge/messages/view_names.hpp"
#include "daemon/bridge/messages/view_topics.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "made_recording.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using test::MadePublication;
using test::MadeRecording;
using testing::HasSubstr;

Instant utc(Instant t) { return t + Duration(MadePublication::kUtcMinusMonotonic_ns); }
Instant instant_of(const foxglove_Time& t) {
  return from_ns(std::int64_t{1'000'000'000} * t.sec + std::int64_t{t.nsec});
}

// All messages of a type, by the time at which they are shown.
template <class T>
using Shown = std::map<Instant, Sample<T>>;

class ViewExport : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "perimap-export-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
    files_ = {file("in.mcap"), "", file("out.mcap"), file("out.layout.json")};
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }
  void export_made(const MadeRecording& made = {}) {
    made.write(files_.recording);
    auto summary = export_view(files_, "test");
    ASSERT_TRUE(summary) << summary.error().message;
    summary_ = *summary;
  }

  // Fails where a message cannot be decoded, or stands at another time than its stamp's.
  template <class T>
  [[nodiscard]] Shown<T> read(const std::string& topic) const {
    Shown<T> shown;
    auto reader = RecordingReader::open(files_.output);
    EXPECT_TRUE(reader) << reader.error().message;
    const std::array<std::string_view, 1> wanted{topic};
    if (const auto selected = reader->select(wanted); !selected) return shown;
    for (;;) {
      const auto message = reader->next();
      EXPECT_TRUE(message) << message.error().message;
      if (!message || !*message) return shown;
      auto sample = reader->template decode<T>(**message);
      EXPECT_TRUE(sample) << sample.error().message;
      EXPECT_EQ((*message)->arrival, (*message)->source_time);
      if constexpr (requires(T t) { t.timestamp; }) {
        EXPECT_EQ(instant_of((*sample)->timestamp), (*message)->arrival) << topic;
      }
      EXPECT_TRUE(shown.emplace((*message)->arrival, std::move(*sample)).second) << topic << ": two at one time";
    }
  }

  fs::path folder_;
  ViewExportFiles files_;
  ViewExportSummary summary_;
};

TEST_F(ViewExport, HasEveryChannelWithItsType) {
  export_made();
  auto reader = RecordingReader::open(files_.output);
  ASSERT_TRUE(reader);
  std::map<std::string, std::string> types;
  for (const RecordedChannel& channel : reader->channels()) types[channel.name] = channel.type;
  EXPECT_EQ(types, (std::map<std::string, std::string>{{"/camera/image", "foxglove::RawImage"},
                                                       {"/camera/calibration", "foxglove::CameraCalibration"},
                                                       {"/camera/annotations", "foxglove::ImageAnnotations"},
                                                       {"/transforms", "foxglove::FrameTransform"},
                                                       {"/surface/scene", "foxglove::SceneUpdate"},
                                                       {"/surface/worth", "perimap_view::SurfaceWorth"},
                                                       {"/ecg/value", "perimap_view::EcgValue"}}));
  EXPECT_EQ(summary_.pictures, 20U);
  EXPECT_EQ(summary_.surfaces, 20U);
  EXPECT_EQ(summary_.shown, 15U);
  EXPECT_EQ(summary_.world_frame, "tracker");
  EXPECT_THAT(summary_.warnings, testing::IsEmpty());
}

TEST_F(ViewExport, PicturesStandAtTheirCapture) {
  export_made();
  const auto pictures = read<foxglove_RawImage>(view_names::kImage);
  ASSERT_EQ(pictures.size(), 20U);
  for (int frame = 0; frame < MadeRecording::kFrames; ++frame) {
    const auto found = pictures.find(utc(MadeRecording::capture(frame)));
    ASSERT_NE(found, pictures.end());
    const foxglove_RawImage& image = *found->second;
    EXPECT_STREQ(image.frame_id, "camera");
    EXPECT_STREQ(image.encoding, "mono8");
    ASSERT_EQ(image.data._length, static_cast<std::uint32_t>(MadeRecording::kWidth * MadeRecording::kHeight));
    for (int i = 0; i < MadeRecording::kWidth * MadeRecording::kHeight; ++i) {
      ASSERT_EQ(image.data._buffer[i], MadeRecording::pixel(frame, i));
    }
  }
}

TEST_F(ViewExport, TheCameraHasItsLensAndItsPose) {
  export_made();
  const auto calibrations = read<foxglove_CameraCalibration>(view_names::kCalibration);
  ASSERT_FALSE(calibrations.empty());
  EXPECT_EQ(calibrations.begin()->first, utc(MadeRecording::capture(0)));
  for (const auto& [at, calibration] : calibrations) {
    EXPECT_STREQ(calibration->frame_id, "camera");
    EXPECT_STREQ(calibration->distortion_model, "plumb_bob");
    EXPECT_EQ(calibration->width, 64U);
    EXPECT_THAT(std::to_array(calibration->K), testing::ElementsAre(60.0, 0, 31.5, 0, 61.0, 23.5, 0, 0, 1));
    EXPECT_THAT(std::to_array(calibration->P), testing::ElementsAre(60.0, 0, 31.5, 0, 0, 61.0, 23.5, 0, 0, 0, 1, 0));
    ASSERT_EQ(calibration->D._length, 5U);
    EXPECT_EQ(calibration->D._buffer[0], -0.01);
  }
  // Camera and sensor are told by messages of one channel, at the same instants.
  auto reader = RecordingReader::open(files_.output);
  ASSERT_TRUE(reader);
  const std::array<std::string_view, 1> wanted{view_names::kTransforms};
  ASSERT_TRUE(reader->select(wanted));
  int cameras = 0, sensors = 0;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    const auto transform = reader->decode<foxglove_FrameTransform>(**message);
    ASSERT_TRUE(transform) << transform.error().message;
    EXPECT_STREQ((*transform)->parent_frame_id, "tracker");
    if (std::string((*transform)->child_frame_id) == "camera") {
      ++cameras;
      EXPECT_NEAR((*transform)->translation.x, 0.001, 1e-12);
      EXPECT_NEAR((*transform)->translation.y, -0.002, 1e-12);
      EXPECT_NEAR((*transform)->translation.z, 0.030, 1e-12);
      EXPECT_NEAR((*transform)->rotation.z, std::sqrt(0.5), 1e-12);
      EXPECT_NEAR((*transform)->rotation.w, std::sqrt(0.5), 1e-12);
    } else {
      EXPECT_STREQ((*transform)->child_frame_id, "scope_sensor");
      const auto frame = ((*message)->arrival - utc(MadeRecording::capture(0))) / MadeRecording::kPeriod;
      EXPECT_NEAR((*transform)->translation.x, 1e-3 * static_cast<double>(frame), 1e-12);
      ++sensors;
    }
  }
  EXPECT_EQ(cameras, 15);  // not of the invalid surfaces
  EXPECT_EQ(sensors, 15);  // not where the tool is missing
}

TEST_F(ViewExport, TheSceneIsTheSurfaceAtItsInstantInMetres) {
  export_made();
  const auto scenes = read<foxglove_SceneUpdate>(view_names::kScene);
  ASSERT_EQ(scenes.size(), 20U);
  for (int frame = 0; frame < MadeRecording::kFrames; ++frame) {
    SCOPED_TRACE(frame);
    const Instant valid = MadeRecording::release(frame);
    const foxglove_SceneUpdate& scene = *scenes.at(utc(valid));
    if (MadeRecording::state(frame) == perimap_SURFACE_INVALID) {
      EXPECT_EQ(scene.entities._length, 0U);
      ASSERT_EQ(scene.deletions._length, 1U);
      EXPECT_EQ(scene.deletions._buffer[0].type, foxglove_ALL);
      continue;
    }
    EXPECT_EQ(scene.deletions._length, 0U);
    ASSERT_EQ(scene.entities._length, 3U);
    const foxglove_SceneEntity& shape = scene.entities._buffer[0];
    EXPECT_STREQ(shape.id, "surface");
    EXPECT_STREQ(shape.frame_id, "tracker");
    EXPECT_EQ(shape.lifetime.sec, 0);
    EXPECT_EQ(shape.lifetime.nsec, 200'000'000U);
    ASSERT_EQ(shape.triangles._length, frame < 2 ? 0U : 1U);  // the mesh comes with the third
    if (frame >= 2) {
      const foxglove_TriangleListPrimitive& list = shape.triangles._buffer[0];
      ASSERT_EQ(list.points._length, 4U);
      ASSERT_EQ(list.colors._length, 4U);
      EXPECT_THAT(std::vector(list.indices._buffer, list.indices._buffer + list.indices._length),
                  testing::ElementsAre(0U, 1U, 2U, 1U, 3U, 2U));
      for (std::size_t v = 0; v < 4; ++v) {
        const auto expected = MadePublication::vertex_at(v + 1, valid);
        EXPECT_NEAR(list.points._buffer[v].x, 1e-3 * expected[0], 1e-7);
        EXPECT_NEAR(list.points._buffer[v].y, 1e-3 * expected[1], 1e-7);
        EXPECT_NEAR(list.points._buffer[v].z, 1e-3 * expected[2], 1e-7);
      }
    }
    const foxglove_SceneEntity& features = scene.entities._buffer[1];
    ASSERT_EQ(features.spheres._length, 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto expected = MadePublication::feature_at(i, valid);
      EXPECT_NEAR(features.spheres._buffer[i].pose.position.x, 1e-3 * expected[0], 1e-12);
      EXPECT_NEAR(features.spheres._buffer[i].pose.position.y, 1e-3 * expected[1], 1e-12);
      EXPECT_NEAR(features.spheres._buffer[i].pose.position.z, 1e-3 * expected[2], 1e-12);
    }
    const foxglove_SceneEntity& camera = scene.entities._buffer[2];
    EXPECT_STREQ(camera.frame_id, "camera");
    ASSERT_EQ(camera.lines._length, 1U);
    EXPECT_EQ(camera.lines._buffer[0].points._length, 16U);
  }
}

TEST_F(ViewExport, OverThePictureFeaturesAreWhereTheyWereAtItsCapture) {
  export_made();
  const auto annotations = read<foxglove_ImageAnnotations>(view_names::kAnnotations);
  ASSERT_EQ(annotations.size(), 20U);
  const CameraModel lens = MadeRecording::lens();
  const Pose X_CW = Pose{so3_exp(Vector3d(0, 0, 0.5 * std::numbers::pi)), Vector3d(1, -2, 30)}.inverse();
  for (int frame = 0; frame < MadeRecording::kFrames; ++frame) {
    SCOPED_TRACE(frame);
    const Instant capture = MadeRecording::capture(frame);
    const foxglove_ImageAnnotations& over = *annotations.at(utc(capture));
    ASSERT_EQ(over.texts._length, 1U);
    const std::string words = over.texts._buffer[0].text;
    if (MadeRecording::state(frame) == perimap_SURFACE_INVALID) {
      EXPECT_EQ(words, "invalid: no heart beat for too long");
      EXPECT_EQ(over.circles._length, 0U);
      EXPECT_EQ(over.points._length, 0U);
      continue;
    }
    EXPECT_EQ(words, frame < 5 ? "good" : "degraded: a premature beat");
    ASSERT_EQ(over.circles._length, 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = MadePublication::feature_at(i, capture);
      Vector2d px;
      ASSERT_EQ(lens.project(X_CW * Vector3d(p[0], p[1], p[2]), px), ProjectionStatus::kOk);
      EXPECT_NEAR(over.circles._buffer[i].position.x, px.x() + 0.5, 1e-9);
      EXPECT_NEAR(over.circles._buffer[i].position.y, px.y() + 0.5, 1e-9);
    }
    ASSERT_EQ(over.points._length, frame < 2 ? 0U : 1U);
    if (frame >= 2) {
      EXPECT_EQ(over.points._buffer[0].points._length, 8U);  // the border of two triangles has four edges
    }
  }
}

TEST_F(ViewExport, EachValueOfTheEcgHasItsOwnInstant) {
  export_made();
  const auto values = read<perimap_view_EcgValue>(view_names::kEcg);
  EXPECT_EQ(values.size(), std::size_t{19} * MadeRecording::kEcgBlock);  // not those of the lead that was off
  for (int frame = 0; frame < MadeRecording::kFrames; ++frame) {
    for (int i = 0; i < MadeRecording::kEcgBlock; ++i) {
      const auto found = values.find(utc(MadeRecording::capture(frame) + i * 4ms));
      ASSERT_EQ(found != values.end(), frame != 7);
      if (frame != 7) {
        EXPECT_EQ(found->second->mV, static_cast<double>(MadeRecording::ecg_mV(frame, i)));
      }
    }
  }
}

TEST_F(ViewExport, WhatASurfaceWasWorthIsAWord) {
  export_made();
  const auto worths = read<perimap_view_SurfaceWorth>(view_names::kWorth);
  ASSERT_EQ(worths.size(), 20U);
  for (int frame = 0; frame < MadeRecording::kFrames; ++frame) {
    const perimap_view_SurfaceWorth& worth = *worths.at(utc(MadeRecording::release(frame)));
    EXPECT_STREQ(worth.state, frame < 5 ? "good" : frame < 10 ? "invalid" : "degraded");
    EXPECT_STREQ(worth.reason, frame < 5 ? "none" : frame < 10 ? "phase_lost" : "ectopic_beat");
    EXPECT_EQ(worth.converged, frame >= 5 && frame < 10 ? 0U : 1U);
    EXPECT_NEAR(worth.phase_rad, MadePublication::phase_at(MadeRecording::release(frame)), 1e-12);
  }
}

TEST_F(ViewExport, TwoFilesAreBroughtTogetherByTheirFrames) {
  MadeRecording devices;
  devices.published = false;
  devices.devices_clock = 1000s;  // replayed live: the surfaces are of another clock
  devices.write(files_.recording);
  MadeRecording published;
  published.devices = false;
  files_.samples = file("samples.mcap");
  published.write(files_.samples);
  const auto summary = export_view(files_, "test");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->pictures, 20U);
  EXPECT_EQ(summary->shown, 15U);
  const auto pictures = read<foxglove_RawImage>(view_names::kImage);
  const auto annotations = read<foxglove_ImageAnnotations>(view_names::kAnnotations);
  ASSERT_EQ(annotations.size(), 20U);
  for (const auto& [at, annotation] : annotations) EXPECT_TRUE(pictures.contains(at));
  EXPECT_EQ(annotations.begin()->second->circles._length, 3U);
  EXPECT_EQ(pictures.begin()->first, utc(MadeRecording::capture(0)));
}

TEST_F(ViewExport, OneThatIsCutOffIsExportedAsFarAsItIsWholeAndThatIsSaid) {
  MadeRecording made;
  made.options.chunk_duration = 200ms;
  made.write(files_.recording);
  const auto whole = fs::file_size(files_.recording);
  fs::resize_file(files_.recording, whole / 2);
  const auto summary = export_view(files_, "test");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_GT(summary->pictures, 3U);
  EXPECT_LT(summary->pictures, 18U);
  EXPECT_GT(summary->surfaces, 3U);
  ASSERT_FALSE(summary->warnings.empty());
  EXPECT_THAT(summary->warnings.front(), HasSubstr("in.mcap: "));
  EXPECT_THAT(summary->warnings, testing::Contains("what is whole was exported"));
  EXPECT_EQ(read<foxglove_RawImage>(view_names::kImage).size(), summary->pictures);
  EXPECT_EQ(read<foxglove_SceneUpdate>(view_names::kScene).size(), summary->surfaces);
}

TEST_F(ViewExport, WhatIsMissingIsSaidAndTheRestExported) {
  MadeRecording made;
  made.calibration = false;
  export_made(made);
  EXPECT_THAT(summary_.warnings, testing::ElementsAre(HasSubstr("no calibration of its camera")));
  EXPECT_TRUE(read<foxglove_CameraCalibration>(view_names::kCalibration).empty());
  EXPECT_EQ(read<foxglove_ImageAnnotations>(view_names::kAnnotations).begin()->second->circles._length, 0U);
  made = {};
  made.published = false;
  export_made(made);
  EXPECT_THAT(summary_.warnings, testing::ElementsAre(HasSubstr("there are no surfaces")));
  EXPECT_EQ(read<foxglove_RawImage>(view_names::kImage).size(), 20U);
}

TEST_F(ViewExport, WhatIsNoRecordingIsRefusedAndNothingIsLeftBehind) {
  for (const std::string& bytes : {std::string(), std::string("no recording"), std::string(5000, '\x89')}) {
    std::ofstream(files_.recording) << bytes;
    const auto summary = export_view(files_, "test");
    ASSERT_FALSE(summary);
    EXPECT_THAT(summary.error().message, HasSubstr("in.mcap"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  }
}

// Whatever bytes of a recording are other ones: it is exported or refused, and what was exported can be read.
TEST_F(ViewExport, GarbledBytesHarmNothing) {
  MadeRecording made;
  made.options.zstd_level = std::nullopt;
  made.write(files_.recording);
  std::ifstream in(files_.recording, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::mt19937 random(7);
  int exported = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::string garbled = bytes;
    for (int k = 0; k < 8; ++k) garbled[random() % garbled.size()] = static_cast<char>(random());
    std::ofstream(files_.recording, std::ios::binary) << garbled;
    const auto summary = export_view(files_, "test");
    if (!summary) continue;
    ++exported;
    EXPECT_EQ(read<foxglove_SceneUpdate>(view_names::kScene).size(), summary->surfaces);
  }
  EXPECT_GT(exported, 10);
}

TEST_F(ViewExport, TheLayoutShowsTopicsThatAreThere) {
  export_made();
  std::ifstream in(files_.layout);
  const auto layout = nlohmann::json::parse(in, nullptr, false);
  ASSERT_TRUE(layout.is_object());
  auto aimed = layout;
  const auto anywhere = nlohmann::json::parse(view_layout("tracker"));
  for (const char* key : {"distance", "phi", "thetaOffset", "targetOffset"}) {
    auto& eye = aimed["configById"]["3D!perimap"]["cameraState"];
    EXPECT_NE(eye.at(key), anywhere["configById"]["3D!perimap"]["cameraState"].at(key)) << "it looks at the surface";
    eye[key] = anywhere["configById"]["3D!perimap"]["cameraState"].at(key);
  }
  EXPECT_EQ(aimed, anywhere);
  auto reader = RecordingReader::open(files_.output);
  ASSERT_TRUE(reader);
  const auto& panels = layout.at("configById");
  std::vector<std::string> topics;
  const auto& image = panels.at("Image!perimap").at("imageMode");
  topics.push_back(image.at("imageTopic"));
  topics.push_back(image.at("calibrationTopic"));
  for (const auto& [topic, shown] : image.at("annotations").items()) topics.push_back(topic);
  for (const auto& [topic, shown] : panels.at("3D!perimap").at("topics").items()) topics.push_back(topic);
  for (const std::string panel : {"Plot!perimap_ecg", "StateTransitions!perimap"}) {
    for (const auto& path : panels.at(panel).at("paths")) {
      const std::string value = path.at("value");
      topics.push_back(value.substr(0, value.find('.')));
    }
  }
  EXPECT_GE(topics.size(), 8U);
  for (const std::string& topic : topics) {
    const auto channels = reader->channels();
    EXPECT_TRUE(std::any_of(channels.begin(), channels.end(), [&](const auto& c) { return c.name == topic; })) << topic;
  }
  EXPECT_EQ(panels.at("3D!perimap").at("followTf"), "tracker");
  EXPECT_TRUE(nlohmann::json::accept(view_layout("\xFF")));
}

// By the viewers' angles: theta turns the second axis' negative half towards the first axis' negative one.
TEST(ViewLayout, LooksFromWhereItWasTold) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const ViewAim aim{{30.0, -200.0, 500.0}, {90.0, -150.0, 440.0}};
  const auto layout = nlohmann::json::parse(view_layout("tracker", aim));
  const auto& eye = layout.at("configById").at("3D!perimap").at("cameraState");
  const double r = eye.at("distance"), phi = eye.at("phi").get<double>() * kDegree;
  const double theta = -eye.at("thetaOffset").get<double>() * kDegree;
  const Vector3d from(r * std::sin(phi) * std::sin(theta), -r * std::sin(phi) * std::cos(theta), r * std::cos(phi));
  const auto at = eye.at("targetOffset").get<std::vector<double>>();
  EXPECT_LT((1e3 * (Vector3d(at[0], at[1], at[2]) + from) - aim.from).norm(), 1e-9);
  // From nowhere else: it stands where it looks.
  EXPECT_EQ(view_layout("tracker", ViewAim{aim.at, aim.at}), view_layout("tracker"));
}

}  // namespace
}  // namespace perimap

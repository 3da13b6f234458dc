#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/publishing/sample_recorder.hpp"
#include "daemon/recordings/published_states.hpp"
#include "daemon/recordings/recording_player.hpp"
#include "daemon/view/page/view_page.hpp"
#include "daemon/view/recorded/overlay.hpp"
#include "daemon/view/recorded/recorded_view.hpp"
#include "drivers/image/jpeg_decoder.hpp"
#include "drivers/image/jpeg_encoder.hpp"
#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

const Instant kBegin = from_ns(0) + 100s;

perimap_Surface surface_of(std::uint64_t frame, perimap_SurfaceState state, Instant release) {
  perimap_Surface surface{};
  surface.sample_sequence = surface.frame_sequence = frame;
  surface.state = state;
  surface.release_time_ns = surface.valid_time_ns = to_ns(release);
  surface.capture_time_ns = to_ns(release - 50ms);
  surface.valid_until_ns = to_ns(release + 100ms);
  std::copy_n("perimapd", 9, surface.source);
  std::copy_n("frame", 6, surface.stream);
  return surface;
}

class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "perimap-view-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Ten seconds at 10 Hz: invalid for 2 s, good to 6 s, nothing to 8 s, degraded from there on.
  [[nodiscard]] std::string write() const {
    const std::string file = (folder_ / "samples.mcap").string();
    auto recorder = SampleRecorder::create(file, "test");
    EXPECT_TRUE(recorder) << recorder.error().message;
    for (int i = 0; i <= 100; ++i) {
      if (i > 60 && i < 80) continue;
      const auto state = i < 20 ? perimap_SURFACE_INVALID : (i <= 60 ? perimap_SURFACE_GOOD : perimap_SURFACE_DEGRADED);
      const Instant release = kBegin + i * 100ms;
      EXPECT_TRUE(recorder->write(surface_of(static_cast<std::uint64_t>(i), state, release), release));
    }
    EXPECT_TRUE(recorder->finish());
    return file;
  }

  fs::path folder_;
};

TEST_F(Recorded, ItsStatesAreSpansWithTheGapsBetween) {
  const auto states = read_published_states(write());
  ASSERT_TRUE(states) << states.error().message;
  EXPECT_EQ(states->stream, "frame");
  ASSERT_EQ(states->spans.size(), 3U);
  EXPECT_EQ(states->spans[0].state, perimap_SURFACE_INVALID);
  EXPECT_EQ(states->spans[0].begin, kBegin);
  EXPECT_EQ(states->spans[0].end, kBegin + 2s);
  EXPECT_EQ(states->spans[1].state, perimap_SURFACE_GOOD);
  EXPECT_EQ(states->spans[1].end, kBegin + 6s);
  EXPECT_EQ(states->spans[2].state, perimap_SURFACE_DEGRADED);
  EXPECT_EQ(states->spans[2].begin, kBegin + 8s);
  EXPECT_EQ(states->captures.at(3), kBegin + 250ms);
  EXPECT_FALSE(states->statuses);
}

TEST_F(Recorded, IsReadToAnInstantForwardsAndFromElsewhere) {
  auto player = RecordingPlayer::open(write());
  ASSERT_TRUE(player) << player.error().message;
  EXPECT_EQ(player->begin(), kBegin);
  EXPECT_EQ(player->end(), kBegin + 10s);
  EXPECT_TRUE(player->has(channels::kSurface));
  EXPECT_FALSE(player->has(channels::kCameraImage));
  std::vector<Instant> seen;
  const auto advance = [&](Instant until, std::optional<Instant> from) {
    seen.clear();
    const auto read = player->advance(until, from, [&seen](const RecordedMessage& message) {
      if (message.channel == channels::kSurface) seen.push_back(message.arrival);
    });
    ASSERT_TRUE(read) << read.error().message;
  };
  advance(kBegin + 150ms, std::nullopt);
  EXPECT_THAT(seen, testing::ElementsAre(kBegin, kBegin + 100ms));
  advance(kBegin + 200ms, std::nullopt);
  EXPECT_THAT(seen, testing::ElementsAre(kBegin + 200ms));
  advance(kBegin + 9s, kBegin + 8900ms);
  EXPECT_THAT(seen, testing::ElementsAre(kBegin + 8900ms, kBegin + 9s));
  advance(kBegin + 300ms, kBegin + 300ms);
  EXPECT_THAT(seen, testing::ElementsAre(kBegin + 300ms));
  advance(kBegin + 1h, std::nullopt);
  EXPECT_EQ(seen.back(), kBegin + 10s);
  advance(kBegin + 2h, std::nullopt);
  EXPECT_TRUE(seen.empty());
}

TEST_F(Recorded, WhatIsCutOffIsShownAsFarAsItIsWholeAndSaid) {
  const std::string file = write();
  fs::resize_file(file, fs::file_size(file) * 2 / 3);
  auto server = WebServer::listen({"127.0.0.1", 0}, view_page());
  ASSERT_TRUE(server);
  std::vector<std::string> told;
  const auto view = RecordedView::open({file, ""}, *server, [&told](const std::string& what) { told.push_back(what); });
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.front(), "a file is damaged, or was cut off: what is whole is shown");
  EXPECT_THAT(told, testing::Contains(HasSubstr("samples.mcap: byte ")));
  EXPECT_FALSE((*view)->said(1, "no request"));
  EXPECT_TRUE((*view)->said(1, R"({"at_s": 1.0})"));
  EXPECT_TRUE((*view)->said(1, R"({"at_s": 1e6, "from_here": true})"));
}

TEST_F(Recorded, WhatIsNoRecordingIsRefusedByName) {
  auto server = WebServer::listen({"127.0.0.1", 0}, view_page());
  ASSERT_TRUE(server);
  const auto say = [](const std::string&) {};
  const auto none = RecordedView::open({(folder_ / "none.mcap").string(), ""}, *server, say);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("none.mcap"));
  const auto other = RecordedView::open({write(), write()}, *server, say);
  ASSERT_FALSE(other);  // there are no pictures whose surfaces these could be
  EXPECT_THAT(other.error().message, HasSubstr("samples.mcap"));
}

// One feature that moves along x with cos phi, and a camera that looks along z.
struct Scene {
  Scene() {
    surface = surface_of(7, perimap_SURFACE_GOOD, kBegin);
    surface.camera_pose_known = true;
    surface.rotation_WC_wxyz[0] = 1.0;
    surface.translation_WC_mm[1] = 2.0;
    surface.camera_focal_px[0] = surface.camera_focal_px[1] = 500.0;
    surface.camera_principal_point_px[0] = 320.0;
    surface.camera_principal_point_px[1] = 240.0;
    coefficients = {10.0, 4.0, 0.0, 22.0, 0.0, 0.0, 100.0, 0.0, 0.0};
    feature.state = perimap_FEATURE_CONVERGED;
    feature.coefficients_W_mm._buffer = coefficients.data();
    feature.coefficients_W_mm._length = feature.coefficients_W_mm._maximum = 9;
    std::copy_n("perimapd", 9, model.source);
    model.cardiac_harmonics = 1;
    model.state = perimap_SURFACE_GOOD;
    model.features._buffer = &feature;
    model.features._length = model.features._maximum = 1;
    model.time_ns = to_ns(kBegin);
    model.valid_from_ns = to_ns(kBegin - 1s);
    model.expected_until_ns = model.valid_until_ns = to_ns(kBegin + 1s);
    model.cardiac_clock.law = perimap_PHASE_LAW_LINEAR;
    // Half a cycle has passed at the capture.
    cycle.begin_time_ns = surface.capture_time_ns - 400'000'000;
    cycle.length_ns = 800'000'000;
    model.cardiac_cycles._buffer = &cycle;
    model.cardiac_cycles._length = model.cardiac_cycles._maximum = 1;
  }
  perimap_Surface surface{};
  std::vector<double> coefficients;
  perimap_ModelFeature feature{};
  perimap_CardiacCycle cycle{};
  perimap_SurfaceModel model{};
  CameraModel lens{640, 480, 400.0, 400.0, 300.0, 200.0};
};

TEST(Overlay, FeaturesLieWhereTheModelHasThemWhenTheFrameWasCaptured) {
  const Scene scene;
  const auto json = overlay_json(scene.surface, &scene.model, nullptr, scene.lens, kBegin);
  // At (10 - 4, 22 - 2, 100) from the camera.
  EXPECT_EQ(json["features_px"], nlohmann::ordered_json({320.0 + 500.0 * 0.06, 240.0 + 500.0 * 0.2}));
  EXPECT_EQ(json["feature_states"], nlohmann::ordered_json({2}));
  EXPECT_FALSE(json.contains("triangles"));
}

TEST(Overlay, TheLensIsTheCalibrationsWhereTheSurfaceTellsNone) {
  Scene scene;
  scene.surface.camera_focal_px[0] = scene.surface.camera_focal_px[1] = 0.0;
  scene.lens.k1 = -0.2;
  const auto json = overlay_json(scene.surface, &scene.model, nullptr, scene.lens, kBegin);
  const double bent = 1.0 - 0.2 * (0.06 * 0.06 + 0.2 * 0.2);
  EXPECT_NEAR(json["features_px"][0].get<double>(), 300.0 + 400.0 * 0.06 * bent, 0.051);
  EXPECT_NEAR(json["features_px"][1].get<double>(), 200.0 + 400.0 * 0.2 * bent, 0.051);
}

TEST(Overlay, NothingIsDrawnThatMayNotBe) {
  const auto drawn = [](const Scene& scene, Instant now) {
    return overlay_json(scene.surface, &scene.model, nullptr, scene.lens, now);
  };
  const Scene well;
  EXPECT_NE(drawn(well, kBegin), nullptr);
  EXPECT_EQ(drawn(well, kBegin + 2s), nullptr);  // the model is too old
  EXPECT_EQ(overlay_json(well.surface, nullptr, nullptr, well.lens, kBegin), nullptr);
  Scene invalid;
  invalid.surface.state = perimap_SURFACE_INVALID;
  EXPECT_EQ(drawn(invalid, kBegin), nullptr);
  Scene lost;
  lost.surface.camera_pose_known = false;
  EXPECT_EQ(drawn(lost, kBegin), nullptr);
  Scene behind;
  behind.coefficients[6] = -100.0;
  EXPECT_EQ(drawn(behind, kBegin)["features_px"], nlohmann::ordered_json::array());
}

TEST(JpegEncoder, GivesThePictureBack) {
  constexpr int kWidth = 37, kHeight = 21;
  std::vector<std::uint8_t> pixels(64 * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      pixels[static_cast<std::size_t>(64 * y + x)] = static_cast<std::uint8_t>(3 * x + 5 * y);
  }
  const auto jpeg = encode_jpeg({pixels.data(), kWidth, kHeight, 64}, 95);
  ASSERT_TRUE(jpeg) << jpeg.error().message;
  std::vector<std::uint8_t> back(kWidth * kHeight);
  const auto decoded = JpegDecoder().decode(std::as_bytes(std::span(*jpeg)), kWidth, kHeight, back);
  ASSERT_TRUE(decoded) << decoded.error().message;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) EXPECT_NEAR(back[static_cast<std::size_t>(kWidth * y + x)], 3 * x + 5 * y, 8);
  }
}

TEST(JpegEncoder, RefusesWhatIsNoPicture) {
  EXPECT_FALSE(encode_jpeg({}, 80));
  const std::uint8_t pixel = 0;
  const auto wide = encode_jpeg({&pixel, 70000, 1, 0}, 80);
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().message, HasSubstr("no JPEG"));
}

}  // namespace
}  // namespace perimap

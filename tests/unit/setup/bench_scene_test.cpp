// The simulated bench: what its frames and poses say is what its set-up is, and a recording of it has both.
#include "drivers/standins/simulator/bench_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/field_stop.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "drivers/board/board_pattern.hpp"
#include "drivers/standins/session/bench_writer.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

BenchSettings settings_with(const BoardPattern& board) {
  BenchSettings settings;
  settings.board = board;
  settings.seed = 3;
  settings.setup_seed = 5;
  settings.duration = std::chrono::seconds(4);
  settings.frames_per_s = 5.0;
  return settings;
}

CameraModel camera_of(const ScopeLens& lens) {
  CameraModel camera;
  camera.width = lens.width, camera.height = lens.height;
  camera.fx = lens.fx, camera.fy = lens.fy, camera.cx = lens.cx, camera.cy = lens.cy;
  camera.k1 = lens.k1, camera.k2 = lens.k2, camera.p1 = lens.p1, camera.p2 = lens.p2, camera.k3 = lens.k3;
  return camera;
}

// Share of the frames in which the board is found, each within this of its place.
double found_share(const BenchScene& scene, const BoardWish& wish, double within_mm) {
  const BenchSettings& s = scene.settings();
  std::vector<std::vector<std::uint8_t>> pixels(scene.frames().size());
  std::vector<GreyImage> pictures;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i].resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
    scene.render(i, pixels[i]);
    pictures.push_back({pixels[i].data(), s.width, s.height, s.width});
  }
  const auto board = recognise_board(pictures, wish);
  EXPECT_TRUE(board) << board.error().message;
  std::vector<TimedView> views;
  for (std::size_t i = 0; board && i < pictures.size(); ++i) {
    if (const auto view = find_board(pictures[i], *board)) views.push_back({static_cast<double>(i), *view});
  }
  double found = 0.0;
  for (const TimedPose& pose : camera_poses_of(views, camera_of(scene.setup().lens))) {
    const auto i = static_cast<std::size_t>(pose.t_s);
    const Pose truth = scene.X_WB().inverse() * scene.X_WC(scene.frames()[i].capture - scene.start());
    EXPECT_LT((truth.t - pose.X.t).norm(), within_mm) << "frame " << i;
    found += 1.0 / static_cast<double>(pictures.size());
  }
  return found;
}

TEST(BenchScene, CharucoBoardIsWhereItsFramesShowIt) {
  const auto board = charuco_pattern(12, 9, 8.0, 6.0, 1);
  ASSERT_TRUE(board);
  const auto scene = BenchScene::create(settings_with(*board));
  ASSERT_TRUE(scene) << scene.error().message;
  BoardWish wish;
  wish.square_mm = 8.0;
  EXPECT_GT(found_share(*scene, wish, 1.5), 0.7);
}

TEST(BenchScene, ChessboardIsWhereItsFramesShowIt) {
  const auto board = chessboard_pattern(9, 6, 8.0);
  ASSERT_TRUE(board);
  const auto scene = BenchScene::create(settings_with(*board));
  ASSERT_TRUE(scene) << scene.error().message;
  BoardWish wish;
  wish.kind = BoardKind::kChessboard;
  wish.square_mm = 8.0;
  EXPECT_GT(found_share(*scene, wish, 1.5), 0.3);
}

// An angled scope in two turns: the notch is where it is said to be, the board where the turned lens has it, and the
// hand-eye is another one.
TEST(BenchScene, TurnedScopeHasItsNotchAndItsPrincipalPointInThePictures) {
  const auto board = charuco_pattern(12, 9, 8.0, 6.0, 1);
  ASSERT_TRUE(board);
  BoardWish wish;
  wish.square_mm = 8.0;
  std::vector<ScopeSetup> setups;
  for (const double notch_rad : {0.0, 1.9}) {
    BenchSettings settings = settings_with(*board);
    settings.notch_rad = notch_rad;
    const auto scene = BenchScene::create(settings);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_GT(found_share(*scene, wish, 1.5), 0.5);
    std::vector<std::uint8_t> pixels(std::size_t{640} * 480);
    scene->render(0, pixels);
    const auto read = read_field_stop({pixels.data(), 640, 480, 640});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_NEAR(read->notch_rad, notch_rad, 0.5 * kDegree);
    setups.push_back(scene->setup());
  }
  EXPECT_GT(so3_log(setups[0].X_SC.R.transpose() * setups[1].X_SC.R).norm(), 0.3);
  EXPECT_GT(std::hypot(setups[0].lens.cx - setups[1].lens.cx, setups[0].lens.cy - setups[1].lens.cy), 1.0);
}

TEST(BenchScene, ZoomedScopeHasALargerFieldStopAndALongerFocalLength) {
  const auto board = charuco_pattern(12, 9, 8.0, 6.0, 1);
  ASSERT_TRUE(board);
  BenchSettings settings = settings_with(*board);
  settings.notch_rad = 0.0;
  settings.duration = std::chrono::seconds(5);
  settings.turns = {{std::chrono::seconds(1), {0.0, 1.1}}};
  const auto scene = BenchScene::create(settings);
  ASSERT_TRUE(scene) << scene.error().message;
  const auto radius_px = [&](std::size_t frame) {
    std::vector<std::uint8_t> pixels(std::size_t{640} * 480);
    scene->render(frame, pixels);
    const auto read = read_field_stop({pixels.data(), 640, 480, 640});
    EXPECT_TRUE(read) << read.error().message;
    return read ? read->radius_px : 0.0;
  };
  EXPECT_NEAR(radius_px(scene->frames().size() - 1) / radius_px(0), 1.1, 0.005);
  EXPECT_NEAR(scene->setup_at(std::chrono::seconds(4)).lens.fx / scene->setup().lens.fx, 1.1, 1e-9);
}

TEST(BenchScene, PointerRestsOnTheBoardsOrigin) {
  const auto board = chessboard_pattern(9, 6, 8.0);
  const auto scene = BenchScene::create(settings_with(*board));
  ASSERT_TRUE(scene);
  for (std::size_t i = 0; i < scene->reading_count(); i += 50) {
    const TrackerSample sample = scene->reading(BenchScene::Tool::kPointer, i, {});
    EXPECT_LT((sample.X_WS * scene->setup().tip_T - scene->X_WB().t).norm(), 1e-9);
    EXPECT_LT(sample.source_time, sample.arrival);
  }
}

TEST(BenchScene, OptionsOutOfRangeAreRefusedByName) {
  const auto board = chessboard_pattern(9, 6, 8.0);
  BenchSettings settings = settings_with(*board);
  settings.tracker_rate_hz = 0.0;
  EXPECT_THAT(BenchScene::create(settings).error().message, HasSubstr("tracker rate"));
}

TEST(BenchRecording, HasPosesOfScopeAndPointerAndEqualBytesForAnyThreads) {
  const auto board = chessboard_pattern(9, 6, 8.0);
  BenchSettings settings = settings_with(*board);
  settings.duration = std::chrono::seconds(1);
  const auto scene = BenchScene::create(settings);
  ASSERT_TRUE(scene);
  const auto folder = std::filesystem::temp_directory_path() / ("perimap-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string one = folder / "one.mcap";
  const std::string two = folder / "two.mcap";
  const TrackerNoise noise{1.0, 0.005};
  ASSERT_TRUE(write_bench(*scene, one, noise, 1, [](std::uint64_t) {}));
  ASSERT_TRUE(write_bench(*scene, two, noise, 2, [](std::uint64_t) {}));
  const auto bytes_of = [](const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_TRUE(bytes_of(one) == bytes_of(two));
  const auto scope = read_recorded_poses(one, kScopeTool);
  ASSERT_TRUE(scope) << scope.error().message;
  EXPECT_EQ(scope->size(), scene->reading_count());
  const auto pointer = read_recorded_poses(two, "pointer");
  ASSERT_TRUE(pointer) << pointer.error().message;
  EXPECT_EQ(pointer->size(), scene->reading_count());
  EXPECT_THAT(read_recorded_poses(one, "reference").error().message, HasSubstr("scope, pointer"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace perimap

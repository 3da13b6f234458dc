#include "drivers/standins/session/session_writer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "daemon/command_line/commands.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/standins/truth/truth_messages.hpp"

namespace perimap {

void add_simulate_command(Commands& commands);

namespace {

class WriteSimulation : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("perimap_simulate_") + test->name() + "_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static SimulationSettings small() {
    SimulationSettings settings;
    settings.width = 64;
    settings.height = 64;
    settings.duration = std::chrono::seconds(2);
    settings.tracker_dropouts_per_min = 30.0;
    return settings;
  }

  static std::string bytes(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static int command(const std::vector<std::string>& arguments) {
    Commands commands("perimap", "test", "", "");
    add_simulate_command(commands);
    std::vector<const char*> argv{"perimap", "simulate"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    return commands.run(static_cast<int>(argv.size()), argv.data());
  }

  std::filesystem::path folder_;
};

TEST_F(WriteSimulation, GivesTheSameBytesWithOneAndWithThreeThreads) {
  const auto simulation = Simulation::create(small());
  ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
  const auto write = [&](const char* name, unsigned threads) {
    std::uint64_t last = 0;
    const auto written =
        write_simulation(*simulation, {{folder_ / name, {1.4, 0.01}}}, threads, [&](std::uint64_t frames) {
          EXPECT_EQ(frames, last + 1);
          last = frames;
          return true;
        });
    EXPECT_TRUE(written.has_value()) << written.error().message;
    EXPECT_EQ(last, 60U);
    return bytes(folder_ / name);
  };
  const std::string one = write("one.mcap", 1);
  EXPECT_GT(one.size(), 100000U);
  EXPECT_TRUE(one == write("three.mcap", 3));
}

TEST_F(WriteSimulation, LeavesNothingBehindWhenItCannotWrite) {
  const auto simulation = Simulation::create(small());
  ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
  const auto written =
      write_simulation(*simulation, {{folder_ / "good.mcap", {}}, {folder_ / "no such folder" / "x.mcap", {}}}, 1,
                       [](std::uint64_t) { return true; });
  ASSERT_FALSE(written.has_value());
  EXPECT_NE(written.error().message.find("no such folder"), std::string::npos) << written.error().message;
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(WriteSimulation, LeavesNothingBehindWhenItIsStopped) {
  const auto simulation = Simulation::create(small());
  ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
  std::uint64_t last = 0;
  const auto written =
      write_simulation(*simulation, {{folder_ / "a.mcap", {}}, {folder_ / "b.mcap", {}}}, 2, [&](std::uint64_t frames) {
        last = frames;
        return frames < 3;
      });
  ASSERT_TRUE(written.has_value()) << written.error().message;
  EXPECT_FALSE(*written);
  EXPECT_EQ(last, 3U);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(WriteSimulation, CommandWritesSeveralNoisesFromOneRendering) {
  const std::string out = (folder_ / "heart.mcap").string();
  EXPECT_EQ(command({out, "--size", "64x64", "--duration", "1", "--tracker-noises", "0,1.4"}), 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "heart-0mm.mcap"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "heart-1.4mm.mcap"));
  EXPECT_NE(bytes(folder_ / "heart-0mm.mcap").find("position_deviation_mm = 0.0\nrotation_deviation_deg = 0.0\n"),
            std::string::npos);
  EXPECT_NE(bytes(folder_ / "heart-1.4mm.mcap").find("position_deviation_mm = 1.4\nrotation_deviation_deg = 0.5\n"),
            std::string::npos);
}

TEST_F(WriteSimulation, CommandRefusesTwoOutputsInOneFile) {
  const std::string out = (folder_ / "heart.mcap").string();
  const std::string of_noise = (folder_ / "heart-1.4mm.mcap").string();
  EXPECT_NE(command({out, "--size", "64x64", "--duration", "1", "--tracker-noises", "1.4,1.4"}), 0);
  EXPECT_NE(command({out, "--size", "64x64", "--duration", "1", "--tracker-noises", "0,1.4", "--untold", of_noise}), 0);
  EXPECT_NE(
      command({out, "--size", "64x64", "--duration", "1", "--tracker-noises", "1.4", "--write-procedure", of_noise}),
      0);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(WriteSimulation, CommandMovesTheSurfaceAsATraceDoesAndRecordsIt) {
  const std::string trace = (folder_ / "trace.csv").string();
  std::ofstream written(trace);
  written << "t,a_x,a_y,a_z\n";
  for (int i = 0; i < 300; ++i) {
    const double t = 0.04 * i;
    written << t << ',' << 2.0 * std::sin(6.5 * t) << ',' << std::cos(6.5 * t) << ',' << 40.0 + std::sin(1.2 * t)
            << '\n';
  }
  written.close();
  const std::string out = (folder_ / "heart.mcap").string();
  ASSERT_EQ(command({out, "--size", "64x64", "--duration", "2", "--motion-trace", trace}), 0);
  auto reader = RecordingReader::open(out, ReadMode::kStrict);
  ASSERT_TRUE(reader) << reader.error().message;
  ASSERT_TRUE(reader->select(std::array{channels::kTruthTrace}));
  const auto message = reader->next();
  ASSERT_TRUE(message && *message);
  const auto sample = reader->decode<perimap_TruthTrace>(**message);
  ASSERT_TRUE(sample);
  const auto moved = surface_trace(**sample);
  ASSERT_TRUE(moved);
  EXPECT_TRUE(check(*moved));
  EXPECT_EQ(moved->places_W.size(), 1U);
  // Two seconds, and one more on either side.
  EXPECT_GE(moved->displacements_W.size(), 100U);
}

TEST_F(WriteSimulation, CommandRefusesATraceThatIsNone) {
  const std::string trace = (folder_ / "trace.csv").string();
  std::ofstream(trace) << "0,1,2,3\n0.04,1,2,x\n";
  const std::string out = (folder_ / "heart.mcap").string();
  EXPECT_EQ(command({out, "--motion-trace", trace}), 2);
  EXPECT_EQ(command({out, "--motion-trace", trace + ".gone"}), 2);
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(WriteSimulation, CommandOverwritesOnlyWhenForced) {
  const std::string out = (folder_ / "heart.mcap").string();
  std::ofstream(out) << "mine";
  EXPECT_EQ(command({out, "--size", "64x64", "--duration", "1"}), 2);
  EXPECT_EQ(bytes(out), "mine");
  EXPECT_EQ(command({out, "--size", "64x64", "--duration", "1", "--force"}), 0);
  EXPECT_GT(bytes(out).size(), 1000U);
}

TEST_F(WriteSimulation, CommandRefusesWhatItCannotDo) {
  const std::string out = (folder_ / "heart.mcap").string();
  EXPECT_EQ(command({out, "--size", "64by64"}), 2);
  EXPECT_EQ(command({out, "--ecg", "99"}), 2);
  EXPECT_EQ(command({out, "--duration", "0"}), 2);
  EXPECT_EQ(command({out, "--motion", "wobbly"}), 2);
  EXPECT_EQ(command({out, "--tracker-noise", "-1"}), 2);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(WriteSimulation, TruthComesBackFromItsMessages) {
  SimulationSettings settings = small();
  settings.law = MotionLaw::kTimeLocked;
  settings.respiration_mm = 7.0;
  const auto simulation = Simulation::create(settings);
  ASSERT_TRUE(simulation.has_value()) << simulation.error().message;
  const GroundTruth& truth = simulation->truth();
  std::vector<std::int64_t> r_peaks_ns;
  const auto mesh = heart_mesh(borrow_truth_mesh(truth.mesh()));
  const auto motion = heart_motion(borrow_truth_motion(truth.motion(), r_peaks_ns));
  ASSERT_TRUE(mesh.has_value());
  ASSERT_TRUE(motion.has_value());
  EXPECT_EQ(mesh->coefficients_mm, truth.mesh().coefficients_mm);
  EXPECT_EQ(mesh->triangles, truth.mesh().triangles);
  const Simulation::Frame& frame = simulation->frames()[33];
  const auto camera = camera_truth(to_truth_camera({frame.stamp.capture, frame.X_WC}));
  ASSERT_TRUE(camera.has_value());
  EXPECT_LT((camera->X_WC.R - frame.X_WC.R).norm(), 1e-14);

  const auto again = GroundTruth::create(*mesh, *motion, {*camera});
  ASSERT_TRUE(again.has_value());
  const auto point = again->first_hit(camera->X_WC, simulation->lens().ray({32.0, 32.0}), frame.stamp.capture);
  ASSERT_TRUE(point.has_value());
  for (const auto later : {0, 170, 555, 1234}) {
    const Instant t = frame.stamp.capture + std::chrono::milliseconds(later);
    EXPECT_LT((again->position(*point, t) - truth.position(*point, t)).norm(), 1e-12);
  }
}

TEST_F(WriteSimulation, TruthMessagesThatMeanNothingAreRefused) {
  perimap_TruthMotion motion{};
  EXPECT_FALSE(heart_motion(motion).has_value());
  perimap_TruthMesh mesh{};
  EXPECT_FALSE(heart_mesh(mesh).has_value());
  perimap_TruthCamera camera{};
  EXPECT_FALSE(camera_truth(camera).has_value()) << "the zero quaternion is no rotation";
}

}  // namespace
}  // namespace perimap

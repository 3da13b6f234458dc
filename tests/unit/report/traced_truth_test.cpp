// What moved a simulated surface is known from its recording.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/evaluation/report/recorded_truth.hpp"
#include "drivers/standins/session/session_writer.hpp"
#include "drivers/standins/trace/hindsight.hpp"

namespace perimap {
namespace {

TEST(RecordedTruth, MovesWithTheTraceThatMovedTheSurface) {
  MotionTrace motion{{"a"}, 0.0, 0.04, {}};
  motion.positions.resize(300, 3);
  for (Eigen::Index i = 0; i < 300; ++i) {
    const double t = 0.04 * static_cast<double>(i);
    motion.positions.row(i) << 2.0 * std::sin(6.5 * t), std::cos(6.5 * t), 40.0 + std::sin(1.2 * t);
  }
  auto hindsight = in_hindsight(motion);
  ASSERT_TRUE(hindsight);
  SimulationSettings settings;
  settings.width = 64;
  settings.height = 64;
  settings.duration = std::chrono::seconds(2);
  settings.trace = std::make_shared<const HeartTrace>(HeartTrace{std::move(motion), *std::move(hindsight)});
  const auto simulation = Simulation::create(settings);
  ASSERT_TRUE(simulation) << simulation.error().message;
  const auto path = std::filesystem::temp_directory_path() / ("perimap_traced_" + std::to_string(getpid()) + ".mcap");
  ASSERT_TRUE(write_simulation(*simulation, {{path, {}}}, 1, [](std::uint64_t) { return true; }));
  const auto recorded = load_truth(path.string(), ReadMode::kStrict);
  std::filesystem::remove(path);
  ASSERT_TRUE(recorded && *recorded);
  const GroundTruth& truth = (*recorded)->truth;
  const SurfacePoint point{100, {0.2, 0.3, 0.5}};
  for (const double s : {0.3, 1.1, 1.9}) {
    const Instant t = simulation->start() + from_seconds(s);
    EXPECT_LT((truth.position(point, t) - simulation->truth().position(point, t)).norm(), 1e-9);
    EXPECT_GT((truth.position(point, t) - truth.position(point, simulation->start())).norm(), 0.01);
  }
}

}  // namespace
}  // namespace perimap

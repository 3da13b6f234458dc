#include "daemon/runtime/device_setup.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/calibration/calibration_file.hpp"
#include "drivers/video/video_module.hpp"

namespace perimap {
namespace {

CameraModel camera() {
  CameraModel model;
  model.width = 320;
  model.height = 240;
  model.fx = model.fy = 400.0;
  model.cx = 160.0;
  model.cy = 120.0;
  return model;
}

// Loading it takes a quarter of a second, which a camera's thread with priority would take from all others.
TEST(DeviceSetup, WhatReadsAVideoIsLoadedBeforeItsThreadBegins) {
  const auto is_loaded = [] { return dlopen(kVideoModule, RTLD_LAZY | RTLD_NOLOAD) != nullptr; };
  const std::filesystem::path folder = testing::TempDir() + "device_setup_test";
  std::filesystem::create_directory(folder);
  std::ofstream(folder / "heart.avi") << "not looked into yet";
  ASSERT_TRUE(write_calibration(folder / "camera.yaml", camera()));
  Configuration configuration;
  configuration.camera.device = "video:heart.avi";
  configuration.camera.calibration = folder / "camera.yaml";
  configuration.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  configuration.tracker.port = "tcp:127.0.0.1:1";
  configuration.ecg.protocol = EcgConfiguration::Protocol::kCyton;
  configuration.ecg.port = "/dev/null";

  ASSERT_FALSE(is_loaded());
  const auto setup = prepare_devices(folder / "devices.toml", configuration);
  ASSERT_TRUE(setup) << setup.error().error.message;
  EXPECT_TRUE(is_loaded());
  std::filesystem::remove_all(folder);
}

TEST(PipelineSettings, AConvergedDeviationOfZeroAsRecordingsHoldItIsOneMillimetre) {
  Configuration configuration;
  configuration.tracker.position_deviation_mm = 1.4;
  configuration.estimation.converged_deviation_mm = 0.0;
  EXPECT_EQ(pipeline_settings(configuration, camera()).estimator.converged_deviation_mm, 1.0);
  configuration.estimation.converged_deviation_mm = 0.4;
  EXPECT_EQ(pipeline_settings(configuration, camera()).estimator.converged_deviation_mm, 0.4);
}

}  // namespace
}  // namespace perimap

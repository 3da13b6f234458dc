#include "daemon/runtime/device_setup.hpp"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
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

TEST(DeviceSetup, AHandEyeOfAnotherSensorIsRefused) {
  Configuration configuration;
  configuration.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  configuration.tracker.port = "tcp:127.0.0.1:1";
  configuration.tracker.sensor = "0A";
  configuration.tracker.hand_eye_sensor = "0B";
  const auto setup = prepare_devices("devices.toml", configuration);
  ASSERT_FALSE(setup);
  EXPECT_TRUE(setup.error().error.message.starts_with("devices.toml: key 'tracker.hand_eye_sensor': "))
      << setup.error().error.message;
}

// Their readings come by where they stand among those that the driver was asked for.
TEST(DeviceSetup, ASecondSensorIsAmongTheToolsInTheirOrder) {
  TrackerConfiguration tracker;
  tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  tracker.port = "tcp:127.0.0.1:1";
  tracker.sensor = "0A";
  tracker.pointer = "0C";
  tracker.second_sensor = "0D";
  tracker.instruments = {"0E"};
  const auto ndi = tracker_device(tracker);
  ASSERT_TRUE(ndi) << ndi.error().front().what;
  const auto second = second_sensor_of(ndi->tools);
  ASSERT_EQ(second, 2U);
  EXPECT_EQ(std::get<NdiSettings>(ndi->settings).tools.at(*second - 1).handle, 0x0D);
  tracker.protocol = TrackerConfiguration::Protocol::kIgtl;
  const auto igtl = tracker_device(tracker);
  ASSERT_TRUE(igtl) << igtl.error().front().what;
  EXPECT_EQ(std::get<IgtlSettings>(igtl->settings).tools.at(*second_sensor_of(igtl->tools) - 1), "0D");
  tracker.second_sensor = "0C";
  const auto twice = tracker_device(tracker);
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().front().key, "tracker.second_sensor");
  EXPECT_TRUE(twice.error().front().what.starts_with("expected another tool than"));
}

// Of all devices, each at its place: a missing port of the tracker and of the ECG is one run, not two.
TEST(DeviceSetup, AllThatIsWrongIsToldAtOnceInTheOrderOfTheFile) {
  const std::filesystem::path file = testing::TempDir() + "device_setup_wrong.toml";
  std::ofstream(file) << "version = 1\n[ecg]\nprotocol = \"cyton\"\n[tracker]\nprotocol = \"ndi\"\n"
                         "sensor = \"0A\"\ninstruments = [\"GG\"]\nhand_eye_sensor = \"0B\"\n"
                         "[camera]\ndevice = \"video:nothing.mkv\"\n";
  const auto configuration = load_configuration(file);
  ASSERT_TRUE(configuration) << configuration.error().message;
  const auto setup = prepare_devices(file, *configuration);
  ASSERT_FALSE(setup);
  EXPECT_TRUE(setup.error().configuration);
  const std::string name = file.string();
  EXPECT_THAT(
      setup.error().error.message,
      testing::MatchesRegex(name + ":2:[0-9]+: key 'ecg.port': expected where the device is, got nothing\n" +  //
                            name + ":4:[0-9]+: key 'tracker.port': expected where the device is, got nothing\n" + name +
                            ":7:[0-9]+: key 'tracker.instruments': expected a port handle[^\n]*\n" +      //
                            name + ":8:[0-9]+: key 'tracker.hand_eye_sensor': expected \"0A\"[^\n]*\n" +  //
                            name + ":9:[0-9]+: key 'camera.calibration': expected [^\n]*\n" +             //
                            name + ":10:[0-9]+: key 'camera.device': expected [^\n]*"));
  std::filesystem::remove(file);
}

TEST(DeviceSetup, OneToolIsNotTwo) {
  TrackerConfiguration tracker;
  tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  tracker.port = "tcp:127.0.0.1:1";
  tracker.sensor = "0A";
  tracker.reference = "0B";
  tracker.pointer = "0C";
  tracker.instruments = {"0D", "E"};
  const auto device = tracker_device(tracker);
  ASSERT_TRUE(device) << device.error().front().what;
  const std::vector<std::string> names{"reference", "pointer", "instrument/0D", "instrument/E"};
  EXPECT_EQ(device->tools, names);
  EXPECT_EQ(std::get<NdiSettings>(device->settings).tools.at(2).handle, 0x0E);
  for (const char* same : {"0A", "a", "0b", "C", "0D"}) {
    tracker.instruments = {"0D", same};
    const auto twice = tracker_device(tracker);
    ASSERT_FALSE(twice) << same;
    EXPECT_EQ(twice.error().front().key, "tracker.instruments");
    EXPECT_TRUE(twice.error().front().what.starts_with("expected another tool than 'tracker."));
  }
  tracker.instruments = {"GG"};
  EXPECT_FALSE(tracker_device(tracker)) << "no port handle";
  tracker.protocol = TrackerConfiguration::Protocol::kIgtl;
  tracker.instruments = {"a", "A"};
  EXPECT_TRUE(tracker_device(tracker)) << "names are names";
  tracker.sensor_definition = "scope.rom";
  tracker.reference = tracker.sensor;
  EXPECT_FALSE(tracker_device(tracker)) << "nothing is uploaded over OpenIGTLink";
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

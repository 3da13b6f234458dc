#include "daemon/runtime/calibration_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "drivers/calibration/calibration_facts.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/turned_scope_file.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

using std::chrono::days;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::chrono::system_clock::time_point kToday =
    CalibrationDate(std::chrono::year(2026) / std::chrono::November / 25) + std::chrono::hours(9);

CameraModel lens() {
  CameraModel camera;
  camera.width = 64, camera.height = 48;
  camera.fx = camera.fy = 80.0;
  camera.cx = 32.0, camera.cy = 24.0;
  return camera;
}

// What is wrong, a line each.
Expected<void> fit_of(const WrongKeys& wrong) {
  std::string all;
  for (const WrongKey& one : wrong) {
    all += (all.empty() ? "" : "\n") + ("key '" + one.key + "': " + one.what);
  }
  if (all.empty()) return {};
  return fail(all);
}
Expected<void> calibrations_fit(const Configuration& configuration) {
  return fit_of(wrong_calibrations(configuration));
}
Expected<void> frames_fit(const Configuration& configuration, const std::filesystem::path& file) {
  return fit_of(wrong_frames(configuration, file));
}

class CalibrationFit : public ::testing::Test {
 protected:
  CalibrationFit() {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-fit-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    configuration_.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  }
  ~CalibrationFit() override { std::filesystem::remove_all(folder_); }
  CalibrationFit(const CalibrationFit&) = delete;
  CalibrationFit& operator=(const CalibrationFit&) = delete;

  std::filesystem::path write(const char* name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  std::filesystem::path folder_;
  Configuration configuration_;
};

TEST(CalibrationDate, IsReadAsPerimapAndOpenCvWriteIt) {
  const CalibrationDate day(std::chrono::year(2026) / std::chrono::November / 25);
  for (const char* text : {"2026-11-25", "2026-11-25 18:30 UTC", "Wed Nov 25 18:30:00 2026",
                           "Wed 25 Nov 2026 06:30:00 PM UTC", "25 Nov 2026"}) {
    EXPECT_EQ(calibration_date_of(text), day) << text;
  }
  for (const char* text : {"", "yesterday", "2026-13-01", "2026-02-30", "18:30"}) {
    EXPECT_FALSE(calibration_date_of(text)) << text;
  }
}

TEST_F(CalibrationFit, AHandEyeOfAnotherSensorIsRefused) {
  configuration_.tracker.hand_eye_sensor = "0a";
  const auto unnamed = calibrations_fit(configuration_);
  ASSERT_FALSE(unnamed) << "any other sensor would be taken for it";
  EXPECT_THAT(unnamed.error().message, HasSubstr("key 'tracker.sensor': expected \"0a\""));
  configuration_.tracker.sensor = "0A";
  EXPECT_TRUE(calibrations_fit(configuration_)) << "handles are numbers";
  configuration_.tracker.sensor = "0B";
  const auto fits = calibrations_fit(configuration_);
  ASSERT_FALSE(fits);
  EXPECT_EQ(fits.error().message,
            "key 'tracker.hand_eye_sensor': expected \"0B\", the tracker.sensor, got \"0a\": the hand-eye is another "
            "sensor's; measure it with `perimap calibrate hand-eye`");
  configuration_.tracker.protocol = TrackerConfiguration::Protocol::kIgtl;
  configuration_.tracker.sensor = "0A";
  EXPECT_FALSE(calibrations_fit(configuration_)) << "names are names";
}

TEST_F(CalibrationFit, AScopeWhoseTurnASecondSensorTellsTakesThatSensor) {
  TurnedScope scope;
  scope.reference.focal_px = {80.0, 80.0};
  scope.width = 64, scope.height = 48;
  scope.second_sensor.emplace();
  std::string text = format_turned_scope(scope);
  text.insert(text.find('{') + 1, R"("second_sensor": "0C",)");
  configuration_.camera.calibration = write("camera.yaml", format_calibration(lens()));
  configuration_.camera.turned_scope = write("scope.json", text);
  const auto unnamed = calibrations_fit(configuration_);
  ASSERT_FALSE(unnamed) << "no frame would have a pose";
  EXPECT_THAT(unnamed.error().message, HasSubstr("key 'tracker.second_sensor': expected \"0C\""));
  configuration_.tracker.second_sensor = "0D";
  const auto other = calibrations_fit(configuration_);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("got \"0D\""));
  configuration_.tracker.second_sensor = "c";
  const auto fits = calibrations_fit(configuration_);
  EXPECT_TRUE(fits) << fits.error().message;
  configuration_.tracker.second_sensor.reset();
  configuration_.tracker.protocol = TrackerConfiguration::Protocol::kNone;
  EXPECT_TRUE(calibrations_fit(configuration_)) << "a recording says itself whether it has one";
  configuration_.tracker.second_sensor = "0D";
  EXPECT_FALSE(calibrations_fit(configuration_)) << "and where it says which one, it is to be the scope's";
}

TEST_F(CalibrationFit, AScopeOfAnotherSensorOrOfOtherPicturesIsRefused) {
  TurnedScope scope;
  scope.reference.focal_px = {80.0, 80.0};
  scope.width = 64, scope.height = 48;
  const auto text_of = [&] {
    std::string text = format_turned_scope(scope);
    return text.insert(text.find('{') + 1, R"("sensor": "0A",)");
  };
  configuration_.camera.calibration = write("camera.yaml", format_calibration(lens()));
  configuration_.camera.turned_scope = write("scope.json", text_of());
  configuration_.tracker.sensor = "0a";
  const auto good = calibrations_fit(configuration_);
  EXPECT_TRUE(good) << good.error().message;
  configuration_.tracker.sensor = "0B";
  const auto other = calibrations_fit(configuration_);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("key 'camera.turned_scope': expected one of \"0B\""));
  configuration_.tracker.sensor.reset();
  EXPECT_FALSE(calibrations_fit(configuration_)) << "any other sensor would be taken for it";
  configuration_.tracker.sensor = "0A";
  scope.width = 128;
  configuration_.camera.turned_scope = write("scope.json", text_of());
  const auto wide = calibrations_fit(configuration_);
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().message, HasSubstr("key 'camera.turned_scope': expected one of pictures of 64x48"));
  configuration_.camera.turned_scope = write("scope.json", "{");
  EXPECT_FALSE(calibrations_fit(configuration_));
}

// As a configuration over recordings is, which says of whose poses they are.
TEST_F(CalibrationFit, WithoutDevicesASensorOrSizeThatIsNamedIsHeldAgainstTheCalibrations) {
  configuration_.tracker.protocol = TrackerConfiguration::Protocol::kNone;
  TurnedScope scope;
  scope.reference.focal_px = {80.0, 80.0};
  scope.width = 64, scope.height = 48;
  std::string text = format_turned_scope(scope);
  configuration_.camera.turned_scope = write("scope.json", text.insert(text.find('{') + 1, R"("sensor": "0A",)"));
  EXPECT_TRUE(calibrations_fit(configuration_)) << "nothing says of which sensor the poses are";
  configuration_.tracker.sensor = "0B";
  EXPECT_FALSE(calibrations_fit(configuration_));
  configuration_.tracker.sensor = "0A";
  EXPECT_TRUE(calibrations_fit(configuration_));
  configuration_.camera.width = 128, configuration_.camera.height = 48;
  const auto wide = calibrations_fit(configuration_);
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().message, HasSubstr("key 'camera.turned_scope': expected one of pictures of 128x48"));
  configuration_.camera.turned_scope.reset();
  configuration_.camera.calibration = write("camera.yaml", format_calibration(lens()));
  const auto other = calibrations_fit(configuration_);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("key 'camera.width': expected the calibration's 64x48, got 128x48"));
}

TEST_F(CalibrationFit, ATipOfAnotherToolIsRefused) {
  configuration_.tracker.pointer = "0C";
  const auto tip_of = [](const std::string& tool) {
    return R"({"tip_mm": [0, 0, 150], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]])" + tool + "}";
  };
  configuration_.tracker.pointer_calibration = write("tip.json", tip_of(R"(, "tool": "0D")"));
  const auto fits = calibrations_fit(configuration_);
  ASSERT_FALSE(fits);
  EXPECT_THAT(fits.error().message, HasSubstr("'tracker.pointer_calibration': expected one of \"0C\""));
  EXPECT_THAT(fits.error().message, HasSubstr("perimap calibrate tool"));
  for (const char* tool : {R"(, "tool": "C")", R"(, "tool": "pointer")", ""}) {
    configuration_.tracker.pointer_calibration = write("tip.json", tip_of(tool));
    EXPECT_TRUE(calibrations_fit(configuration_)) << tool;
  }
}

TEST_F(CalibrationFit, ATipOfAnInstrumentIsOfOneThatTheTrackerHas) {
  TrackerConfiguration& c = configuration_.tracker;
  c.protocol = TrackerConfiguration::Protocol::kNdi;
  c.instruments = {"0E", "0F"};
  const auto tip_of = [this](const char* file, const std::string& tool) {
    return write(file, R"({"tip_mm": [0, 0, 150], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]])" + tool + "}");
  };
  const auto error_of = [&](std::vector<std::filesystem::path> files) {
    c.instrument_calibrations = std::move(files);
    const auto fits = calibrations_fit(configuration_);
    return fits ? std::string() : fits.error().message;
  };
  const auto first = tip_of("e.json", R"(, "tool": "E")"), second = tip_of("f.json", R"(, "tool": "instrument/0F")");
  EXPECT_EQ(error_of({first, second}), "");
  EXPECT_THAT(error_of({tip_of("g.json", R"(, "tool": "10")")}), HasSubstr("'tracker.instruments', got one of \"10\""));
  EXPECT_THAT(error_of({tip_of("h.json", "")}), HasSubstr("does not say of which tool"));
  EXPECT_THAT(error_of({first, tip_of("i.json", R"(, "tool": "E")")}), HasSubstr("got a second one of \"E\""));
  EXPECT_THAT(error_of({write("j.json", "{")}), HasSubstr("perimap calibrate tool"));
}

TEST_F(CalibrationFit, ATipThatCannotBeReadIsRefused) {
  configuration_.tracker.pointer = "0C";
  for (const char* text :
       {"{", "", "[1]", "{}", R"({"tool": "0C"})", R"({"tip_mm": [0, 0]})", R"({"tip_mm": "x"})", "NDI\x01\x02"}) {
    configuration_.tracker.pointer_calibration = write("tip.json", text);
    const auto fits = calibrations_fit(configuration_);
    ASSERT_FALSE(fits) << text;
    EXPECT_THAT(fits.error().message, HasSubstr("tip.json: ")) << text;
  }
}

TEST_F(CalibrationFit, ACalibrationForFramesOfAnotherSizeIsRefused) {
  const std::vector<std::uint8_t> pixels(std::size_t{64} * 48, 100);
  auto writer = VideoWriter::create((folder_ / "scope.avi").string(), 64, 48, 30.0).value();
  ASSERT_TRUE(writer->write({0, {}, {pixels.data(), 64, 48, 64}}, {}));
  ASSERT_TRUE(writer->finish());
  configuration_.camera.device = "video:scope.avi";
  configuration_.camera.calibration = folder_ / "camera.yaml";
  ASSERT_TRUE(write_calibration(folder_ / "camera.yaml", lens()));
  EXPECT_TRUE(frames_fit(configuration_, folder_ / "devices.toml"));
  CameraModel other = lens();
  other.width = 128;
  ASSERT_TRUE(write_calibration(folder_ / "camera.yaml", other));
  const auto fits = frames_fit(configuration_, folder_ / "devices.toml");
  ASSERT_FALSE(fits);
  EXPECT_THAT(fits.error().message, HasSubstr("key 'camera.calibration': expected one for frames of 64x48"));
  EXPECT_THAT(fits.error().message, HasSubstr("got one for 128x48"));
  TurnedScope scope;
  scope.reference.focal_px = {80.0, 80.0};
  scope.width = 128, scope.height = 48;
  configuration_.camera.calibration.reset();
  configuration_.camera.turned_scope = write("scope.json", format_turned_scope(scope));
  const auto turned = frames_fit(configuration_, folder_ / "devices.toml");
  ASSERT_FALSE(turned);
  EXPECT_THAT(turned.error().message, HasSubstr("key 'camera.turned_scope': expected one of pictures of 64x48"));
  ASSERT_TRUE(write_calibration(folder_ / "camera.yaml", lens()));
  configuration_.camera.calibration = folder_ / "camera.yaml";
  EXPECT_TRUE(frames_fit(configuration_, folder_ / "devices.toml")) << "it is told beside the calibration, once";
  EXPECT_THAT(calibrations_fit(configuration_).error().message, HasSubstr("expected one of pictures of 64x48"));
}

TEST_F(CalibrationFit, WhatIsOlderThanItMayBeIsWarnedOf) {
  configuration_.camera.calibration =
      write("camera.yaml", "%YAML:1.0\n---\ncalibration_time: \"2026-10-01 10:00 UTC\"\n");
  configuration_.tracker.hand_eye_date = "2026-10-26";
  configuration_.tracker.pointer_calibration = write("tip.json", R"({"date": "2026-10-25 07:00 UTC"})");
  EXPECT_THAT(old_calibrations(configuration_, kToday),
              ElementsAre("camera.calibration: the one of 2026-10-01 is 55 days old, and setup.maximum_age_days is 30; "
                          "measure it anew with `perimap calibrate camera`",
                          HasSubstr("tracker.pointer_calibration: the one of 2026-10-25 is 31 days old")));
  configuration_.setup.maximum_age_days = 60;
  EXPECT_THAT(old_calibrations(configuration_, kToday), IsEmpty());
  EXPECT_THAT(old_calibrations(configuration_, kToday + days(100)), ::testing::SizeIs(3));
  configuration_.setup.maximum_age_days = 0;
  EXPECT_THAT(old_calibrations(configuration_, kToday + days(10000)), IsEmpty());
}

TEST_F(CalibrationFit, ADayThatIsYetToComeIsWarnedOf) {
  configuration_.tracker.hand_eye_date = "2027-01-01";
  EXPECT_THAT(old_calibrations(configuration_, kToday), ElementsAre(HasSubstr("yet to come")));
}

// It is not younger than the file.
TEST_F(CalibrationFit, WithoutADateAFileIsAsOldAsItsLastWriting) {
  configuration_.camera.calibration = write("camera.yaml", "%YAML:1.0\n---\nimage_width: 64\n");
  const auto now = std::chrono::system_clock::now();
  EXPECT_THAT(old_calibrations(configuration_, now), IsEmpty());
  EXPECT_THAT(old_calibrations(configuration_, now + days(40)), ElementsAre(HasSubstr("days old")));
}

}  // namespace
}  // namespace perimap

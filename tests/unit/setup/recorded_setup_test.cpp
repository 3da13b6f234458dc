// daemon/setup: what recordings, touches and printed boards are made of, and in which words they are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include "core/calibration/dwells.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/setup/attached_devices.hpp"
#include "daemon/setup/first_configuration.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/printed_target.hpp"
#include "daemon/setup/recorded_date.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "drivers/board/board_pattern.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-setup-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }
  [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << text;
    return path_ / name;
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// ---- touches

std::vector<TimedPoint> touched(const std::vector<Vector3d>& places, double noise_mm) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  std::vector<TimedPoint> points;
  double t_s = 10.0;
  const auto add = [&](const Vector3d& p) {
    points.push_back({t_s, p + noise_mm * Vector3d(normal(generator), normal(generator), normal(generator))});
    t_s += 0.01;
  };
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (int k = 0; k < 250; ++k) add(places[i]);
    if (i + 1 == places.size()) break;
    for (int k = 0; k < 100; ++k) add(places[i] + k / 100.0 * (places[i + 1] - places[i]));
  }
  return points;
}

TEST(Dwells, AreWhereTheTipIsHeldStill) {
  const std::vector<Vector3d> places{{0, 0, 0}, {60, 0, 10}, {60, 50, -10}};
  const auto dwells = find_dwells(touched(places, 1.0), 1.5, 4.0);
  ASSERT_EQ(dwells.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((dwells[i].p - places[i]).norm(), 0.6);
    EXPECT_LT((dwells[i].p - places[i]).norm(), 5.0 * dwells[i].deviation_mm);
    EXPECT_NEAR(dwells[i].end_s - dwells[i].begin_s, 2.5, 0.4);
  }
}

TEST(Dwells, AreNoneWhereItOnlyPassesBy) {
  std::vector<TimedPoint> points;
  for (int k = 0; k < 1000; ++k) points.push_back({0.01 * k, Vector3d(0.3 * k, 0.0, 0.0)});
  EXPECT_TRUE(find_dwells(points, 1.5, 4.0).empty());
  EXPECT_TRUE(find_dwells({}, 1.5, 4.0).empty());
}

TEST(Dwells, EndAtAGap) {
  std::vector<TimedPoint> points;
  for (int k = 0; k < 200; ++k) points.push_back({0.01 * k, Vector3d::Zero()});
  for (int k = 0; k < 200; ++k) points.push_back({5.0 + 0.01 * k, Vector3d::Zero()});
  EXPECT_EQ(find_dwells(points, 1.5, 4.0).size(), 2U);
}

// ---- a tool's tip from its file

TEST(ToolTip, IsReadFromWhatCalibrateToolWrites) {
  const Folder folder;
  const auto file = folder.write(
      "pointer.json", R"({"tip_mm": [1, 2.5, -3], "covariance": [[0.04, 0, 0], [0, 0.09, 0], [0, 0, 0.01]]})");
  const auto tip = read_tool_tip(file);
  ASSERT_TRUE(tip) << tip.error().message;
  EXPECT_EQ(tip->tip_T, Vector3d(1, 2.5, -3));
  EXPECT_EQ(tip->covariance_T(1, 1), 0.09);
}

TEST(ToolTip, GarbledFilesAreRefusedByName) {
  const Folder folder;
  for (const char* text :
       {"", "[]", "{", R"({"tip_mm": [1, 2]})", R"({"tip_mm": [1, 2, "3"], "covariance": [[1,0,0],[0,1,0],[0,0,1]]})",
        R"({"tip_mm": [1, 2, 1e9], "covariance": [[1,0,0],[0,1,0],[0,0,1]]})",
        R"({"tip_mm": [1, 2, 3], "covariance": [[1,0,0],[0,1],[0,0,1]]})", R"({"tip_mm": [1, 2, 3]})"}) {
    const auto tip = read_tool_tip(folder.write("pointer.json", text));
    ASSERT_FALSE(tip) << text;
    EXPECT_THAT(tip.error().message, HasSubstr("pointer.json: "));
  }
}

// ---- what is told while it is recorded

TEST(LiveGuide, PivotIsEnoughOnceTheToolWasTurnedToAllSides) {
  const auto guide = pivot_guide(10.0);
  const auto swung = [](double seconds, double turn) {
    std::mt19937 generator(2);
    std::normal_distribution<double> normal(0.0, 0.3);
    std::vector<TimedPose> poses;
    for (double t = 0.0; t < seconds; t += 0.02) {
      Pose X;
      X.R = so3_exp(turn * Vector3d(std::sin(1.3 * t), std::sin(1.9 * t + 1.0), std::sin(0.9 * t)));
      X.t = Vector3d(10.0, 0.0, -500.0) - X.R * Vector3d(0.0, 0.0, 120.0) +
            Vector3d(normal(generator), normal(generator), normal(generator));
      poses.push_back({t, X});
    }
    return poses;
  };
  EXPECT_FALSE(guide->enough());
  EXPECT_THAT(guide->line(), HasSubstr("no poses"));
  guide->follow(swung(3.0, 0.5));
  EXPECT_FALSE(guide->enough()) << "too short";
  guide->follow(swung(15.0, 0.02));
  EXPECT_FALSE(guide->enough()) << "hardly turned";
  guide->follow(swung(15.0, 0.5));
  EXPECT_TRUE(guide->enough()) << guide->line();
  EXPECT_THAT(guide->line(), HasSubstr("mm RMS"));
}

TEST(LiveGuide, BoardThatIsNotSeenIsToldAndSoIsWhereItIsMissing) {
  const auto guide = board_guide({}, std::nullopt, 1.0);
  const std::vector<std::uint8_t> grey(64 * 64, 90);
  guide->see(0.0, {grey.data(), 64, 64, 64});
  EXPECT_THAT(guide->line(), HasSubstr("no board is seen"));
  EXPECT_FALSE(guide->enough());
}

// ---- boards to print

TEST(PrintedTarget, StatesItsPageAndIsOfExactMillimetres) {
  const auto pattern = charuco_pattern(12, 9, 8.0, 6.0, 1);
  ASSERT_TRUE(pattern) << pattern.error().message;
  const auto paper = paper_named("A4");
  ASSERT_TRUE(paper);
  const auto target = print_target(*pattern, *paper);
  ASSERT_TRUE(target) << target.error().message;
  EXPECT_EQ(target->page_width_mm, 297.0);
  EXPECT_TRUE(target->pdf.starts_with("%PDF-"));
  // 297 x 210 mm are 841.89 x 595.28 points.
  EXPECT_THAT(target->pdf, HasSubstr("/MediaBox [ 0 0 841.889764 595.275591 ]"));
}

TEST(PrintedTarget, WhatDoesNotFitIsRefused) {
  const auto pattern = chessboard_pattern(9, 6, 30.0);
  ASSERT_TRUE(pattern);
  EXPECT_THAT(print_target(*pattern, *paper_named("A4")).error().message, HasSubstr("larger page"));
  EXPECT_TRUE(print_target(*pattern, *paper_named("A3")));
  EXPECT_THAT(paper_named("A9").error().message, HasSubstr("--page"));
}

TEST(BoardPattern, SquaresAreWhereTheBoardsFrameHasThem) {
  const auto pattern = chessboard_pattern(9, 6, 8.0);
  ASSERT_TRUE(pattern);
  EXPECT_EQ(pattern->black.size(), 35U);  // of 10 x 7
  EXPECT_EQ(pattern->black.front().x_mm, -8.0);
  EXPECT_EQ(pattern->outline.width_mm, 80.0);
  EXPECT_THAT(chessboard_pattern(1, 6, 8.0).error().message, HasSubstr("columns and rows"));
  EXPECT_THAT(charuco_pattern(20, 20, 8.0, 6.0, 0).error().message, HasSubstr("the dictionary has 50"));
  EXPECT_THAT(charuco_pattern(12, 9, 8.0, 8.0, 0).error().message, HasSubstr("markers of 20 to 95 %"));
}

// ---- results as files

std::string text_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(KeptResults, AreAllInTheirPlaceOrNone) {
  const Folder folder;
  const auto calibration = folder.write("camera.yaml", "before\n");
  const auto page = folder.path() / "page.html";
  const auto configuration = folder.write("devices.toml", "before too\n");
  {
    KeptResults results;
    ASSERT_TRUE(results.add(calibration, "after\n"));
    ASSERT_TRUE(results.add(page, "page\n"));
    ASSERT_TRUE(results.add(configuration, "after too\n"));
    // What is in the way of the last one comes in between.
    std::filesystem::remove(configuration);
    static_cast<void>(folder.write("devices.toml/in_the_way", ""));
    const auto put = results.put_in_place();
    ASSERT_FALSE(put);
    EXPECT_THAT(put.error().message, HasSubstr("devices.toml"));
  }
  EXPECT_EQ(text_in(calibration), "before\n");
  EXPECT_FALSE(std::filesystem::exists(page));
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 2U) << "nothing is left beside";
}

TEST(KeptResults, OfWhichOneCannotBeWrittenAreNotThere) {
  const Folder folder;
  const auto calibration = folder.write("camera.yaml", "before\n");
  {
    KeptResults results;
    ASSERT_TRUE(results.add(calibration, "after\n"));
    EXPECT_FALSE(results.add(folder.path() / "gone" / "page.html", "page\n"));
  }
  EXPECT_EQ(text_in(calibration), "before\n");
  EXPECT_FALSE(std::filesystem::exists(calibration.string() + ".new"));
}

// ---- when a recording was made

TEST(DateOfMeasurement, IsTheRecordingsAndNotTheDayOnWhichItIsLookedAt) {
  const Folder folder;
  const auto date_of = [&](const std::string& name, Duration utc_minus_monotonic) {
    const std::string file = (folder.path() / name).string();
    SensorRecordingFacts facts;
    facts.utc_minus_monotonic = utc_minus_monotonic;
    auto writer = SensorWriter::create(file, facts, Instant(std::chrono::hours(1)));
    EXPECT_TRUE(writer && writer->finish()) << file;
    return date_of_measurement(file);
  };
  EXPECT_EQ(date_of("old.mcap", std::chrono::seconds(1'700'000'000)), "2023-11-14 23:13 UTC");
  EXPECT_THAT(date_of("undated.mcap", Duration(0)), testing::EndsWith("(worked out; the recording has no date)"));
  EXPECT_THAT(date_of_measurement((folder.path() / "gone.mcap").string()), HasSubstr("no date"));
  EXPECT_EQ(date_of_measurement("").size(), date_now().size());
}

// ---- whose poses a recording has

std::string recording_of(const Folder& folder, const std::string& name, const char* configuration) {
  const std::string file = (folder.path() / name).string();
  SensorRecordingFacts facts;
  if (configuration != nullptr) facts.configuration = configuration;
  auto writer = SensorWriter::create(file, facts, Instant(std::chrono::seconds(1)));
  EXPECT_TRUE(writer && writer->finish()) << file;
  return file;
}

TEST(RecordedSensor, IsWhatTheRecordingSaysRatherThanAConfigurationOfToday) {
  const Folder folder;
  const std::string told =
      recording_of(folder, "told.mcap", "version = 1\n[tracker]\nsensor = \"0A\"\npointer = \"0C\"\n");
  EXPECT_EQ(recorded_handle(told, "scope").value(), "0A");
  EXPECT_EQ(recorded_handle(told, "pointer").value(), "0C");
  EXPECT_EQ(recorded_handle(told, "instrument/drill").value(), std::nullopt);
  Configuration configuration;
  configuration.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  EXPECT_EQ(calibrated_sensor(told, configuration, "devices.toml").value(), "0A");
  configuration.tracker.sensor = "0a";
  EXPECT_EQ(calibrated_sensor(told, configuration, "devices.toml").value(), "0a") << "handles are numbers";
  configuration.tracker.sensor = "0B";
  const auto other = calibrated_sensor(told, configuration, "devices.toml");
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message,
              HasSubstr("told.mcap: is of the sensor \"0A\", and tracker.sensor of devices.toml is \"0B\""));
  for (const char* silent : {static_cast<const char*>(nullptr), "version = 1\n"}) {
    const std::string file = recording_of(folder, "silent.mcap", silent);
    EXPECT_EQ(recorded_handle(file, "scope").value(), std::nullopt);
    EXPECT_EQ(calibrated_sensor(file, configuration, "devices.toml").value(), "0B");
    EXPECT_EQ(calibrated_sensor(file, {}, "").value(), std::nullopt);
  }
}

// ---- the first configuration

TEST(FirstConfiguration, IsSoundWithAndWithoutDevices) {
  const Folder folder;
  const auto file = folder.path() / "perimap.toml";
  const auto none = parse_configuration(first_configuration({}, "perimap.toml", "today"), file);
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_EQ(none->tracker.protocol, TrackerConfiguration::Protocol::kNone);
  SetupAnswers answers{"v4l2:/dev/video0", "", "ndi", "/dev/ttyUSB0", "cyton", "/dev/ttyUSB1"};
  const auto all = parse_configuration(first_configuration(answers, "perimap.toml", "today"), file);
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_EQ(all->camera.device, "v4l2:/dev/video0");
  EXPECT_EQ(all->ecg.port, "/dev/ttyUSB1");
}

TEST(FirstConfiguration, MeasuredKeysTakeTheirPlaces) {
  const Folder folder;
  const auto file = folder.write("perimap.toml", first_configuration({}, "perimap.toml", "today"));
  const auto noise = configuration_with_keys(file, "tracker", {{"position_deviation_mm", "1.25"}}, "measured");
  ASSERT_TRUE(noise) << noise.error().message;
  static_cast<void>(folder.write("perimap.toml", *noise));
  const auto lens = configuration_with_keys(file, "camera", {{"calibration", "\"camera.yaml\""}}, "measured", true);
  ASSERT_TRUE(lens) << lens.error().message;
  static_cast<void>(folder.write("perimap.toml", *lens));
  const auto loaded = load_configuration(file, {}, NamedFiles::kMayBeMissing);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->tracker.position_deviation_mm, 1.25);
  EXPECT_EQ(loaded->camera.calibration, folder.path() / "camera.yaml");
}

TEST(AttachedDevices, AreFoundByTheirLastingNames) {
  const Folder folder;
  static_cast<void>(folder.write("v4l/by-id/usb-Scope-video-index0", ""));
  static_cast<void>(folder.write("v4l/by-id/usb-Scope-video-index1", ""));
  static_cast<void>(folder.write("serial/by-id/usb-FTDI_FT231X_USB_UART_D1-if00-port0", ""));
  static_cast<void>(folder.write("serial/by-id/usb-NDI_NDI_Host_USB_P1-if00-port0", ""));
  static_cast<void>(folder.write("video0", ""));
  EXPECT_THAT(attached_cameras(folder.path()),
              ElementsAre((folder.path() / "v4l/by-id/usb-Scope-video-index0").string()));
  const auto ports = attached_ports(folder.path());
  ASSERT_EQ(ports.size(), 2U);
  EXPECT_EQ(ports[0].ecg, "cyton");
  EXPECT_EQ(ports[1].tracker, "ndi");
  EXPECT_TRUE(attached_ports(folder.path() / "nothing").empty());
}

}  // namespace
}  // namespace perimap

#include "drivers/calibration/calibration_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

#include "tests/unit/damage/damage.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kYaml = R"(%YAML:1.0
---
calibration_time: "Tue 21 Nov 2023 10:00:00"
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 700.5, 0., 319.5, 0., 701.25, 239.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.25, 0.0625, 1.0e-3, -2.0e-3, 0.01 ]
avg_reprojection_error: 0.2
)";

constexpr const char* kJson = R"({
"image_width": 640, "image_height": 480,
"camera_matrix": {"rows": 3, "cols": 3, "data": [700.5, 0, 319.5, 0, 701.25, 239.5, 0, 0, 1]},
"distortion_coefficients": {"rows": 1, "cols": 5, "data": [-0.25, 0.0625, 1.0e-3, -2.0e-3, 0.01]}
})";

std::string with(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string error_of(std::string_view text) {
  const Expected<CameraModel> result = parse_calibration(text, "cam.yaml");
  return result ? "accepted" : result.error().message;
}

class CalibrationFormat : public ::testing::TestWithParam<const char*> {};

TEST_P(CalibrationFormat, IsRead) {
  const Expected<CameraModel> camera = parse_calibration(GetParam(), "cam");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->width, 640);
  EXPECT_EQ(camera->height, 480);
  EXPECT_EQ(camera->fx, 700.5);
  EXPECT_EQ(camera->fy, 701.25);
  EXPECT_EQ(camera->cx, 319.5);
  EXPECT_EQ(camera->cy, 239.5);
  EXPECT_EQ(camera->k1, -0.25);
  EXPECT_EQ(camera->k2, 0.0625);
  EXPECT_EQ(camera->p1, 1.0e-3);
  EXPECT_EQ(camera->p2, -2.0e-3);
  EXPECT_EQ(camera->k3, 0.01);
}

INSTANTIATE_TEST_SUITE_P(OfOpenCv, CalibrationFormat, ::testing::Values(kYaml, kJson));

TEST(CalibrationFile, WhatIsWrittenReadsBackExactly) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  std::string name = (std::filesystem::temp_directory_path() / "perimap-calibration-XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  ASSERT_GE(descriptor, 0);
  close(descriptor);
  for (int i = 0; i < 20; ++i) {
    CameraModel camera;
    camera.width = 640 + i;
    camera.height = 480;
    camera.fx = 700 + normal(generator);
    camera.fy = 700 + normal(generator);
    camera.cx = 320 + normal(generator);
    camera.cy = 240 + normal(generator);
    camera.k1 = 0.1 * normal(generator);
    camera.k2 = 0.1 * normal(generator);
    camera.p1 = 1e-3 * normal(generator);
    camera.p2 = 1e-3 * normal(generator);
    camera.k3 = i % 2 == 0 ? 0.0 : 0.1 * normal(generator);
    ASSERT_TRUE(write_calibration(name, camera));
    const Expected<CameraModel> read = read_calibration(name);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->width, camera.width);
    EXPECT_EQ(read->height, camera.height);
    EXPECT_EQ(read->fx, camera.fx);
    EXPECT_EQ(read->fy, camera.fy);
    EXPECT_EQ(read->cx, camera.cx);
    EXPECT_EQ(read->cy, camera.cy);
    EXPECT_EQ(read->k1, camera.k1);
    EXPECT_EQ(read->k2, camera.k2);
    EXPECT_EQ(read->p1, camera.p1);
    EXPECT_EQ(read->p2, camera.p2);
    EXPECT_EQ(read->k3, camera.k3);
  }
  std::filesystem::remove(name);
}

TEST(CalibrationFile, LongerDistortionIsAcceptedOnlyWithZeros) {
  const std::string row = "data: [ -0.25, 0.0625, 1.0e-3, -2.0e-3, 0.01 ]";
  const std::string eight = with(kYaml, "rows: 5", "rows: 8");
  EXPECT_EQ(error_of(with(eight, row, "data: [ -0.25, 0.0625, 0., 0., 0.01, 0., 0., 0. ]")), "accepted");
  EXPECT_EQ(error_of(with(eight, row, "data: [ -0.25, 0.0625, 0., 0., 0.01, 0., 0.5, 0. ]")),
            "cam.yaml: key 'distortion_coefficients': expected k1 k2 p1 p2 k3 and zeros (Brown-Conrady), got 0.5 as "
            "number 7");
}

TEST(CalibrationFile, AFisheyeIsToldByItsModelsName) {
  const std::string fisheye = with(with(with(kYaml, "rows: 5", "rows: 4"), "[ -0.25, 0.0625, 1.0e-3, -2.0e-3, 0.01 ]",
                                        "[ 0.1, -0.02, 0.003, -4e-4 ]"),
                                   "avg_reprojection_error: 0.2", "distortion_model: equidistant");
  const Expected<CameraModel> camera = parse_calibration(fisheye, "cam.yaml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->lens, Lens::kKannalaBrandt);
  EXPECT_EQ(camera->k1, 0.1);
  EXPECT_EQ(camera->k2, -0.02);
  EXPECT_EQ(camera->k3, 0.003);
  EXPECT_EQ(camera->k4, -4e-4);
  EXPECT_EQ(camera->p1, 0.0);
  const Expected<CameraModel> again = parse_calibration(format_calibration(*camera), "again");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->lens, Lens::kKannalaBrandt);
  EXPECT_EQ(again->k4, camera->k4);
  EXPECT_THAT(error_of(with(fisheye, "equidistant", "cylinder")),
              "cam.yaml: key 'distortion_model': expected plumb_bob, rational_polynomial, equidistant or fisheye, got "
              "cylinder");
  EXPECT_THAT(error_of(with(kYaml, "avg_reprojection_error: 0.2", "distortion_model: fisheye")),
              StartsWith("cam.yaml: key 'distortion_coefficients': expected 4 numbers"));
}

TEST(CalibrationFile, AMissingFileIsNamed) {
  const Expected<CameraModel> result = read_calibration("/nowhere/cam.yaml");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message,
            "/nowhere/cam.yaml: expected a readable calibration file, got: No such file or directory");
}

struct Wrong {
  const char* name;
  std::string text;
  std::string error;
};

class WrongCalibration : public ::testing::TestWithParam<Wrong> {};

TEST_P(WrongCalibration, GivesOneLineThatNamesFileAndKey) {
  const std::string error = error_of(GetParam().text);
  EXPECT_THAT(error, StartsWith(GetParam().error));
  EXPECT_EQ(error.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Table, WrongCalibration,
    ::testing::Values(
        Wrong{"Empty", "", "cam.yaml: expected the keys of an OpenCV calibration, got none"},
        Wrong{"Binary", std::string("\x89MCAP0\r\n\0\xff\xfe", 11), "cam.yaml:2:3: expected an OpenCV calibration"},
        Wrong{"PlainText", "hello", "cam.yaml: expected the keys"},
        Wrong{"NoWidth", with(kYaml, "image_width: 640\n", ""),
              "cam.yaml: key 'image_width': expected an integer from 1 to 16384, got nothing"},
        Wrong{"WidthAsText", with(kYaml, "image_width: 640", "image_width: wide"),
              "cam.yaml: key 'image_width': expected an integer from 1 to 16384, got something else"},
        Wrong{"HeightZero", with(kYaml, "image_height: 480", "image_height: 0"),
              "cam.yaml: key 'image_height': expected an integer from 1 to 16384, got 0"},
        Wrong{"NoMatrix", with(kYaml, "camera_matrix", "camera_matrx"),
              "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got nothing"},
        Wrong{"MatrixIsANumber", "%YAML:1.0\nimage_width: 6\nimage_height: 4\ncamera_matrix: 3\n",
              "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got something else"},
        Wrong{"MatrixWithoutData", with(kYaml, "data: [ 700.5", "dota: [ 700.5"),
              "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got something else than rows, cols"},
        Wrong{"MatrixTooShort", with(kYaml, "0., 0., 1. ]", "0., 0. ]"),
              "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got 3 rows, 3 columns and 8 numbers"},
        Wrong{"HugeDimensions", with(kYaml, "rows: 3", "rows: 2147483647"),
              "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got 2147483647 rows"},
        Wrong{"NineByOne", with(with(kYaml, "rows: 3", "rows: 9"), "cols: 3", "cols: 1"),
              "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got 9 rows, 1 columns and 9 numbers"},
        Wrong{"Skewed", with(kYaml, "700.5, 0.,", "700.5, 1.,"),
              "cam.yaml: key 'camera_matrix': expected [fx 0 cx; 0 fy cy; 0 0 1], got another form"},
        Wrong{"NegativeFocalLength", with(kYaml, "700.5", "-700.5"),
              "cam.yaml: key 'camera_matrix': expected focal lengths above 0"},
        Wrong{
            "NotANumber", with(kYaml, "319.5", ".Nan"),
            "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got an element that is no finite number"},
        Wrong{
            "WordInMatrix", with(kYaml, "319.5", "wide"),
            "cam.yaml: key 'camera_matrix': expected a 3x3 matrix of numbers, got an element that is no finite number"},
        Wrong{"NoDistortion", with(kYaml, "distortion_coefficients", "distortion"),
              "cam.yaml: key 'distortion_coefficients': expected 4, 5, 8, 12 or 14 numbers in a row or column, got "
              "nothing"},
        Wrong{"SixCoefficients", with(with(kYaml, "rows: 5", "rows: 6"), "0.01 ]", "0.01, 0. ]"),
              "cam.yaml: key 'distortion_coefficients': expected 4, 5, 8, 12 or 14 numbers in a row or column, got 6"},
        Wrong{"OpenList", with(kYaml, "0., 0., 1. ]", "0., 0., 1."), "cam.yaml:11:24: expected an OpenCV calibration"},
        Wrong{"Xml", "<?xml version=\"1.0\"?>\n<opencv_storage>\n</opencv_storage>\n", "cam.yaml: expected the keys"},
        Wrong{"DeepLists", "image_width: " + std::string(100000, '['), "cam.yaml:"},
        Wrong{"TooLarge", std::string((1 << 20) + 1, ' '), "cam.yaml: expected a calibration of at most"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(CalibrationFile, EveryTruncationAndEveryDamagedByteEndsInAResult) {
  std::mt19937 generator(6);
  std::uniform_int_distribution<int> any_byte(0, 255);
  for (const std::string whole : {kYaml, kJson}) {
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const Expected<CameraModel> cut = parse_calibration(std::string_view(whole).substr(0, length), "cam");
      EXPECT_TRUE(cut || cut.error().message.starts_with("cam:"));
      std::string damaged = whole;
      damaged[length] = static_cast<char>(any_byte(generator));
      const Expected<CameraModel> read = parse_calibration(damaged, "cam");
      EXPECT_TRUE(read || read.error().message.starts_with("cam:"));
    }
  }
}

// Bit flips and cuts of what perimap has written: none is taken for whole, unless it says the same still, as with a
// changed word in the line that has the sum.
TEST(CalibrationFile, DamagedOnesThatPerimapHasWrittenAreNeverTakenForOthers) {
  const auto camera = parse_calibration(kYaml, "cam");
  ASSERT_TRUE(camera);
  const std::string whole = sealed_calibration(*camera, "calibration_time: \"2026-11-28 10:00 UTC\"\n");
  ASSERT_TRUE(parse_calibration(whole, "cam"));
  test::Damage damage;
  for (int trial = 0; trial < test::Damage::kCopies; ++trial) {
    const std::string damaged = damage.copy_of(whole);
    const auto read = parse_calibration(damaged, "cam");
    if (!read) continue;
    EXPECT_EQ(format_calibration(*read), format_calibration(*camera)) << damaged;
    EXPECT_EQ(damaged.size(), whole.size()) << "a cut is refused";
  }
  EXPECT_THAT(error_of(with(whole, "image_width: ", "image_width: 1")), HasSubstr("it is not as it was written"));
  const std::string by_hand = with(with(whole, "image_width: ", "image_width: 1"), "perimap-crc32", "changed");
  EXPECT_TRUE(parse_calibration(by_hand, "cam")) << "without the sum it is anybody's";
}

// As OpenCV's own calibration program writes a fisheye: without a model's name.
std::string fisheye_of_opencv(std::string_view flag) {
  return with(with(with(kYaml, "rows: 5", "rows: 4"), "-2.0e-3, 0.01 ]", "-2.0e-3 ]"), "avg_reprojection_error: 0.2",
              flag);
}

TEST(FisheyeModel, OfOpenCVsOwnProgramIsRead) {
  const auto fisheye = parse_calibration(fisheye_of_opencv("fisheye_model: 1"), "cam");
  ASSERT_TRUE(fisheye) << fisheye.error().message;
  EXPECT_EQ(fisheye->lens, Lens::kKannalaBrandt);
  EXPECT_EQ(fisheye->k4, -2.0e-3);
  const auto other = parse_calibration(with(kYaml, "avg_reprojection_error: 0.2", "fisheye_model: 0"), "cam");
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(other->lens, Lens::kBrownConrady);
}

TEST(FisheyeModel, IsRefusedWhenItIsNoFlagOrContradictsTheName) {
  EXPECT_THAT(error_of(fisheye_of_opencv("fisheye_model: 2")),
              HasSubstr("key 'fisheye_model': expected 0 or 1, got 2"));
  EXPECT_THAT(error_of(fisheye_of_opencv("fisheye_model: 1\ndistortion_model: plumb_bob")),
              HasSubstr("key 'distortion_model'"));
}

TEST(CalibrationFile, OnesThatWereMisreadOnceAreReadOrRefused) {
  const std::string folder = PERIMAP_TEST_DATA "/refused_once/";
  const auto fisheye = read_calibration(folder + "k_fisheye_tutorial.yaml");
  ASSERT_TRUE(fisheye) << fisheye.error().message;
  EXPECT_EQ(fisheye->lens, Lens::kKannalaBrandt);
  EXPECT_EQ(fisheye->k4, -0.0185);
  const auto twice = read_calibration(folder + "k_dup.yaml");
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message, HasSubstr("key 'distortion_coefficients': expected one value, got two"));
}

TEST(CalibrationKeys, AreRefusedWhenThereTwice) {
  const std::string again = "avg_reprojection_error: 0.2\nimage_width: 320";
  EXPECT_EQ(error_of(with(kYaml, "avg_reprojection_error: 0.2", again)),
            "cam.yaml: key 'image_width': expected one value, got two: it is there twice");
}

}  // namespace
}  // namespace perimap

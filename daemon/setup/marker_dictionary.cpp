#include "daemon/setup/marker_dictionary.hpp"

#include <fmt/format.h>

#include <array>
#include <opencv2/aruco.hpp>

namespace perimap {
namespace {

constexpr std::array<MarkerDictionary, 21> kDictionaries{{
    {"4X4_50", cv::aruco::DICT_4X4_50},
    {"4X4_100", cv::aruco::DICT_4X4_100},
    {"4X4_250", cv::aruco::DICT_4X4_250},
    {"4X4_1000", cv::aruco::DICT_4X4_1000},
    {"5X5_50", cv::aruco::DICT_5X5_50},
    {"5X5_100", cv::aruco::DICT_5X5_100},
    {"5X5_250", cv::aruco::DICT_5X5_250},
    {"5X5_1000", cv::aruco::DICT_5X5_1000},
    {"6X6_50", cv::aruco::DICT_6X6_50},
    {"6X6_100", cv::aruco::DICT_6X6_100},
    {"6X6_250", cv::aruco::DICT_6X6_250},
    {"6X6_1000", cv::aruco::DICT_6X6_1000},
    {"7X7_50", cv::aruco::DICT_7X7_50},
    {"7X7_100", cv::aruco::DICT_7X7_100},
    {"7X7_250", cv::aruco::DICT_7X7_250},
    {"7X7_1000", cv::aruco::DICT_7X7_1000},
    {"ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
}};

}  // namespace

const char* dictionary_name(int id) {
  for (const MarkerDictionary& dictionary : kDictionaries) {
    if (dictionary.id == id) return dictionary.name;
  }
  return "?";
}

std::span<const MarkerDictionary> marker_dictionaries() noexcept { return kDictionaries; }

Expected<int> dictionary_named(const std::string& name) {
  std::string names;
  for (const MarkerDictionary& dictionary : kDictionaries) {
    if (name == dictionary.name) return dictionary.id;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", dictionary.name);
  }
  return fail(fmt::format("--dictionary: '{}' is not one of {}", name, names));
}

}  // namespace perimap

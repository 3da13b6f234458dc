#include "drivers/calibration/calibration_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "core/error/one_line.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/text_file/text_seal.hpp"

namespace perimap {
namespace {

constexpr std::string_view kHead = "%YAML:1.0\n---\n";
constexpr std::size_t kLargestFile = std::size_t{1} << 20;
constexpr int kLargestImage = 16384;         // px a side
constexpr double kLargestFocalLength = 1e6;  // px

struct Shape {
  int rows;
  int columns;
};

class Calibration {
 public:
  Calibration(const YAML::Node& root, std::string_view name) : root_(root), name_(name) {}

  Expected<CameraModel> camera() const {
    if (const auto once = each_key_once(); !once) {
      return tl::unexpected(once.error());
    }
    CameraModel camera;
    auto size = image_side("image_width").and_then([&](int width) {
      camera.width = width;
      return image_side("image_height");
    });
    if (!size) {
      return tl::unexpected(size.error());
    }
    camera.height = *size;

    constexpr Shape kMatrix[] = {{3, 3}};
    const Expected<std::vector<double>> matrix = numbers("camera_matrix", "a 3x3 matrix of numbers", kMatrix);
    if (!matrix) {
      return tl::unexpected(matrix.error());
    }
    const std::vector<double>& K = *matrix;
    camera.fx = K[0];
    camera.cx = K[2];
    camera.fy = K[4];
    camera.cy = K[5];
    if (K[1] != 0 || K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1) {
      return refuse("camera_matrix", "[fx 0 cx; 0 fy cy; 0 0 1]", "another form");
    }
    if (!(camera.fx > 0 && camera.fx <= kLargestFocalLength && camera.fy > 0 && camera.fy <= kLargestFocalLength)) {
      return refuse("camera_matrix", fmt::format("focal lengths above 0 and at most {} px", kLargestFocalLength),
                    fmt::format("{} and {}", camera.fx, camera.fy));
    }

    const Expected<Lens> lens = lens_of("distortion_model", "fisheye_model");
    if (!lens) {
      return tl::unexpected(lens.error());
    }
    camera.lens = *lens;
    return camera.lens == Lens::kKannalaBrandt ? with_fisheye_distortion(camera) : with_distortion(camera);
  }

 private:
  Expected<CameraModel> with_distortion(CameraModel camera) const {
    constexpr Shape kDistortion[] = {{1, 4}, {4, 1},  {1, 5},  {5, 1},  {1, 8},
                                     {8, 1}, {1, 12}, {12, 1}, {1, 14}, {14, 1}};
    const Expected<std::vector<double>> distortion =
        numbers("distortion_coefficients", "4, 5, 8, 12 or 14 numbers in a row or column", kDistortion);
    if (!distortion) {
      return tl::unexpected(distortion.error());
    }
    const std::vector<double>& d = *distortion;
    for (std::size_t i = 5; i < d.size(); ++i) {
      if (d[i] != 0) {
        return refuse("distortion_coefficients", "k1 k2 p1 p2 k3 and zeros (Brown-Conrady)",
                      fmt::format("{} as number {}", d[i], i + 1));
      }
    }
    camera.k1 = d[0];
    camera.k2 = d[1];
    camera.p1 = d[2];
    camera.p2 = d[3];
    camera.k3 = d.size() > 4 ? d[4] : 0.0;
    return camera;
  }

  Expected<CameraModel> with_fisheye_distortion(CameraModel camera) const {
    constexpr Shape kDistortion[] = {{1, 4}, {4, 1}};
    const Expected<std::vector<double>> distortion =
        numbers("distortion_coefficients", "4 numbers in a row or column (k1 k2 k3 k4 of a fisheye)", kDistortion);
    if (!distortion) {
      return tl::unexpected(distortion.error());
    }
    camera.k1 = (*distortion)[0];
    camera.k2 = (*distortion)[1];
    camera.k3 = (*distortion)[2];
    camera.k4 = (*distortion)[3];
    return camera;
  }

  // Of two values of one key nobody knows which is meant.
  Expected<void> each_key_once() const {
    std::vector<std::string> keys;
    for (const auto& entry : root_) {
      if (!entry.first.IsScalar()) continue;
      const std::string& key = entry.first.Scalar();
      if (std::find(keys.begin(), keys.end(), key) != keys.end()) {
        return refuse(key, "one value", "two: it is there twice");
      }
      keys.push_back(key);
    }
    return {};
  }

  // Calibrators that name the model use the names of ROS (sensor_msgs/distortion_models.h); OpenCV's own program writes
  // a fisheye_model of 1 or 0 (samples/cpp/.../camera_calibration.cpp), and its other files say nothing.
  Expected<Lens> lens_of(const char* name_key, const char* flag_key) const {
    std::optional<Lens> flagged;
    if (const YAML::Node node = root_[flag_key]; node.IsDefined()) {
      int flag = 0;
      if (!node.IsScalar() || !YAML::convert<int>::decode(node, flag) || flag < 0 || flag > 1) {
        return refuse(flag_key, "0 or 1", node.IsScalar() ? node.Scalar() : "something else");
      }
      flagged = flag == 1 ? Lens::kKannalaBrandt : Lens::kBrownConrady;
    }
    const YAML::Node node = root_[name_key];
    if (!node.IsDefined()) {
      return flagged.value_or(Lens::kBrownConrady);
    }
    const std::string name = node.IsScalar() ? node.Scalar() : "something else";
    std::optional<Lens> named;
    if (name == "plumb_bob" || name == "rational_polynomial") {
      named = Lens::kBrownConrady;
    }
    if (name == "equidistant" || name == "fisheye") {
      named = Lens::kKannalaBrandt;
    }
    if (!named) {
      return refuse(name_key, "plumb_bob, rational_polynomial, equidistant or fisheye", name);
    }
    if (flagged && *flagged != *named) {
      return refuse(name_key, fmt::format("the same lens as key '{}' has", flag_key), name);
    }
    return *named;
  }

  tl::unexpected<Error> refuse(std::string_view key, std::string_view expected, std::string_view got) const {
    return fail(on_one_line(fmt::format("{}: key '{}': expected {}, got {}", name_, key, expected, got)));
  }

  Expected<int> image_side(const char* key) const {
    const YAML::Node node = root_[key];
    const std::string expected = fmt::format("an integer from 1 to {}", kLargestImage);
    int side = 0;
    if (!node.IsDefined() || !node.IsScalar() || !YAML::convert<int>::decode(node, side)) {
      return refuse(key, expected, node.IsDefined() ? "something else" : "nothing");
    }
    if (side < 1 || side > kLargestImage) {
      return refuse(key, expected, fmt::format("{}", side));
    }
    return side;
  }

  // The elements of a matrix of one of the shapes, row by row.
  Expected<std::vector<double>> numbers(const char* key, const char* expected, std::span<const Shape> shapes) const {
    const YAML::Node node = root_[key];
    if (!node.IsDefined()) {
      return refuse(key, expected, "nothing");
    }
    const auto part = [&node](const char* name) { return node.IsMap() ? node[name] : YAML::Node(); };
    const YAML::Node rows_node = part("rows");
    const YAML::Node columns_node = part("cols");
    const YAML::Node data = part("data");
    int rows = 0;
    int columns = 0;
    if (!rows_node.IsDefined() || !columns_node.IsDefined() || !data.IsDefined() || !data.IsSequence() ||
        !YAML::convert<int>::decode(rows_node, rows) || !YAML::convert<int>::decode(columns_node, columns)) {
      return refuse(key, expected, "something else than rows, cols and data");
    }
    const bool known = std::any_of(shapes.begin(), shapes.end(), [&](const Shape& shape) {
      return shape.rows == rows && shape.columns == columns &&
             static_cast<std::size_t>(shape.rows * shape.columns) == data.size();
    });
    if (!known) {
      return refuse(key, expected, fmt::format("{} rows, {} columns and {} numbers", rows, columns, data.size()));
    }
    std::vector<double> values;
    for (const YAML::Node& element : data) {
      double value = 0;
      if (!YAML::convert<double>::decode(element, value) || !std::isfinite(value)) {
        return refuse(key, expected, "an element that is no finite number");
      }
      values.push_back(value);
    }
    return values;
  }

  const YAML::Node& root_;
  std::string_view name_;
};

}  // namespace

Expected<CameraModel> parse_calibration(std::string_view text, std::string_view name) {
  if (text.size() > kLargestFile) {
    return fail(on_one_line(
        fmt::format("{}: expected a calibration of at most {} bytes, got {}", name, kLargestFile, text.size())));
  }
  if (const auto whole = check_seal(text); !whole) {
    return fail(on_one_line(fmt::format("{}: {}", name, whole.error().message)));
  }
  // yaml-cpp reports what it cannot read by exceptions.
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap()) {
      return fail(on_one_line(fmt::format("{}: expected the keys of an OpenCV calibration, got none", name)));
    }
    return Calibration(root, name).camera();
  } catch (const YAML::Exception& exception) {
    return fail(on_one_line(fmt::format("{}:{}:{}: expected an OpenCV calibration as YAML or JSON, got: {}", name,
                                        exception.mark.line + 1, exception.mark.column + 1, exception.msg)));
  } catch (const std::exception& exception) {
    return fail(on_one_line(
        fmt::format("{}: expected an OpenCV calibration as YAML or JSON, got: {}", name, exception.what())));
  }
}

Expected<CameraModel> read_calibration(const std::filesystem::path& file) {
  const Expected<std::string> text = read_text_file(file, kLargestFile, "calibration file");
  if (!text) return tl::unexpected(text.error());
  return parse_calibration(*text, file.string());
}

std::string sealed_calibration(const CameraModel& camera, std::string_view more) {
  const std::string text = format_calibration(camera);
  return sealed_text(kHead, text.substr(kHead.size()) + std::string(more));
}

std::string format_calibration(const CameraModel& camera) {
  // The layout of cv::FileStorage, so that OpenCV's own tools read it.
  const auto matrix = [](std::string_view key, int rows, int columns, std::initializer_list<double> values) {
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", key, rows, columns,
                       fmt::join(values, ", "));
  };
  const bool fisheye = camera.lens == Lens::kKannalaBrandt;
  return fmt::format("{}image_width: {}\nimage_height: {}\ndistortion_model: {}\n", kHead, camera.width, camera.height,
                     fisheye ? "equidistant" : "plumb_bob") +
         matrix("camera_matrix", 3, 3, {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1}) +
         (fisheye ? matrix("distortion_coefficients", 1, 4, {camera.k1, camera.k2, camera.k3, camera.k4})
                  : matrix("distortion_coefficients", 1, 5, {camera.k1, camera.k2, camera.p1, camera.p2, camera.k3}));
}

Expected<void> write_calibration(const std::filesystem::path& file, const CameraModel& camera) {
  return write_text_file(file, sealed_calibration(camera));
}

}  // namespace perimap

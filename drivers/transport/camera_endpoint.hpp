// Where a camera is, as a user writes it.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "core/error/expected.hpp"

namespace perimap {

struct V4l2Endpoint {
  std::string path;
  bool operator==(const V4l2Endpoint&) const = default;
};
struct VideoEndpoint {
  std::string file;
  bool operator==(const VideoEndpoint&) const = default;
};
using CameraEndpoint = std::variant<V4l2Endpoint, VideoEndpoint>;

// "v4l2:/dev/video0" (any absolute path, such as the stable names under /dev/v4l/by-id), "video:FILE".
[[nodiscard]] Expected<CameraEndpoint> parse_camera_endpoint(std::string_view text);
[[nodiscard]] std::string format_camera_endpoint(const CameraEndpoint& endpoint);

}  // namespace perimap

#include "drivers/transport/camera_endpoint.hpp"

#include <fmt/format.h>

#include "core/error/one_line.hpp"

namespace perimap {
namespace {

constexpr std::string_view kV4l2 = "v4l2:";
constexpr std::string_view kVideo = "video:";

}  // namespace

Expected<CameraEndpoint> parse_camera_endpoint(std::string_view text) {
  // A NUL would end the name early when the file is opened.
  if (text.find('\0') == std::string_view::npos) {
    if (text.starts_with(kV4l2) && text.substr(kV4l2.size()).starts_with('/')) {
      return V4l2Endpoint{std::string(text.substr(kV4l2.size()))};
    }
    if (text.starts_with(kVideo) && text.size() > kVideo.size()) {
      return VideoEndpoint{std::string(text.substr(kVideo.size()))};
    }
  }
  return fail(on_one_line(fmt::format("expected v4l2:/dev/videoN or video:FILE, got '{}'", text)));
}

std::string format_camera_endpoint(const CameraEndpoint& endpoint) {
  if (const auto* v4l2 = std::get_if<V4l2Endpoint>(&endpoint)) return fmt::format("{}{}", kV4l2, v4l2->path);
  return fmt::format("{}{}", kVideo, std::get<VideoEndpoint>(endpoint).file);
}

}  // namespace perimap

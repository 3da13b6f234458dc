// One opening of a V4L2 video output, whose frames come out of a capture node: v4l2loopback's, vivid's loop, a card's
// cable.
//
// Linux Media Infrastructure userspace API, Part I: video output interface, streaming I/O (memory mapping).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"
#include "drivers/camera/v4l2_node.hpp"
#include "drivers/image/pixel_format.hpp"

namespace perimap {

class VideoOutput {
 public:
  // Grey where the output takes it, otherwise YUYV without colour. Fails when the node is no output, or takes neither
  // or another size. `path` is for errors.
  [[nodiscard]] static Expected<std::unique_ptr<VideoOutput>> open(std::unique_ptr<V4l2Node> node,
                                                                   const std::string& path, int width, int height);
  VideoOutput(const VideoOutput&) = delete;
  VideoOutput& operator=(const VideoOutput&) = delete;
  ~VideoOutput();

  // The first `part` (0 to 1) of the image's bytes as a frame stamped so. False when the output has not shown the
  // frames before it yet: this one is left out.
  [[nodiscard]] Expected<bool> show(const GreyImage& image, Instant stamp, double part = 1.0);

  [[nodiscard]] PixelFormat format() const noexcept { return format_; }

 private:
  VideoOutput(std::unique_ptr<V4l2Node> node, std::string path) : node_(std::move(node)), path_(std::move(path)) {}

  [[nodiscard]] Expected<void> settle(int width, int height);
  [[nodiscard]] Expected<void> map_buffers();
  [[nodiscard]] Expected<void> take_back_shown();
  void draw(const GreyImage& image, std::span<std::byte> out) const noexcept;
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& what) const;
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& what, int error) const;

  std::unique_ptr<V4l2Node> node_;
  std::string path_;
  PixelFormat format_ = PixelFormat::kGrey;
  int width_ = 0;
  int height_ = 0;
  std::size_t stride_ = 0;
  std::vector<std::span<std::byte>> buffers_;
  std::vector<std::uint32_t> free_;  // ours; the others are the driver's
  bool streaming_ = false;
};

}  // namespace perimap

#include "drivers/standins/emulator/video_output.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

namespace perimap {
namespace {

constexpr std::uint32_t kBuffers = 4;

v4l2_buffer output_buffer(std::uint32_t index) noexcept {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

// NOLINTBEGIN(cppcoreguidelines-pro-type-union-access): the kernel's own types

Expected<std::unique_ptr<VideoOutput>> VideoOutput::open(std::unique_ptr<V4l2Node> node, const std::string& path,
                                                         int width, int height) {
  std::unique_ptr<VideoOutput> output(new VideoOutput(std::move(node), path));
  if (auto settled = output->settle(width, height); !settled) return tl::unexpected(std::move(settled.error()));
  if (auto mapped = output->map_buffers(); !mapped) return tl::unexpected(std::move(mapped.error()));
  return output;
}

VideoOutput::~VideoOutput() {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    (void)node_->control(VIDIOC_STREAMOFF, &type);
  }
  for (const auto& buffer : buffers_) node_->unmap(buffer);
}

tl::unexpected<Error> VideoOutput::refuse(const std::string& what) const {
  return fail(fmt::format("{}: {}", path_, what));
}

tl::unexpected<Error> VideoOutput::refuse(const std::string& what, int error) const {
  if (error == ENODEV) return refuse("the device has gone");
  if (error == EBUSY) return refuse("in use by another program");
  return refuse(fmt::format("{}: {}", what, std::generic_category().message(error)));
}

Expected<void> VideoOutput::settle(int width, int height) {
  v4l2_capability capability{};
  if (node_->control(VIDIOC_QUERYCAP, &capability) != 0) return refuse("not a video device");
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_OUTPUT) == 0) return refuse("not a video output; v4l2loopback makes one");
  if ((can & V4L2_CAP_STREAMING) == 0) return refuse("cannot stream");
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  if (const int error = node_->control(VIDIOC_G_FMT, &format); error != 0) return refuse("has no format", error);
  constexpr std::array<std::pair<std::uint32_t, PixelFormat>, 2> kFormats{
      {{V4L2_PIX_FMT_GREY, PixelFormat::kGrey}, {V4L2_PIX_FMT_YUYV, PixelFormat::kYuyv}}};
  for (const auto& [fourcc, pixels] : kFormats) {
    v4l2_format given = format;
    v4l2_pix_format& pix = given.fmt.pix;
    pix.pixelformat = fourcc;
    pix.width = static_cast<std::uint32_t>(width);
    pix.height = static_cast<std::uint32_t>(height);
    pix.field = V4L2_FIELD_NONE;
    pix.bytesperline = 0;
    pix.sizeimage = 0;
    const int error = node_->control(VIDIOC_S_FMT, &given);
    if (error == EBUSY || error == ENODEV) return refuse("", error);
    // The driver puts what it can do in place of what it cannot.
    if (error != 0 || pix.pixelformat != fourcc) continue;
    if (pix.width != static_cast<std::uint32_t>(width) || pix.height != static_cast<std::uint32_t>(height)) {
      return refuse(fmt::format("takes {}x{} instead of the frames' {}x{}", pix.width, pix.height, width, height));
    }
    format_ = pixels;
    width_ = width;
    height_ = height;
    stride_ = std::max<std::size_t>(pix.bytesperline, row_bytes(pixels, width));
    return {};
  }
  return refuse("takes neither GREY nor YUYV");
}

Expected<void> VideoOutput::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = node_->control(VIDIOC_REQBUFS, &request); error != 0) {
    return refuse("gives no buffers", error);
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = output_buffer(i);
    if (const int error = node_->control(VIDIOC_QUERYBUF, &buffer); error != 0) {
      return refuse("does not show its buffers", error);
    }
    const std::span<std::byte> memory = node_->map(buffer.length, buffer.m.offset);
    if (memory.empty()) return refuse("does not share its buffers");
    buffers_.push_back(memory);
    if (memory.size() < picture_bytes(format_, height_, stride_)) return refuse("its buffers are too small");
    free_.push_back(i);
  }
  return {};
}

Expected<void> VideoOutput::take_back_shown() {
  for (;;) {
    v4l2_buffer shown = output_buffer(0);
    const int error = node_->control(VIDIOC_DQBUF, &shown);
    if (error == EAGAIN) return {};
    if (error != 0) return refuse("does not give a buffer back", error);
    if (shown.index >= buffers_.size()) return refuse("gives a buffer back that there is none of");
    free_.push_back(shown.index);
  }
}

void VideoOutput::draw(const GreyImage& image, std::span<std::byte> out) const noexcept {
  constexpr std::byte kNoColour{128};
  for (int y = 0; y < height_; ++y) {
    std::byte* const to = out.data() + static_cast<std::size_t>(y) * stride_;
    const std::uint8_t* const from = image.row(y);
    if (format_ == PixelFormat::kGrey) {
      std::memcpy(to, from, static_cast<std::size_t>(width_));
      continue;
    }
    for (int x = 0; x < width_; ++x) {
      to[2 * x] = std::byte{from[x]};
      to[2 * x + 1] = kNoColour;
    }
  }
}

Expected<bool> VideoOutput::show(const GreyImage& image, Instant stamp, double part) {
  if (image.width != width_ || image.height != height_) {
    return refuse(fmt::format("a frame of {}x{} after {}x{}", image.width, image.height, width_, height_));
  }
  if (streaming_) {
    if (auto taken = take_back_shown(); !taken) return tl::unexpected(std::move(taken.error()));
  }
  if (free_.empty()) return false;
  const std::uint32_t index = free_.back();
  draw(image, buffers_[index]);
  v4l2_buffer buffer = output_buffer(index);
  const double bytes = part * static_cast<double>(picture_bytes(format_, height_, stride_));
  buffer.bytesused = static_cast<std::uint32_t>(std::max(1.0, bytes));
  buffer.field = V4L2_FIELD_NONE;
  buffer.timestamp.tv_sec = to_ns(stamp) / 1'000'000'000;
  buffer.timestamp.tv_usec = to_ns(stamp) % 1'000'000'000 / 1000;
  if (const int error = node_->control(VIDIOC_QBUF, &buffer); error != 0) return refuse("takes no frame", error);
  free_.pop_back();
  if (streaming_) return true;
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  if (const int error = node_->control(VIDIOC_STREAMON, &type); error != 0) return refuse("does not start", error);
  streaming_ = true;
  return true;
}

// NOLINTEND(cppcoreguidelines-pro-type-union-access)

}  // namespace perimap

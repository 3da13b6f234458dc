#include "drivers/camera/v4l2_stream.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <system_error>
#include <utility>

namespace perimap {
namespace {

constexpr std::uint32_t kBuffers = 8;  // a sixth of a second at 50 frames/s
constexpr Duration kOldestStamp = std::chrono::seconds(2);
constexpr double kNearRate = 0.01;  // a rate this near to the one asked for is that one

struct KnownFormat {
  std::uint32_t fourcc;
  PixelFormat format;
};
// In order of preference: raw formats with colour, by which instruments are told, then grey, then what has to be
// decoded; among alike ones what needs less work first.
constexpr std::array<KnownFormat, 6> kFormats{{{V4L2_PIX_FMT_NV12, PixelFormat::kNv12},
                                               {V4L2_PIX_FMT_YUYV, PixelFormat::kYuyv},
                                               {V4L2_PIX_FMT_UYVY, PixelFormat::kUyvy},
                                               {V4L2_PIX_FMT_GREY, PixelFormat::kGrey},
                                               {V4L2_PIX_FMT_MJPEG, PixelFormat::kMjpg},
                                               {V4L2_PIX_FMT_JPEG, PixelFormat::kMjpg}}};

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>((fourcc >> (8 * i)) & 0x7FU);
    text += c >= ' ' ? c : '?';
  }
  return text;
}

// The kernel's texts are arrays that need not end with a zero.
template <std::size_t N>
std::string text_of(const __u8 (&text)[N]) {
  const auto* begin = reinterpret_cast<const char*>(text);
  return {begin, std::find(begin, begin + N, '\0')};
}

v4l2_buffer mapped_buffer(std::uint32_t index) noexcept {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

// NOLINTBEGIN(cppcoreguidelines-pro-type-union-access): the kernel's own types

Expected<std::unique_ptr<V4l2Stream>> V4l2Stream::open(std::unique_ptr<V4l2Node> node, const V4l2Settings& settings) {
  std::unique_ptr<V4l2Stream> stream(new V4l2Stream(std::move(node), settings));
  if (auto settled = stream->settle(); !settled) return tl::unexpected(std::move(settled.error()));
  if (auto started = stream->start(); !started) return tl::unexpected(std::move(started.error()));
  return stream;
}

V4l2Stream::V4l2Stream(std::unique_ptr<V4l2Node> node, const V4l2Settings& settings)
    : node_(std::move(node)), settings_(settings) {}

V4l2Stream::~V4l2Stream() {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    (void)node_->control(VIDIOC_STREAMOFF, &type);
  }
  for (const auto& buffer : buffers_) node_->unmap(buffer);
}

tl::unexpected<Error> V4l2Stream::refuse(const std::string& what) const {
  return fail(fmt::format("{}: {}", settings_.path, what));
}

tl::unexpected<Error> V4l2Stream::refuse(const std::string& what, int error) const {
  if (error == ENODEV) return refuse("the device has gone");
  if (error == EBUSY) return refuse("in use by another program");
  return refuse(fmt::format("{}: {}", what, std::generic_category().message(error)));
}

Expected<void> V4l2Stream::settle() {
  v4l2_capability capability{};
  if (const int error = node_->control(VIDIOC_QUERYCAP, &capability); error != 0) {
    return error == ENODEV ? refuse("", error) : refuse("not a video device");
  }
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return refuse((can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                      ? "captures in several planes, which perimap does not"
                      : "not a camera; a camera has several nodes, try the next");
  }
  if ((can & V4L2_CAP_STREAMING) == 0) return refuse("cannot stream");
  auto settled = settle_input()
                     .and_then([this] { return settle_format(); })
                     .and_then([this] { return settle_rate(); })
                     .and_then([this] { return settle_controls(); });
  if (!settled) return settled;
  const std::string rate = period_ > Duration(0) ? fmt::format(" at {:.2f} Hz", 1.0 / to_seconds(period_)) : "";
  const std::string exposure =
      exposure_known_ ? fmt::format("exposure {:.1f} ms", to_seconds(exposure_) * 1e3) : "exposure not known";
  identity_ = fmt::format("{} ({}), {} {}x{}{}, {}", text_of(capability.card), text_of(capability.driver),
                          pixel_format_name(frame_.format), frame_.width, frame_.height, rate, exposure);
  return {};
}

Expected<void> V4l2Stream::settle_input() {
  if (settings_.input >= 0) {
    int input = settings_.input;
    if (const int error = node_->control(VIDIOC_S_INPUT, &input); error != 0) {
      return refuse(fmt::format("has no input {}", settings_.input), error);
    }
  }
  // Cards with a digital video input take what comes only once its timings are set; others do not know these calls.
  v4l2_dv_timings timings{};
  switch (const int error = node_->control(VIDIOC_QUERY_DV_TIMINGS, &timings); error) {
    case 0:
      break;
    case ENOLINK:
      return refuse("no signal at its input; is the source on and the cable in?");
    case ENOLCK:
      return refuse("the signal at its input is not stable");
    case ERANGE:
      return refuse("the signal at its input is one that it cannot take");
    default:
      return {};
  }
  if (timings.bt.interlaced != V4L2_DV_PROGRESSIVE) return refuse("the signal at its input is interlaced");
  if (const int error = node_->control(VIDIOC_S_DV_TIMINGS, &timings); error != 0) {
    return refuse("cannot take the timings of its input's signal", error);
  }
  const double pixels = static_cast<double>(V4L2_DV_BT_FRAME_WIDTH(&timings.bt)) *
                        static_cast<double>(V4L2_DV_BT_FRAME_HEIGHT(&timings.bt));
  if (timings.bt.pixelclock > 0) period_ = from_seconds(pixels / static_cast<double>(timings.bt.pixelclock));
  // Without it a change of the signal shows as silence.
  v4l2_event_subscription change{};
  change.type = V4L2_EVENT_SOURCE_CHANGE;
  (void)node_->control(VIDIOC_SUBSCRIBE_EVENT, &change);
  return {};
}

std::string V4l2Stream::offered_formats() {
  std::string all;
  for (std::uint32_t i = 0; i < 32; ++i) {
    v4l2_fmtdesc offered{};
    offered.index = i;
    offered.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (node_->control(VIDIOC_ENUM_FMT, &offered) != 0) break;
    all += fmt::format("{}{}", all.empty() ? "" : ", ", fourcc_text(offered.pixelformat));
  }
  return all.empty() ? "nothing" : all;
}

std::string V4l2Stream::offered_sizes(std::uint32_t fourcc) {
  std::string all;
  for (std::uint32_t i = 0; i < 32; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (node_->control(VIDIOC_ENUM_FRAMESIZES, &size) != 0 || size.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
    all += fmt::format("{}{}x{}", all.empty() ? "; it has " : ", ", size.discrete.width, size.discrete.height);
  }
  return all;
}

double V4l2Stream::fastest_hz(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) {
  double fastest = 0.0;
  for (std::uint32_t i = 0; i < 64; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = fourcc;
    interval.width = width;
    interval.height = height;
    if (node_->control(VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) break;
    const bool discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract& shortest = discrete ? interval.discrete : interval.stepwise.min;
    if (shortest.numerator > 0) {
      fastest = std::max(fastest, static_cast<double>(shortest.denominator) / shortest.numerator);
    }
    if (!discrete) break;
  }
  return fastest;
}

Expected<void> V4l2Stream::settle_format() {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = node_->control(VIDIOC_G_FMT, &format); error != 0) return refuse("has no format", error);
  const bool sized = settings_.width > 0 && settings_.height > 0;
  const std::uint32_t width = sized ? static_cast<std::uint32_t>(settings_.width) : format.fmt.pix.width;
  const std::uint32_t height = sized ? static_cast<std::uint32_t>(settings_.height) : format.fmt.pix.height;
  // Over USB the plain formats of large pictures are often much slower than JPEG. Where the format is free the first
  // one is taken that is as fast as asked, or about as fast as the fastest.
  std::array<double, kFormats.size()> formats_hz{};
  double enough_hz = 0.0;
  if (!settings_.format) {
    constexpr double kAboutAsFast = 0.9;
    for (std::size_t i = 0; i < kFormats.size(); ++i) formats_hz[i] = fastest_hz(kFormats[i].fourcc, width, height);
    const double fastest = *std::max_element(formats_hz.begin(), formats_hz.end());
    const double asked_hz = (1 - kNearRate) * settings_.frame_rate_hz;
    enough_hz = asked_hz > 0.0 && fastest >= asked_hz ? asked_hz : kAboutAsFast * fastest;
  }
  // The driver puts what it can do in place of what it cannot. So each format is asked for, and the answer read.
  std::optional<v4l2_pix_format> right_format;
  for (std::size_t i = 0; i < kFormats.size(); ++i) {
    const KnownFormat& wanted = kFormats[i];
    const bool is_too_slow = formats_hz[i] > 0.0 && formats_hz[i] < enough_hz;
    if ((settings_.format && *settings_.format != wanted.format) || is_too_slow) continue;
    v4l2_format given = format;
    given.fmt.pix.pixelformat = wanted.fourcc;
    given.fmt.pix.width = width;
    given.fmt.pix.height = height;
    given.fmt.pix.field = V4L2_FIELD_NONE;
    given.fmt.pix.bytesperline = 0;
    given.fmt.pix.sizeimage = 0;
    const int error = node_->control(VIDIOC_S_FMT, &given);
    if (error == EBUSY || error == ENODEV) return refuse("", error);
    if (error != 0 || given.fmt.pix.pixelformat != wanted.fourcc) continue;
    right_format = given.fmt.pix;
    frame_.format = wanted.format;
    if (given.fmt.pix.width == width && given.fmt.pix.height == height) break;
  }
  if (!right_format) {
    return refuse(fmt::format("does not give {}; it offers {}",
                              settings_.format ? pixel_format_name(*settings_.format) : "any format perimap takes",
                              offered_formats()));
  }
  const v4l2_pix_format& pix = *right_format;
  if (pix.width != width || pix.height != height) {
    return refuse(fmt::format("gives {}x{} instead of {}x{}{}", pix.width, pix.height, width, height,
                              offered_sizes(pix.pixelformat)));
  }
  if (pix.field != V4L2_FIELD_NONE) return refuse("gives interlaced frames");
  constexpr std::uint32_t kLargestSide = 16384;
  if (width == 0 || height == 0 || width > kLargestSide || height > kLargestSide) {
    return refuse(fmt::format("gives {}x{} pixels", width, height));
  }
  frame_.width = static_cast<int>(width);
  frame_.height = static_cast<int>(height);
  if (frame_.format != PixelFormat::kMjpg) {
    frame_.stride = pix.bytesperline;
    needed_bytes_ = picture_bytes(frame_.format, frame_.height, frame_.stride);
    if (frame_.stride < row_bytes(frame_.format, frame_.width)) {
      return refuse(fmt::format("its driver gives {} bytes a row for {} pixels", pix.bytesperline, width));
    }
  }
  return {};
}

Expected<void> V4l2Stream::settle_rate() {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  const int error = node_->control(VIDIOC_G_PARM, &parameters);
  const bool settable = error == 0 && (parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0;
  if (settings_.frame_rate_hz > 0.0) {
    if (!settable) return refuse("its frame rate cannot be set; leave camera.frame_rate_hz out");
    v4l2_fract& wanted = parameters.parm.capture.timeperframe;
    constexpr std::uint32_t kUnits = 1000;
    wanted = {kUnits, static_cast<std::uint32_t>(std::lround(settings_.frame_rate_hz * kUnits))};
    if (const int refused = node_->control(VIDIOC_S_PARM, &parameters); refused != 0) {
      return refuse(fmt::format("refuses {} frames/s", settings_.frame_rate_hz), refused);
    }
    // What it took is the nearest that it can.
    const double given_hz = wanted.numerator > 0 ? static_cast<double>(wanted.denominator) / wanted.numerator : 0.0;
    if (std::abs(given_hz - settings_.frame_rate_hz) > kNearRate * settings_.frame_rate_hz) {
      return refuse(fmt::format("gives {:.3g} frames/s instead of {:.3g}; at this size and format it may have no other",
                                given_hz, settings_.frame_rate_hz));
    }
  }
  const v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (settable && period.numerator > 0 && period.denominator > 0) {
    period_ = from_seconds(static_cast<double>(period.numerator) / period.denominator);
  }
  return {};
}

std::optional<std::int32_t> V4l2Stream::control(std::uint32_t id) {
  v4l2_control asked{};
  asked.id = id;
  return node_->control(VIDIOC_G_CTRL, &asked) == 0 ? std::optional(asked.value) : std::nullopt;
}

Expected<void> V4l2Stream::set_control(std::uint32_t id, std::int32_t value, const char* key) {
  v4l2_control wanted{};
  wanted.id = id;
  wanted.value = value;
  switch (const int error = node_->control(VIDIOC_S_CTRL, &wanted); error) {
    case 0:
      return {};
    case EINVAL:
    case ENOTTY:
      return refuse(fmt::format("has no control for it; leave {} out", key));
    case ERANGE:
      return refuse(fmt::format("{} is out of its range", key));
    default:
      return refuse(fmt::format("{} cannot be set", key), error);
  }
}

Expected<void> V4l2Stream::settle_controls() {
  if (settings_.exposure_ms > 0.0) {
    // Cameras without the automatic have no such control.
    v4l2_control manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL};
    (void)node_->control(VIDIOC_S_CTRL, &manual);
    constexpr double kUnits_per_ms = 10.0;  // of V4L2_CID_EXPOSURE_ABSOLUTE: 100 us
    const auto units = static_cast<std::int32_t>(std::max(1L, std::lround(settings_.exposure_ms * kUnits_per_ms)));
    if (auto set = set_control(V4L2_CID_EXPOSURE_ABSOLUTE, units, "camera.exposure_ms"); !set) return set;
  } else {
    // An automatic exposure must not stretch the frame's period.
    v4l2_control constant_rate{V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0};
    (void)node_->control(VIDIOC_S_CTRL, &constant_rate);
  }
  if (settings_.gain >= 0.0) {
    v4l2_control manual{V4L2_CID_AUTOGAIN, 0};
    (void)node_->control(VIDIOC_S_CTRL, &manual);
    const auto steps = static_cast<std::int32_t>(std::lround(settings_.gain));
    if (auto set = set_control(V4L2_CID_GAIN, steps, "camera.gain"); !set) return set;
  }
  // With the automatic on, this control holds what was set last, not what is used.
  const auto automatic = control(V4L2_CID_EXPOSURE_AUTO);
  const auto exposure = control(V4L2_CID_EXPOSURE_ABSOLUTE);
  exposure_known_ = exposure && (!automatic || *automatic == V4L2_EXPOSURE_MANUAL);
  if (exposure_known_) {
    constexpr Duration kUnit = std::chrono::microseconds(100);
    exposure_ = *exposure * kUnit;
    if (period_ > Duration(0)) exposure_ = std::min(exposure_, period_);
  }
  return {};
}

Expected<void> V4l2Stream::start() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = node_->control(VIDIOC_REQBUFS, &request); error != 0) {
    return refuse("gives no buffers", error);
  }
  if (request.count < 2) return refuse(fmt::format("gives {} buffers only", request.count));
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    if (const int error = node_->control(VIDIOC_QUERYBUF, &buffer); error != 0) {
      return refuse("does not show its buffers", error);
    }
    const std::span<std::byte> memory = node_->map(buffer.length, buffer.m.offset);
    if (memory.empty()) return refuse("does not share its buffers");
    buffers_.push_back(memory);
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    if (const int error = node_->control(VIDIOC_QBUF, &buffer); error != 0) return refuse("takes no buffer", error);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = node_->control(VIDIOC_STREAMON, &type); error != 0) {
    if (error == ENOSPC)
      return refuse("the USB bus has no bandwidth left for it; smaller frames, or a port of its own");
    if (error == ENOLINK) return refuse("no signal at its input; is the source on and the cable in?");
    return refuse("does not start", error);
  }
  streaming_ = true;
  return {};
}

Expected<void> V4l2Stream::give_back() {
  if (!held_) return {};
  v4l2_buffer buffer = mapped_buffer(*std::exchange(held_, std::nullopt));
  if (const int error = node_->control(VIDIOC_QBUF, &buffer); error != 0) return refuse("takes no buffer", error);
  return {};
}

Expected<V4l2Stream::Grab> V4l2Stream::next(Duration longest, const Interrupt& interrupt) {
  if (auto given = give_back(); !given) return tl::unexpected(std::move(given.error()));
  switch (node_->wait(longest, interrupt)) {
    case V4l2Node::Ready::kInterrupted:
      return Grab::kInterrupted;
    case V4l2Node::Ready::kBuffer:
      return dequeue_buffer();
    case V4l2Node::Ready::kError: {
      // Without a reason of its own it would be asked again at once, for ever.
      auto taken = dequeue_buffer();
      if (taken && *taken == Grab::kNothing) return refuse("its driver has stopped");
      return taken;
    }
    case V4l2Node::Ready::kEvent: {
      v4l2_event event{};
      if (node_->control(VIDIOC_DQEVENT, &event) == 0 && event.type == V4L2_EVENT_SOURCE_CHANGE) {
        return refuse("the signal at its input changed");
      }
      return Grab::kNothing;
    }
    case V4l2Node::Ready::kNothing:
      break;
  }
  return Grab::kNothing;
}

Expected<V4l2Stream::Grab> V4l2Stream::dequeue_buffer() {
  v4l2_buffer buffer = mapped_buffer(0);
  if (const int error = node_->control(VIDIOC_DQBUF, &buffer); error != 0) {
    if (error == EAGAIN) return Grab::kNothing;
    return refuse("gives no more frames", error);
  }
  const Instant arrival = MonotonicClock::now();
  if (buffer.index >= buffers_.size()) return refuse("its driver gives a buffer that there is not");
  held_ = buffer.index;
  const auto damaged = [this](const char* why) {
    damage_ = why;
    return Grab::kDamaged;
  };
  frame_.stamp.sequence = buffer.sequence;
  const std::span<std::byte> memory = buffers_[buffer.index];
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) return damaged("the driver marks it as damaged");
  if (buffer.bytesused < needed_bytes_ || buffer.bytesused > memory.size()) return damaged("it is cut short");
  // Drivers stamp with CLOCK_MONOTONIC, but for those that are told otherwise or copy another program's stamps.
  const Instant stamp(std::chrono::seconds(buffer.timestamp.tv_sec) +
                      std::chrono::microseconds(buffer.timestamp.tv_usec));
  if (stamp > arrival || arrival - stamp > kOldestStamp) return damaged("its stamp is not on CLOCK_MONOTONIC");
  const bool at_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  frame_.stamp.capture = mid_exposure(stamp, at_start ? StampSource::kStartOfExposure : StampSource::kEndOfFrame,
                                      exposure_, period_, settings_.delay);
  // No frame comes before its exposure was half over: releases fitted to such stamps would be wrong all alike.
  if (frame_.stamp.capture > arrival) {
    return damaged("by its stamp it came before it was exposed; is camera.delay_ms too small?");
  }
  frame_.stamp.arrival = arrival;
  frame_.bytes = memory.first(buffer.bytesused);
  return Grab::kFrame;
}

std::string V4l2Stream::input_fault() {
  int index = 0;
  v4l2_input input{};
  if (node_->control(VIDIOC_G_INPUT, &index) != 0) return "";
  input.index = static_cast<std::uint32_t>(index);
  if (node_->control(VIDIOC_ENUMINPUT, &input) != 0) return "";
  if ((input.status & V4L2_IN_ST_NO_POWER) != 0) return "its input has no power";
  if ((input.status & V4L2_IN_ST_NO_SIGNAL) != 0) return "its input has no signal";
  if ((input.status & V4L2_IN_ST_NO_SYNC) != 0) return "its input is not in step with the signal";
  return "";
}

// NOLINTEND(cppcoreguidelines-pro-type-union-access)

}  // namespace perimap

// A V4L2 node that behaves as the kernel's documentation says (Linux Media userspace API, Part I), as far as a camera
// is used: formats are negotiated, buffers belong to one side at a time, and are filled in the order in which they were
// queued.
#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/v4l2_node.hpp"

namespace perimap::test {

// What the next take of a buffer meets.
struct FakeFrame {
  std::uint32_t sequence = 0;
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  std::optional<std::size_t> bytesused = std::nullopt;  // the whole picture otherwise
  Duration age = std::chrono::milliseconds(1);          // of the stamp when it is taken
  int error = 0;                                        // of VIDIOC_DQBUF, in place of a frame
  std::uint8_t fill = 0;                                // every byte of the picture
  V4l2Node::Ready ready = V4l2Node::Ready::kBuffer;     // what the wait says; without kBuffer nothing is taken
};

struct FakeCamera {
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
  std::uint32_t width = 640, height = 480;  // the only size
  std::uint32_t padding = 0;                // bytes at the end of each row
  std::uint32_t field = V4L2_FIELD_NONE;
  v4l2_fract period{1, 30};                                          // the only one
  std::map<std::uint32_t, std::vector<v4l2_fract>> offered_periods;  // by format, as it says
  std::uint32_t most_buffers = 4;
  std::map<std::uint32_t, std::int32_t> controls{{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY},
                                                 {V4L2_CID_EXPOSURE_ABSOLUTE, 156}};
  std::int32_t highest_exposure = 5000;
  int dv_timings_error = ENOTTY;
  std::uint32_t input_status = 0;
  int streamon_error = 0;
  std::map<unsigned long, int> errors;  // of any call
  std::deque<FakeFrame> frames;

  // What was seen.
  std::vector<std::uint32_t> tried_formats;
  int streams_on = 0, streams_off = 0, mapped = 0, unmapped = 0;
  std::vector<std::string> misuse;  // calls that the kernel would have refused
};

// One opening of a FakeCamera, which outlives it.
class FakeV4l2Node final : public V4l2Node {
 public:
  explicit FakeV4l2Node(FakeCamera& camera) : camera_(camera) {}

  // Long: a case for each request, as the kernel documents them one by one.
  int control(unsigned long request, void* argument) override {
    if (const auto found = camera_.errors.find(request); found != camera_.errors.end()) return found->second;
    switch (request) {
      case VIDIOC_QUERYCAP:
        return answer<v4l2_capability>(argument, [this](v4l2_capability& c) {
          std::strcpy(reinterpret_cast<char*>(c.card), "Fake");
          std::strcpy(reinterpret_cast<char*>(c.driver), "fake");
          c.capabilities = camera_.capabilities | V4L2_CAP_DEVICE_CAPS;
          c.device_caps = camera_.capabilities;
          return 0;
        });
      case VIDIOC_ENUM_FMT:
        return answer<v4l2_fmtdesc>(argument, [this](v4l2_fmtdesc& f) {
          if (f.index >= camera_.formats.size()) return EINVAL;
          f.pixelformat = camera_.formats[f.index];
          return 0;
        });
      case VIDIOC_ENUM_FRAMESIZES:
        return answer<v4l2_frmsizeenum>(argument, [this](v4l2_frmsizeenum& s) {
          if (s.index > 0) return EINVAL;
          s.type = V4L2_FRMSIZE_TYPE_DISCRETE;
          s.discrete = {camera_.width, camera_.height};
          return 0;
        });
      case VIDIOC_ENUM_FRAMEINTERVALS:
        return answer<v4l2_frmivalenum>(argument, [this](v4l2_frmivalenum& i) {
          const auto found = camera_.offered_periods.find(i.pixel_format);
          if (found == camera_.offered_periods.end() || i.index >= found->second.size()) return EINVAL;
          i.type = V4L2_FRMIVAL_TYPE_DISCRETE;
          i.discrete = found->second[i.index];
          return 0;
        });
      case VIDIOC_G_FMT:
        return answer<v4l2_format>(argument, [this](v4l2_format& f) { return give_format(f, camera_.formats.at(0)); });
      case VIDIOC_S_FMT:
        return answer<v4l2_format>(argument, [this](v4l2_format& f) {
          if (!queued_.empty() || buffer_bytes_ > 0) return EBUSY;
          const std::uint32_t wanted = f.fmt.pix.pixelformat;
          camera_.tried_formats.push_back(wanted);
          const bool has = std::find(camera_.formats.begin(), camera_.formats.end(), wanted) != camera_.formats.end();
          return give_format(f, has ? wanted : camera_.formats.at(0));
        });
      case VIDIOC_G_PARM:
      case VIDIOC_S_PARM:
        return answer<v4l2_streamparm>(argument, [this](v4l2_streamparm& p) {
          p.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
          p.parm.capture.timeperframe = camera_.period;
          return 0;
        });
      case VIDIOC_G_CTRL:
        return answer<v4l2_control>(argument, [this](v4l2_control& c) {
          const auto found = camera_.controls.find(c.id);
          if (found == camera_.controls.end()) return EINVAL;
          c.value = found->second;
          return 0;
        });
      case VIDIOC_S_CTRL:
        return answer<v4l2_control>(argument, [this](v4l2_control& c) {
          const auto found = camera_.controls.find(c.id);
          if (found == camera_.controls.end()) return EINVAL;
          if (c.id == V4L2_CID_EXPOSURE_ABSOLUTE && c.value > camera_.highest_exposure) return ERANGE;
          found->second = c.value;
          return 0;
        });
      case VIDIOC_QUERY_DV_TIMINGS:
        return answer<v4l2_dv_timings>(argument, [this](v4l2_dv_timings& t) {
          t = {};
          t.type = V4L2_DV_BT_656_1120;
          t.bt.width = 1920;
          t.bt.height = 1080;
          t.bt.hfrontporch = 280;
          t.bt.vfrontporch = 45;
          t.bt.pixelclock = 148'500'000;
          return camera_.dv_timings_error;
        });
      case VIDIOC_S_DV_TIMINGS:
      case VIDIOC_SUBSCRIBE_EVENT:
        return camera_.dv_timings_error == 0 ? 0 : ENOTTY;
      case VIDIOC_DQEVENT:
        return answer<v4l2_event>(argument, [](v4l2_event& e) {
          e.type = V4L2_EVENT_SOURCE_CHANGE;
          return 0;
        });
      case VIDIOC_G_INPUT:
        return answer<int>(argument, [](int& input) {
          input = 0;
          return 0;
        });
      case VIDIOC_ENUMINPUT:
        return answer<v4l2_input>(argument, [this](v4l2_input& i) {
          i.status = camera_.input_status;
          return 0;
        });
      case VIDIOC_REQBUFS:
        return answer<v4l2_requestbuffers>(argument, [this](v4l2_requestbuffers& r) {
          r.count = std::min(r.count, camera_.most_buffers);
          buffer_bytes_ = format_.sizeimage;
          memory_.assign(r.count, std::vector<std::byte>(buffer_bytes_));
          return 0;
        });
      case VIDIOC_QUERYBUF:
        return answer<v4l2_buffer>(argument, [this](v4l2_buffer& b) {
          if (b.index >= memory_.size()) return EINVAL;
          b.length = static_cast<std::uint32_t>(buffer_bytes_);
          b.m.offset = b.index * 4096;
          return 0;
        });
      case VIDIOC_QBUF:
        return answer<v4l2_buffer>(argument, [this](v4l2_buffer& b) {
          const bool twice = std::find(queued_.begin(), queued_.end(), b.index) != queued_.end();
          if (b.index >= memory_.size() || twice) return refuse("a buffer queued twice");
          queued_.push_back(b.index);
          return 0;
        });
      case VIDIOC_DQBUF:
        return answer<v4l2_buffer>(argument, [this](v4l2_buffer& b) { return take(b); });
      case VIDIOC_STREAMON:
        if (camera_.streamon_error != 0) return camera_.streamon_error;
        streaming_ = true;
        ++camera_.streams_on;
        return 0;
      case VIDIOC_STREAMOFF:
        streaming_ = false;
        queued_.clear();
        ++camera_.streams_off;
        return 0;
      default:
        return ENOTTY;
    }
  }

  std::span<std::byte> map(std::size_t length, std::int64_t offset) override {
    ++camera_.mapped;
    return std::span(memory_.at(static_cast<std::size_t>(offset) / 4096)).first(length);
  }
  void unmap(std::span<std::byte> /*memory*/) noexcept override { ++camera_.unmapped; }

  Ready wait(Duration longest, const Interrupt& interrupt) override {
    if (interrupt.requested()) return Ready::kInterrupted;
    if (camera_.frames.empty()) {
      // A test whose frames are over ends by the interrupt.
      return wait_out(longest, interrupt);
    }
    const Ready ready = camera_.frames.front().ready;
    if (ready != Ready::kBuffer && ready != Ready::kError) camera_.frames.pop_front();
    return ready;
  }

 private:
  template <class T, class Answer>
  static int answer(void* argument, Answer answer) {
    return answer(*static_cast<T*>(argument));
  }

  static Ready wait_out(Duration longest, const Interrupt& interrupt);

  int refuse(const char* what) {
    camera_.misuse.emplace_back(what);
    return EINVAL;
  }

  int give_format(v4l2_format& f, std::uint32_t fourcc) {
    const bool jpeg = fourcc == V4L2_PIX_FMT_MJPEG;
    const std::uint32_t bytes = fourcc == V4L2_PIX_FMT_YUYV || fourcc == V4L2_PIX_FMT_UYVY ? 2 : 1;
    v4l2_pix_format& pix = f.fmt.pix;
    pix.pixelformat = fourcc;
    pix.width = camera_.width;
    pix.height = camera_.height;
    pix.field = camera_.field;
    pix.bytesperline = jpeg ? 0 : bytes * camera_.width + camera_.padding;
    pix.sizeimage = jpeg ? 2 * camera_.width * camera_.height : pix.bytesperline * camera_.height;
    if (fourcc == V4L2_PIX_FMT_NV12) pix.sizeimage += pix.sizeimage / 2;
    format_ = pix;
    return 0;
  }

  int take(v4l2_buffer& b) {
    if (!streaming_) return refuse("taken while not streaming");
    if (camera_.frames.empty() || queued_.empty()) return EAGAIN;
    const FakeFrame frame = camera_.frames.front();
    camera_.frames.pop_front();
    if (frame.error != 0) return frame.error;
    b.index = queued_.front();
    queued_.pop_front();
    b.sequence = frame.sequence;
    b.flags = frame.flags;
    b.bytesused = static_cast<std::uint32_t>(frame.bytesused.value_or(buffer_bytes_));
    const std::int64_t stamp_us = to_ns(MonotonicClock::now() - frame.age) / 1000;
    b.timestamp.tv_sec = stamp_us / 1'000'000;
    b.timestamp.tv_usec = stamp_us % 1'000'000;
    std::fill(memory_[b.index].begin(), memory_[b.index].end(), std::byte{frame.fill});
    return 0;
  }

  FakeCamera& camera_;
  v4l2_pix_format format_{};
  std::vector<std::vector<std::byte>> memory_;
  std::size_t buffer_bytes_ = 0;
  std::deque<std::uint32_t> queued_;
  bool streaming_ = false;
};

inline V4l2Node::Ready FakeV4l2Node::wait_out(Duration longest, const Interrupt& interrupt) {
  const Instant until = MonotonicClock::now() + longest;
  while (MonotonicClock::now() < until) {
    if (interrupt.requested()) return Ready::kInterrupted;
  }
  return Ready::kNothing;
}

}  // namespace perimap::test

// Camera frames on their way from the camera thread to the mapper.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/realtime/counter.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// A frame in the pool; the pixels stay valid until the consumer gives it back.
struct FrameHandle {
  int buffer = -1;
  bool coloured = false;
  FrameStamp stamp;
};

// A fixed set of image buffers with one owner, the camera thread: it alone takes free ones, fills them and hands them
// on. A consumer says only "I am done", so no consumer can keep the camera waiting: with no buffer free the frame is
// dropped and counted.
class FramePool {
 public:
  FramePool(int width, int height, int buffers)
      : width_(width),
        height_(height),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(buffers)),
        bgr_(reduced_row_bytes(width) * static_cast<std::size_t>(reduced_side(height)) *
             static_cast<std::size_t>(buffers)),
        in_use_(std::make_unique<std::atomic<bool>[]>(static_cast<std::size_t>(buffers))),
        buffers_(buffers) {}

  // Of one buffer.
  [[nodiscard]] static std::size_t bytes(int width, int height) noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) +
           reduced_row_bytes(width) * static_cast<std::size_t>(reduced_side(height));
  }

  // Camera thread: a free buffer of the first so many, or -1.
  [[nodiscard]] int acquire(int most) noexcept {
    for (int i = 0; i < std::min(most, buffers_); ++i) {
      auto& in_use = in_use_[static_cast<std::size_t>(i)];
      // Acquire: the consumer's reads of the old pixels happen before the camera overwrites them (pairs with
      // give_back).
      if (in_use.load(std::memory_order_acquire)) continue;
      // Relaxed: only this thread sets it, and the ring that carries the handle orders the pixels.
      in_use.store(true, std::memory_order_relaxed);
      return i;
    }
    return -1;
  }

  // Consumer, or the camera thread for a buffer that it could not hand on.
  void give_back(int buffer) noexcept {
    // Release: see acquire().
    in_use_[static_cast<std::size_t>(buffer)].store(false, std::memory_order_release);
  }

  [[nodiscard]] std::uint8_t* pixels(int buffer) noexcept {
    return pixels_.data() +
           static_cast<std::size_t>(buffer) * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  [[nodiscard]] GreyImage image(int buffer) noexcept { return {pixels(buffer), width_, height_, width_}; }
  // Room for the colour that may come with a frame, reduced.
  [[nodiscard]] std::uint8_t* bgr(int buffer) noexcept {
    return bgr_.data() + static_cast<std::size_t>(buffer) * static_cast<std::size_t>(colour_stride()) *
                             static_cast<std::size_t>(reduced_side(height_));
  }
  [[nodiscard]] ColourImage colour(int buffer) noexcept {
    return {bgr(buffer), reduced_side(width_), reduced_side(height_), colour_stride()};
  }
  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }

 private:
  [[nodiscard]] int colour_stride() const noexcept { return static_cast<int>(reduced_row_bytes(width_)); }

  int width_;
  int height_;
  std::vector<std::uint8_t> pixels_;
  std::vector<std::uint8_t> bgr_;
  std::unique_ptr<std::atomic<bool>[]> in_use_;
  int buffers_;
};

}  // namespace perimap

// Frames of one size with a short count in each, out of a stream of bytes that may begin anywhere and hold garbage.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace perimap {

struct FrameShape {
  std::size_t bytes = 0;
  unsigned modulus = 0;            // of the count
  std::size_t to_synchronise = 0;  // frames in a row that show where frames begin
  std::size_t to_believe = 1;      // frames in a row, this one included, for one that follows the last
  bool (*well_formed)(std::span<const std::byte> frame) = nullptr;
  unsigned (*count)(std::span<const std::byte> frame) = nullptr;
};

// A frame whose count does not follow the last one's is believed only when the next frame agrees with it. Where a frame
// is not well formed, byte by byte is passed over until enough frames in a row are.
class CountedFramer {
 public:
  explicit CountedFramer(const FrameShape& shape) noexcept : shape_(shape) {}

  void restart() noexcept {
    pending_.clear();
    synchronised_ = false;
    any_ = false;
  }

  // on_frame(frame, lost, behind): `lost` is how many frames are missing before this one, modulo the modulus, or none
  // when it follows; `behind` is how many frames more are there already. Returns the number of bytes passed over.
  template <class OnFrame>
  std::uint64_t feed(std::span<const std::byte> bytes, const OnFrame& on_frame) {
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    std::uint64_t passed_over = 0;
    std::size_t at = 0;
    while (at + shape_.bytes <= pending_.size()) {
      const bool follows = synchronised_ && count(at) == next_;
      const std::size_t wanted = !synchronised_ ? shape_.to_synchronise
                                 : follows      ? shape_.to_believe
                                                : std::max<std::size_t>(2, shape_.to_believe);
      const std::size_t consistent = consistent_frames(at, wanted);
      if (consistent < wanted) {
        if (at + (consistent + 1) * shape_.bytes > pending_.size()) break;  // well so far; more must come
        if (!synchronised_) {
          ++at;
          ++passed_over;
        }
        synchronised_ = false;
        continue;
      }
      synchronised_ = true;
      const std::optional<unsigned> lost =
          follows || !any_ ? std::nullopt : std::optional((count(at) + shape_.modulus - next_) % shape_.modulus);
      on_frame(frame(at), lost, (pending_.size() - at) / shape_.bytes - 1);
      any_ = true;
      next_ = (count(at) + 1) % shape_.modulus;
      at += shape_.bytes;
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(at));
    return passed_over;
  }

 private:
  [[nodiscard]] std::span<const std::byte> frame(std::size_t at) const noexcept {
    return std::span(pending_).subspan(at, shape_.bytes);
  }
  [[nodiscard]] unsigned count(std::size_t at) const noexcept { return shape_.count(frame(at)); }

  // Well-formed frames in a row from `at` on that follow each other, at most `most`.
  [[nodiscard]] std::size_t consistent_frames(std::size_t at, std::size_t most) const noexcept {
    std::size_t frames = 0;
    for (; frames < most && at + shape_.bytes <= pending_.size(); ++frames, at += shape_.bytes) {
      if (!shape_.well_formed(frame(at))) break;
      if (frames > 0 && count(at) != (count(at - shape_.bytes) + 1) % shape_.modulus) break;
    }
    return frames;
  }

  FrameShape shape_;
  std::vector<std::byte> pending_;
  bool synchronised_ = false;
  bool any_ = false;
  unsigned next_ = 0;
};

}  // namespace perimap

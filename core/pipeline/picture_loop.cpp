#include "core/pipeline/picture_loop.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>

namespace perimap {
namespace {

constexpr std::ptrdiff_t kHashed = 32768;  // pixels, about
constexpr std::uint64_t kPrime = 0x9E3779B97F4A7C15ULL;

// None of a picture of one grey throughout.
std::optional<std::uint64_t> hash_of(const GreyImage& image) noexcept {
  const std::ptrdiff_t pixels = static_cast<std::ptrdiff_t>(image.width) * image.height;
  const int step = static_cast<int>(std::max<std::ptrdiff_t>(1, pixels / kHashed));
  std::uint64_t plain = 0;
  std::memset(&plain, *image.row(0), sizeof(plain));
  std::uint64_t hash = static_cast<std::uint64_t>(pixels);
  std::uint64_t differs = 0;
  for (int y = 0; y < image.height; y += step) {
    const std::uint8_t* row = image.row(y);
    int x = 0;
    for (; x + 8 <= image.width; x += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, row + x, sizeof(word));
      differs |= word ^ plain;
      hash = (hash ^ word) * kPrime;
      hash ^= hash >> 32U;
    }
    for (; x < image.width; ++x) {
      differs |= static_cast<std::uint64_t>(row[x] ^ *image.row(0));
      hash = (hash ^ row[x]) * kPrime;
    }
  }
  if (differs == 0) return std::nullopt;
  return hash;
}

}  // namespace

bool PictureLoop::seen_before(const GreyImage& image, Instant capture) noexcept {
  if (image.data == nullptr || image.width < 1 || image.height < 1) return false;
  const std::optional<std::uint64_t> hash = hash_of(image);
  if (!hash) return false;
  bool seen = false;
  for (std::uint64_t back = 1; back <= std::min(count_, kCapacity) && !seen; ++back) {
    const Seen& picture = seen_[(count_ - back) % kCapacity];
    if (capture - picture.capture > kLately) break;
    seen = picture.hash == *hash;
  }
  seen_[count_++ % kCapacity] = {capture, *hash};
  return seen;
}

}  // namespace perimap

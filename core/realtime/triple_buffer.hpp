// The newest value of one writer for one reader, without waiting on either side.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <utility>

namespace perimap {

// Three copies of T: one the writer fills, one the reader reads, one in the middle that they exchange. Whoever is
// done swaps its own for the middle one, so neither ever waits and the reader never sees a half-written value.
// One writer thread and one reader thread; several readers need a buffer each.
template <class T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  explicit TripleBuffer(const T& initial) : values_{initial, initial, initial} {}

  // Writer: the value to fill. It holds what was written two publications ago, not the latest.
  [[nodiscard]] T& back() noexcept { return values_[back_]; }

  // Writer: hands the filled value over.
  void publish() noexcept {
    // Release: the writes to values_[back_] must not move after the swap, or the reader could take a buffer that is
    // still being filled. Acquire: the buffer we get back was read by the reader before it swapped it in; our next
    // writes must not move before this swap, or they would tear that read.
    const std::uint32_t old = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel);
    back_ = old & kIndex;
  }

  void write(const T& value) noexcept {
    back() = value;
    publish();
  }

  // Reader: takes the newest value if there is one. True when it changed since the last call.
  bool update() noexcept {
    // Relaxed: only decides whether to swap; the exchange below does the ordering.
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    // Acquire: the writer's filling of the buffer we get happens before our reads of it. Release: our reads of the
    // buffer we give up happen before the writer fills it again.
    const std::uint32_t old = middle_.exchange(front_, std::memory_order_acq_rel);
    front_ = old & kIndex;
    return true;
  }

  // Reader: the value of the last update(); the initial value before the first.
  [[nodiscard]] const T& front() const noexcept { return values_[front_]; }

 private:
  static constexpr std::uint32_t kIndex = 3;
  static constexpr std::uint32_t kFresh = 4;
  static constexpr std::size_t kLine = 64;

  std::array<T, 3> values_{};
  alignas(kLine) std::uint32_t back_ = 0;                // the writer's own
  alignas(kLine) std::atomic<std::uint32_t> middle_{1};  // index | kFresh
  alignas(kLine) std::uint32_t front_ = 2;               // the reader's own
};

}  // namespace perimap

// Marks the stretches of code that are on the real-time path.
#pragma once

namespace perimap {

// While one lives, the thread promises: no allocation, lock, exception, I/O or log call. The promise is checked by
// tests that interpose the allocator and look at depth(); in production it costs one thread-local increment.
class RealtimeScope {
 public:
  RealtimeScope() noexcept { ++depth_; }
  ~RealtimeScope() { --depth_; }
  RealtimeScope(const RealtimeScope&) = delete;
  RealtimeScope& operator=(const RealtimeScope&) = delete;

  [[nodiscard]] static int depth() noexcept { return depth_; }

 private:
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables,readability-identifier-naming): one a thread
  static inline thread_local int depth_ = 0;
};

}  // namespace perimap

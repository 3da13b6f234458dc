// Marks the stretches of code that are on the real-time path.
#pragma once

namespace perimap {

// While one lives, the thread promises: no allocation, lock, wait, exception, I/O or log call. The promise is checked
// by tests that interpose all such calls and look at depth(); in production it costs one thread-local increment.
class RealtimeScope {
 public:
  RealtimeScope() noexcept { ++depth_; }
  ~RealtimeScope() { --depth_; }
  RealtimeScope(const RealtimeScope&) = delete;
  RealtimeScope& operator=(const RealtimeScope&) = delete;

  [[nodiscard]] static int depth() noexcept { return depth_; }

 private:
  friend class NamedWait;
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables,readability-identifier-naming): one a thread
  static inline thread_local int depth_ = 0;
};

// Within such a stretch, a wait that belongs to the design (docs/design/pipeline.md): of the mapper for its workers
// and, in lockstep, for housekeeping. Elsewhere the real-time threads wait outside of their scopes.
class NamedWait {
 public:
  NamedWait() noexcept : depth_(RealtimeScope::depth_) { RealtimeScope::depth_ = 0; }
  ~NamedWait() { RealtimeScope::depth_ = depth_; }
  NamedWait(const NamedWait&) = delete;
  NamedWait& operator=(const NamedWait&) = delete;

 private:
  int depth_;
};

}  // namespace perimap

#include "daemon/evaluation/bench/release_log.hpp"

namespace perimap::bench {

ReleaseLog::ReleaseLog(Publication& next, ReleaseStream stream, std::size_t capacity)
    : next_(next), stream_(name_of(stream)) {
  releases_.reserve(capacity);
}

void ReleaseLog::surface(const perimap_Surface& sample) {
  const Instant ready = MonotonicClock::now();
  next_.surface(sample);
  const Instant written = MonotonicClock::now();
  if (sample.stream != stream_) return;
  const std::int64_t before = newest_deadline_ns();
  if (before != 0) period_ns_.store(sample.release_time_ns - before, std::memory_order_relaxed);
  deadline_ns_.store(sample.release_time_ns, std::memory_order_relaxed);
  if (releases_.size() == releases_.capacity()) return;
  releases_.push_back({sample.sample_sequence, from_ns(sample.capture_time_ns), from_ns(sample.release_time_ns), ready,
                       written, sample.features._length});
}

}  // namespace perimap::bench

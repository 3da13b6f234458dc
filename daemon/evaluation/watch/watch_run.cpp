#include "daemon/evaluation/watch/watch_run.hpp"

#include <chrono>

namespace perimap {
namespace {

// How soon the end of a watch is noticed. Signals are noticed at once.
constexpr Duration kSlice = std::chrono::milliseconds(20);
constexpr Duration kReportInterval = std::chrono::seconds(1);

}  // namespace

void watch_until_ended(SampleReceiver& receiver, StopSignal& stop, const WatchSpan& span,
                       const std::function<void(const std::vector<StreamReport>&)>& tell) {
  const Instant start = MonotonicClock::now();
  std::optional<Instant> first;  // when the first surface was seen
  Instant last_report = start;
  while (!stop.wait_for(kSlice) && !receiver.ended()) {
    const Instant now = MonotonicClock::now();
    if (!first && receiver.surfaces() > 0) first = now;
    if (!first && span.wait && now - start >= *span.wait) return;
    if (tell && now - last_report >= kReportInterval) {
      tell(receiver.take_interval(now - last_report));
      last_report = now;
    }
    if (first && span.duration && now - *first >= *span.duration) return;
  }
}

}  // namespace perimap

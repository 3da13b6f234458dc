// How long a watch lasts.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/evaluation/watch/sample_receiver.hpp"
#include "daemon/process/stop_signal.hpp"

namespace perimap {

struct WatchSpan {
  std::optional<Duration> wait;      // at most, for a first surface
  std::optional<Duration> duration;  // since that
};

// Until a signal, the span's end, or what ends the receiver. `tell`, where there is one, is given what came in each
// second.
void watch_until_ended(SampleReceiver& receiver, StopSignal& stop, const WatchSpan& span,
                       const std::function<void(const std::vector<StreamReport>&)>& tell);

}  // namespace perimap

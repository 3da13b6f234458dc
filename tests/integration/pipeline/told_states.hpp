// What a DDS subscriber is told of the sources and of each surface, with when it was told.
#pragma once

#include <perimap.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/evaluation/watch/sample_receiver.hpp"

namespace perimap::test {

struct ToldSurface {
  Instant receipt;
  Instant capture;
  Instant release;
  std::uint64_t sequence = 0;
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  bool camera_pose_known = false;
};

struct ToldChange {
  Instant receipt;
  perimap_SourceState state = perimap_SOURCE_STARTING;
};

class ToldStates {
 public:
  explicit ToldStates(SampleReaders readers) : readers_(std::move(readers)), thread_([this] { receive(); }) {}
  ToldStates(const ToldStates&) = delete;
  ToldStates& operator=(const ToldStates&) = delete;
  ~ToldStates() { readers_.wait_set.stop(); }

  // The first change of the source's state after `since` to one of these.
  [[nodiscard]] std::optional<ToldChange> first(perimap_SourceKind kind, const std::vector<perimap_SourceState>& states,
                                                Instant since) const {
    const std::lock_guard lock(mutex_);
    const auto changes = changes_.find(kind);
    if (changes == changes_.end()) return std::nullopt;
    for (const ToldChange& change : changes->second) {
      if (change.receipt < since) continue;
      if (std::find(states.begin(), states.end(), change.state) != states.end()) return change;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::vector<ToldSurface> surfaces() const {
    const std::lock_guard lock(mutex_);
    return surfaces_;
  }
  // Whether one of state good has been released since then.
  [[nodiscard]] bool good_since(Instant since) const {
    const std::lock_guard lock(mutex_);
    return !surfaces_.empty() && std::any_of(surfaces_.rbegin(), surfaces_.rend(), [since](const ToldSurface& s) {
      return s.release >= since && s.state == perimap_SURFACE_GOOD;
    });
  }

 private:
  void receive() {
    while (readers_.wait_set.wait()) {
      const Instant receipt = MonotonicClock::now();
      const std::lock_guard lock(mutex_);
      if (const auto loan = readers_.statuses.take()) {
        for (std::size_t i = 0; i < loan->size(); ++i) {
          if (const perimap_Status* status = loan->sample(i)) note(*status, receipt);
        }
      }
      if (const auto loan = readers_.surfaces.take()) {
        for (std::size_t i = 0; i < loan->size(); ++i) {
          if (const perimap_Surface* s = loan->sample(i)) {
            surfaces_.push_back({receipt, from_ns(s->capture_time_ns), from_ns(s->release_time_ns), s->sample_sequence,
                                 s->state, s->reason, s->camera_pose_known});
          }
        }
      }
    }
  }
  void note(const perimap_Status& status, Instant receipt) {
    for (std::uint32_t i = 0; i < status.sources._length; ++i) {
      const perimap_SourceStatus& source = status.sources._buffer[i];
      std::vector<ToldChange>& changes = changes_[source.kind];
      if (changes.empty() || changes.back().state != source.state) changes.push_back({receipt, source.state});
    }
  }

  SampleReaders readers_;
  mutable std::mutex mutex_;
  std::map<perimap_SourceKind, std::vector<ToldChange>> changes_;
  std::vector<ToldSurface> surfaces_;
  std::jthread thread_;
};

}  // namespace perimap::test

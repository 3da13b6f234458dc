// What a subscriber sees of the published surfaces: losses, latency, jitter, states.
#pragma once

#include <perimap.h>
#include <perimap_tool.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <perimap_publisher_watch.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/evaluation/watch/duration_counts.hpp"
#include "daemon/publishing/use_text.hpp"

namespace perimap {

// One surface in brief.
struct SurfaceDigest {
  std::uint64_t sample_sequence = 0;
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  double cardiac_phase_rad = 0.0;
  double cardiac_phase_deviation_rad = 0.0;
  double cardiac_phase_rate_rad_per_s = 0.0;
  std::array<std::uint32_t, 4> features{};  // by FeatureState
  // Median over all features that are not invalid of the largest standard deviation in any direction.
  std::optional<double> median_deviation_mm;
  std::optional<ToldUses> uses;  // none of an older perimapd
};

// The last status of a stream.
struct StatusDigest {
  perimap_Status status{};  // its sequences are empty
  std::vector<perimap_StageLatency> stages;
  std::vector<perimap_SourceStatus> sources;
};

// What was told of one tool over some time.
struct ToolReport {
  perimap_ToolDistance last{};
  std::uint64_t received = 0;
  std::uint64_t missing = 0;  // sequence numbers that never came, between samples that did
};

// What one stream of one source did over some time.
struct StreamReport {
  std::string source;
  std::string stream;
  Duration length{0};
  std::uint64_t received = 0;
  std::uint64_t missing = 0;    // sequence numbers that never came, between samples that did
  std::uint64_t restarts = 0;   // the sequence began anew
  std::uint64_t expired = 0;    // received after their own valid_until_ns
  std::uint64_t contested = 0;  // of two publishers, or at odds with those before: their positions are not to be used
  client::Hearing hearing = client::Hearing::kListening;  // of the last
  DurationSpread latency;                                 // receipt minus capture
  DurationSpread lateness;                                // receipt minus release deadline; early counts as zero
  DurationSpread jitter;  // |receipt interval minus release interval| of neighbouring samples
  std::optional<SurfaceDigest> last;
  std::optional<StatusDigest> status;
  std::vector<ToolReport> tools;  // of the source, with the stream that they are told with; by name
};

// One thread at a time. Latencies make sense on the publisher's host only, whose CLOCK_MONOTONIC the samples carry.
class WatchStatistics {
 public:
  // `writer`: what tells one from another, as dds_sample_info_t::publication_handle.
  // Returns the surface in brief.
  SurfaceDigest add(const perimap_Surface& surface, Instant receipt, std::uint64_t writer = 0);
  void add(const perimap_Status& status);
  void add(const perimap_ToolDistance& tool);
  // What it says of its publisher: in which run, and whether there are two.
  void hear(const perimap_Status& status, Instant receipt, std::uint64_t writer);

  [[nodiscard]] std::uint64_t surfaces() const noexcept { return surfaces_; }

  // What each stream did since the last call, which was `length` ago.
  [[nodiscard]] std::vector<StreamReport> take_interval(Duration length);
  // What each stream did from its first sample to its last.
  [[nodiscard]] std::vector<StreamReport> totals() const;

 private:
  // Of an interval, or of all.
  struct Tally {
    std::uint64_t received = 0;
    std::uint64_t missing = 0;
    std::uint64_t restarts = 0;
    std::uint64_t expired = 0;
    std::uint64_t contested = 0;
    DurationCounts latency;
    DurationCounts lateness;
    DurationCounts jitter;
  };
  struct Stream {
    Tally interval;
    Tally total;
    Instant first_receipt;
    Instant last_receipt;
    Instant last_release;
    std::array<std::uint8_t, 16> last_run{};
    client::Hearing hearing = client::Hearing::kListening;
    std::optional<SurfaceDigest> last;
    std::optional<StatusDigest> status;
  };
  using Key = std::pair<std::string, std::string>;

  struct Tool {
    ToolReport interval;
    ToolReport total;
  };
  // Of the source, when `key` is the stream that its tools are told with: that of its frames where there is one.
  [[nodiscard]] std::vector<ToolReport> tools_with(const Key& key, ToolReport Tool::*tally) const;

  static StreamReport report(const Key& key, const Stream& stream, const Tally& tally, Duration length);

  std::map<Key, Stream> streams_;
  std::map<Key, Tool> tools_;                                 // by source and name
  std::map<std::string, client::PublisherWatch> publishers_;  // by source
  std::uint64_t surfaces_ = 0;
};

}  // namespace perimap

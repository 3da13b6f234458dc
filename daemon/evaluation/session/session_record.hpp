// What a session's recordings tell of it, without any truth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/evaluation/session/session_strip.hpp"
#include "daemon/evaluation/watch/watch_statistics.hpp"

namespace perimap {

struct SessionFiles {
  std::string recording;  // of what was published, of devices, or of both
  std::string published;  // what was published, where that is a file of its own; empty: it is not
  std::string source;     // which perimapd; empty: the first that the file has
  std::string stream;     // "frame" or "clock"; empty: "frame" where there is one
};

// Of one surface.
struct SurfaceMoment {
  double at_s = 0.0;  // receipt, from that of the first
  std::uint32_t converged = 0;
  std::uint32_t others = 0;            // published, but not converged
  std::optional<double> deviation_mm;  // as SurfaceDigest::median_deviation_mm
  double capture_to_receipt_ms = 0.0;
};

struct RhythmMoment {
  double at_s = 0.0;
  double interval_s = 0.0;  // from an R peak to the next
};

// What the mesh says of itself: each feature beside what all others make of it.
struct MeshMoment {
  double at_s = 0.0;
  double leave_one_out_rms_mm = 0.0;
  double leave_one_out_nees = 0.0;  // 1 where the published deviations are right
};

// How long surfaces were something, over all.
struct StateShare {
  std::string what;  // "good", "degraded: not seen"
  Tone tone = Tone::kNeutral;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  double seconds = 0.0;
  std::uint64_t spans = 0;
  double longest_s = 0.0;
  double longest_begin_s = 0.0;
};

struct SourceCounters {
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
};

// What perimapd counted.
struct StatusCounters {
  enum Count : std::size_t {
    kLateUpdates,
    kReleasesMissed,
    kReleasesLate,
    kWithoutPose,
    kWithoutPhase,
    kNotRecorded,
    kPublished,
    kCounts
  };

  std::array<std::uint8_t, 16> run_id{};
  std::array<std::uint64_t, kCounts> counts{};
  std::map<perimap_SourceKind, SourceCounters> sources;
  bool latency_short = false;
  bool respiration_suspected = false;
  bool recording_stopped = false;
  bool priority_refused = false;
  bool memory_refused = false;
  std::string doubt;  // what the watch over the set-up said when it doubted last; empty: it never did
};

struct RecordedFile {
  struct Channel {
    std::string name;
    std::string type;
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
    Instant first, last;  // arrivals
  };
  std::string path;
  std::vector<Channel> channels;
  std::string generator;  // program and version
  std::string description;
  std::string configuration;  // as it is attached; empty: it is not
  std::string verification;   // likewise, what perimap verify said last before it
  std::vector<std::string> attachments;
  std::vector<std::string> damage;
};

struct SessionRecord {
  std::string source, stream;
  bool virtual_time = false;               // replayed so: receipts are no more than releases, and no delay is told
  std::vector<std::string> other_streams;  // "SOURCE, STREAM", of which nothing below tells
  std::int64_t begin_utc_ns = 0;           // release of the first surface
  double length_s = 0.0;                   // from the first surface's receipt to the last one's
  std::optional<double> first_good_s;
  std::vector<StateShare> shares;  // the longest first
  std::vector<SessionStrip> strips;
  std::vector<SurfaceMoment> surfaces;
  std::vector<RhythmMoment> rhythm;
  std::vector<MeshMoment> mesh;
  StreamReport counts;
  StatusCounters counters;  // from the first status to the last, over all runs; a flag is set that was set in any
  std::vector<RecordedFile> files;
};

// Reads both files once, of a damaged one what is whole; where both are given what was published is taken from the
// second alone. An error says which file holds no surface, and how to come by one that does.
[[nodiscard]] Expected<SessionRecord> read_session(const SessionFiles& files);

}  // namespace perimap

// One stream of one perimapd over a session, sample by sample.
#pragma once

#include <perimap.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/evaluation/session/session_record.hpp"

namespace perimap {

class PublishedSession {
 public:
  // In the order in which they were received, each with its receipt.
  void add(const perimap_Surface& surface, const SurfaceDigest& brief, Instant receipt);
  void add(const perimap_Phase& phase, Instant receipt);
  void add(const perimap_Status& status, Instant receipt);

  [[nodiscard]] const std::vector<SurfaceMoment>& surfaces() const noexcept { return surfaces_; }
  // The first surface's receipt, on the clock that all receipts are on.
  [[nodiscard]] double begin_s() const noexcept { return begin_s_; }

  // All but names, counts, mesh and files, from the first surface on.
  [[nodiscard]] SessionRecord record() const;

 private:
  // What comes at intervals that nobody told holds for two and a half of them.
  class Interval {
   public:
    [[nodiscard]] double holds_s(double at_s) noexcept;

   private:
    double last_s_ = -1.0;
  };

  void count(const perimap_Status& status);

  double begin_s_ = 0.0;
  std::int64_t begin_utc_ns_ = 0;
  std::optional<double> first_good_s_;
  bool virtual_time_ = true;                              // as far as surfaces tell
  std::map<std::string, perimap_SurfaceReason> reasons_;  // by the words of the strip
  std::vector<SurfaceMoment> surfaces_;
  std::vector<RhythmMoment> rhythm_;
  std::int64_t last_r_peak_ns_ = 0;
  std::uint64_t last_beats_ = 0;
  SessionStrip surface_{"surface"};
  SessionStrip phase_{"heart's phase"};
  SessionStrip lead_{"ECG lead"};
  SessionStrip second_lead_{"second ECG lead"};
  SessionStrip set_up_{"set-up watch"};
  SessionStrip recording_{"recording"};
  std::map<perimap_SourceKind, SessionStrip> sources_;
  Interval phases_, statuses_;
  std::optional<StatusCounters> last_counters_;
  StatusCounters counters_;
};

}  // namespace perimap

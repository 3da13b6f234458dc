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
  void add(const perimap_Surface& surface, Instant receipt);
  void add(const perimap_Phase& phase, Instant receipt);
  void add(const perimap_Status& status, Instant receipt);

  [[nodiscard]] const std::vector<SurfaceMoment>& surfaces() const noexcept { return surfaces_; }
  // The first surface's receipt, on the clock that all receipts are on.
  [[nodiscard]] double begin_s() const noexcept { return begin_s_; }

  // All but names, counts, mesh and files, from the first surface on.
  [[nodiscard]] SessionRecord record() const;

 private:
  double begin_s_ = 0.0;
  std::int64_t begin_utc_ns_ = 0;
  std::optional<double> first_good_s_;
  std::map<std::string, perimap_SurfaceReason> reasons_;  // by the words of the strip
  std::vector<SurfaceMoment> surfaces_;
  std::vector<RhythmMoment> rhythm_;
  std::int64_t last_r_peak_ns_ = 0;
  std::uint64_t last_beats_ = 0;
  SessionStrip surface_{"surface", 0.4};
  SessionStrip phase_{"heart's phase", 0.5};
  SessionStrip lead_{"ECG lead", 2.5};
  SessionStrip second_lead_{"second ECG lead", 2.5};
  SessionStrip set_up_{"set-up watch", 2.5};
  SessionStrip recording_{"recording", 2.5};
  std::map<perimap_SourceKind, SessionStrip> sources_;
};

}  // namespace perimap

// What a procedure's events did to what was published: was it there to be used, was it right where it said so, and did
// it say what was the matter.
#pragma once

#include <perimap.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "daemon/evaluation/report/judged_surface.hpp"

namespace perimap {

// From the recording's first frame.
struct ProcedureSpan {
  std::string kind;
  std::string words;
  double begin_s = 0.0;
  double end_s = 0.0;
  bool hides = false;
};

struct ScoredEvent {
  ProcedureSpan event;
  std::optional<double> told_after_s;          // from its beginning to the first surface that was not good; none: never
  std::optional<perimap_SurfaceReason> cause;  // that was said longest, until 10 s after its end or the next event
  std::optional<bool> right;                   // none: nothing had to be said, and nothing was
  std::optional<double> good_again_after_s;    // from its end; none: not before the next event
  double wrong_while_good_s = 0.0;             // from its beginning to the next event's
};

struct FalseAlarm {
  double begin_s = 0.0;
  double end_s = 0.0;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;  // at its beginning
};

struct ProcedureScore {
  double begin_s = 0.0;     // figures are of what was released from here on: the first good surface, 30 s at the latest
  double duration_s = 0.0;  // of all that is scored
  double seen_s = 0.0;      // of that, with the organ in view and nothing of the script hiding it
  // Of the features that have been called converged, the share that is good, mean over the surfaces while it is seen.
  double availability = 0.0;
  std::vector<FalseAlarm> false_alarms;
  double wrong_while_good_s = 0.0;
  double wrong_before_known_s = 0.0;  // of that, released before the ECG could tell of a premature beat
  std::size_t causes_right = 0;
  std::size_t causes_judged = 0;
  std::size_t events_recovered = 0;   // good again within 10 s, after a withdrawal 3 s
  std::size_t events_to_recover = 0;  // whose recovery the next event left time for
  struct Worst {
    double begin_s = 0.0;
    double wrong_s = 0.0;
    double largest_mm = 0.0;
  };
  Worst worst_ten_seconds;  // the ten seconds with most that was wrong while good; then with the largest error
  std::vector<ScoredEvent> events;

  // None where nothing was judged.
  [[nodiscard]] double cause_accuracy() const noexcept;
  [[nodiscard]] double false_alarms_per_hour() const noexcept;
};

// `surfaces`: of one stream, in order. `events`: in order. `r_peaks_s`: the true ones, in order.
//
// - Wrong while good: more than 1 % of a surface's good positions are off by more than 3 mm, or one feature has been,
// good,
//   for over 0.2 s. Each surface counts until the next, 0.1 s at most.
// - A false alarm is a stretch of surfaces that are not good, and that nothing explains: it began neither during an
// event
//   nor within 10 s after one, less than 1 % of the features that have been converged are off by more than 3 mm, and it
//   is not the heart's rhythm that is told around a beat that came early indeed. Stretches less than a second apart are
//   one.
// - A cause is right when it names what happened (event_causes.hpp). Rhythm told around an early beat counts for no
// event
//   but a run of ectopic beats.
// - Good again: good, with half as many good features as in the 5 s before the event, and not interrupted for 2 s but
// by
//   such rhythm.
[[nodiscard]] ProcedureScore score_procedure(const std::vector<JudgedSurface>& surfaces,
                                             const std::vector<ProcedureSpan>& events,
                                             const std::vector<double>& r_peaks_s);

}  // namespace perimap

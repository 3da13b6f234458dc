#include "daemon/evaluation/procedure/procedure_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "daemon/evaluation/procedure/event_causes.hpp"

namespace perimap {
namespace {

constexpr double kMapMade_s = 30.0;
constexpr double kAfter_s = 10.0;  // an event's end, in which it is still what is told of
constexpr double kAfterWithdrawal_s = 3.0;
constexpr double kOneFeature_s = 0.2 + 1e-9;  // instants are in nanoseconds
constexpr double kLongestShown_s = 0.1;       // of one surface
constexpr double kShareOff = 0.01;
constexpr double kApart_s = 1.0;  // alarms
constexpr double kStays_s = 2.0;  // what is good again
constexpr double kWindow_s = 10.0;
constexpr double kNever = std::numeric_limits<double>::infinity();

bool is_good(const JudgedSurface& surface) noexcept { return surface.state == perimap_SURFACE_GOOD; }

// When the heart's own rhythm is told rightly: from the beat before one that came early until a second after the next.
class EarlyBeats {
 public:
  explicit EarlyBeats(const std::vector<double>& r_peaks_s) {
    constexpr double kEarly = 0.88;
    constexpr std::size_t kBefore = 4;
    for (std::size_t i = kBefore + 1; i < r_peaks_s.size(); ++i) {
      const double rr = r_peaks_s[i] - r_peaks_s[i - 1];
      const double usual = (r_peaks_s[i - 1] - r_peaks_s[i - 1 - kBefore]) / static_cast<double>(kBefore);
      if (rr >= kEarly * usual) continue;
      const double next = i + 1 < r_peaks_s.size() ? r_peaks_s[i + 1] : r_peaks_s[i] + usual;
      spans_.emplace_back(r_peaks_s[i - 1], next + 1.0);
    }
  }

  [[nodiscard]] bool explain(const JudgedSurface& surface) const noexcept {
    if (!is_of_rhythm(surface.reason)) return false;
    return std::any_of(spans_.begin(), spans_.end(), [&surface](const auto& span) {
      return surface.released_s >= span.first && surface.released_s <= span.second;
    });
  }

 private:
  std::vector<std::pair<double, double>> spans_;
};

class Scoring {
 public:
  Scoring(const std::vector<JudgedSurface>& surfaces, const std::vector<ProcedureSpan>& events,
          const std::vector<double>& r_peaks_s)
      : surfaces_(surfaces), events_(events) {
    const EarlyBeats early(r_peaks_s);
    for (const JudgedSurface& surface : surfaces_) by_rhythm_.push_back(!is_good(surface) && early.explain(surface));
  }

  ProcedureScore score() {
    if (surfaces_.empty()) return {};
    const auto first_good = std::find_if(surfaces_.begin(), surfaces_.end(), is_good);
    score_.begin_s = first_good == surfaces_.end() ? kMapMade_s : std::min(kMapMade_s, first_good->released_s);
    find_wrong();
    available();
    find_false_alarms();
    find_worst();
    for (std::size_t i = 0; i < events_.size(); ++i) score_event(i);
    return std::move(score_);
  }

 private:
  // How long a surface is what a user has.
  [[nodiscard]] double shown_s(std::size_t i) const noexcept {
    if (i + 1 == surfaces_.size()) return 0.0;
    return std::clamp(surfaces_[i + 1].released_s - surfaces_[i].released_s, 0.0, kLongestShown_s);
  }

  void find_wrong() {
    std::map<std::uint32_t, double> off_since;
    for (const JudgedSurface& surface : surfaces_) {
      std::map<std::uint32_t, double> still_off;
      bool wrong = false;
      for (const std::uint32_t id : surface.good_ids_off) {
        const auto before = off_since.find(id);
        const double since_s = before == off_since.end() ? surface.released_s : before->second;
        still_off[id] = since_s;
        wrong = wrong || surface.released_s - since_s > kOneFeature_s;
      }
      off_since.swap(still_off);
      wrong = wrong || static_cast<double>(surface.good_ids_off.size()) > kShareOff * surface.good;
      wrong_.push_back(wrong);
    }
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      if (!wrong_[i] || surfaces_[i].released_s < score_.begin_s) continue;
      score_.wrong_while_good_s += shown_s(i);
      if (surfaces_[i].before_known) score_.wrong_before_known_s += shown_s(i);
    }
  }

  [[nodiscard]] bool is_hidden(double t_s) const noexcept {
    return std::any_of(events_.begin(), events_.end(), [t_s](const ProcedureSpan& event) {
      return event.hides && t_s >= event.begin_s && t_s < event.end_s;
    });
  }

  void available() {
    double shares = 0.0;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      const JudgedSurface& surface = surfaces_[i];
      if (surface.released_s < score_.begin_s) continue;
      score_.duration_s += shown_s(i);
      if (is_hidden(surface.released_s)) continue;
      score_.seen_s += shown_s(i);
      if (surface.once_converged > 0) shares += shown_s(i) * surface.good / surface.once_converged;
    }
    if (score_.seen_s > 0.0) score_.availability = shares / score_.seen_s;
  }

  // Whether an alarm that begins with this surface is one about something.
  [[nodiscard]] bool is_explained(std::size_t i) const noexcept {
    const JudgedSurface& surface = surfaces_[i];
    if (surface.once_converged_off > kShareOff * surface.once_converged) return true;
    return std::any_of(events_.begin(), events_.end(), [&surface](const ProcedureSpan& event) {
      return surface.released_s >= event.begin_s && surface.released_s < event.end_s + kAfter_s;
    });
  }

  void find_false_alarms() {
    double alarm_until_s = -kNever;
    bool explained = false;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      const JudgedSurface& surface = surfaces_[i];
      if (is_good(surface) || by_rhythm_[i]) continue;
      if (surface.released_s < score_.begin_s) {
        alarm_until_s = surface.released_s;
        explained = true;
        continue;
      }
      if (surface.released_s - alarm_until_s > kApart_s) {
        explained = is_explained(i);
        if (!explained) score_.false_alarms.push_back({surface.released_s, surface.released_s, surface.reason});
      }
      alarm_until_s = surface.released_s;
      if (!explained) score_.false_alarms.back().end_s = surface.released_s;
    }
  }

  // Windows that begin with each second.
  void find_worst() {
    ProcedureScore::Worst& worst = score_.worst_ten_seconds;
    worst.begin_s = score_.begin_s;
    std::size_t first = 0;
    const double last_s = surfaces_.back().released_s - kWindow_s;
    const double first_begin_s = std::floor(score_.begin_s);
    const int windows = 1 + static_cast<int>(std::max(last_s, score_.begin_s) - first_begin_s);
    for (int window = 0; window < windows; ++window) {
      const double begin_s = first_begin_s + window;
      while (first < surfaces_.size() && surfaces_[first].released_s < begin_s) ++first;
      double wrong_s = 0.0, largest_mm = 0.0;
      for (std::size_t i = first; i < surfaces_.size() && surfaces_[i].released_s < begin_s + kWindow_s; ++i) {
        if (wrong_[i]) wrong_s += shown_s(i);
        largest_mm = std::max(largest_mm, surfaces_[i].largest_good_mm);
      }
      if (wrong_s > worst.wrong_s || (wrong_s == worst.wrong_s && largest_mm > worst.largest_mm)) {
        worst = {begin_s, wrong_s, largest_mm};
      }
    }
  }

  [[nodiscard]] std::size_t first_from(double t_s) const noexcept {
    return static_cast<std::size_t>(
        std::lower_bound(surfaces_.begin(), surfaces_.end(), t_s,
                         [](const JudgedSurface& surface, double t) { return surface.released_s < t; }) -
        surfaces_.begin());
  }

  void score_event(std::size_t index) {
    ScoredEvent scored;
    scored.event = events_[index];
    const ProcedureSpan& event = scored.event;
    const double next_s = index + 1 < events_.size() ? std::max(events_[index + 1].begin_s, event.end_s) : kNever;
    const double told_until_s = std::min(event.end_s + kAfter_s, next_s);
    const bool of_rhythm = event.kind == "ectopic-run";
    const std::size_t begin = first_from(event.begin_s);
    std::map<perimap_SurfaceReason, double> said_s;
    for (std::size_t i = begin; i < surfaces_.size() && surfaces_[i].released_s < next_s; ++i) {
      if (wrong_[i] && surfaces_[i].released_s >= score_.begin_s) scored.wrong_while_good_s += shown_s(i);
      if (is_good(surfaces_[i]) || surfaces_[i].released_s >= told_until_s) continue;
      if (by_rhythm_[i] && !of_rhythm) continue;
      if (!scored.told_after_s) scored.told_after_s = surfaces_[i].released_s - event.begin_s;
      said_s[surfaces_[i].reason] += shown_s(i);
    }
    if (!said_s.empty()) {
      scored.cause = std::max_element(said_s.begin(), said_s.end(), [](const auto& a, const auto& b) {
                       return a.second < b.second;
                     })->first;
    }
    const EventCauses causes = causes_of(event.kind, event.hides);
    if (scored.cause || causes.must_be_told) {
      scored.right =
          scored.cause && std::find(causes.right.begin(), causes.right.end(), *scored.cause) != causes.right.end();
      ++score_.causes_judged;
      score_.causes_right += *scored.right ? 1 : 0;
    }
    scored.good_again_after_s = good_again(event, next_s);
    const double within_s = event.kind == "withdrawn" ? kAfterWithdrawal_s : kAfter_s;
    const double left_s = std::min(next_s, surfaces_.back().released_s) - event.end_s;
    if (scored.good_again_after_s || left_s >= within_s + kStays_s) {
      ++score_.events_to_recover;
      score_.events_recovered += scored.good_again_after_s && *scored.good_again_after_s <= within_s ? 1 : 0;
    }
    score_.events.push_back(std::move(scored));
  }

  [[nodiscard]] std::optional<double> good_again(const ProcedureSpan& event, double next_s) const noexcept {
    constexpr double kBefore_s = 5.0;
    std::uint32_t before = 0;
    for (std::size_t i = first_from(event.begin_s - kBefore_s); i < first_from(event.begin_s); ++i) {
      before = std::max(before, surfaces_[i].good);
    }
    const auto usable = [&](std::size_t i) {
      return is_good(surfaces_[i]) && surfaces_[i].good > 0 && 2 * surfaces_[i].good >= before;
    };
    std::optional<double> since;
    for (std::size_t i = first_from(event.end_s); i < surfaces_.size() && surfaces_[i].released_s < next_s; ++i) {
      if (by_rhythm_[i]) continue;
      if (!usable(i)) {
        since.reset();
        continue;
      }
      if (!since) since = surfaces_[i].released_s;
      if (surfaces_[i].released_s - *since >= kStays_s) return *since - event.end_s;
    }
    return std::nullopt;
  }

  const std::vector<JudgedSurface>& surfaces_;
  const std::vector<ProcedureSpan>& events_;
  std::vector<bool> by_rhythm_;  // each surface: not good, and rightly so by an early beat
  std::vector<bool> wrong_;      // each surface: wrong while good
  ProcedureScore score_;
};

}  // namespace

double ProcedureScore::cause_accuracy() const noexcept {
  if (causes_judged == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(causes_right) / static_cast<double>(causes_judged);
}

double ProcedureScore::false_alarms_per_hour() const noexcept {
  return duration_s > 0.0 ? 3600.0 * static_cast<double>(false_alarms.size()) / duration_s : 0.0;
}

ProcedureScore score_procedure(const std::vector<JudgedSurface>& surfaces, const std::vector<ProcedureSpan>& events,
                               const std::vector<double>& r_peaks_s) {
  return Scoring(surfaces, events, r_peaks_s).score();
}

}  // namespace perimap

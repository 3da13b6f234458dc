#include "core/phase/recent_complexes.hpp"

#include <algorithm>
#include <chrono>

namespace perimap {

void RecentComplexes::note(const QrsCandidate& candidate, int cluster, bool learnt, Duration longest_pr,
                           QrsClusters& clusters) noexcept {
  const Seen* nearest = nullptr;
  for (Seen& seen : seen_) {
    if (!seen.waits_for_follower) continue;
    const Duration apart = candidate.time - seen.time;
    if (apart < settings_.pr_shortest || apart > longest_pr) continue;
    const double sharper = seen.cluster == cluster ? settings_.sharper_of_one_kind : settings_.as_sharp;
    if (candidate.sharpness < sharper * seen.sharpness) continue;
    clusters.followed(seen.cluster, true);
    seen.waits_for_follower = false;
    if (nearest == nullptr || seen.time > nearest->time) nearest = &seen;
  }
  clusters.preceded(cluster, nearest == nullptr ? -1 : nearest->cluster);
  seen_[static_cast<std::size_t>(next_)] = {candidate.time, candidate.sharpness, -10.0, cluster, learnt, true, true};
  next_ = (next_ + 1) % kSeen;
}

bool RecentComplexes::likely_at(Instant t) const noexcept {
  return std::any_of(seen_.begin(), seen_.end(), [&](const Seen& seen) {
    return seen.cluster >= 0 && seen.log_odds > 0.0 && std::chrono::abs(t - seen.time) < settings_.even;
  });
}

// Three intervals of one length: a fast heart, whose beats are no nearer to each other than to the next. A P wave, its
// QRS complex and the T wave may be as far apart, but the next P wave is not.
bool RecentComplexes::in_even_rhythm(Instant later, Duration apart) const noexcept {
  return likely_at(later - 2 * apart) && likely_at(later - 3 * apart);
}

void RecentComplexes::judge(double log_odds, bool at_first, QrsClusters& clusters) noexcept {
  Seen& newest = seen_[static_cast<std::size_t>((next_ + kSeen - 1) % kSeen)];
  newest.log_odds = log_odds;
  if (newest.cluster < 0 || log_odds <= 0.0) return;
  Seen* last = nullptr;
  for (Seen& seen : seen_) {
    const Duration apart = newest.time - seen.time;
    if (seen.cluster < 0 || seen.log_odds <= 0.0 || apart < settings_.pr_shortest || apart > settings_.rt_longest) {
      continue;
    }
    if (last == nullptr || seen.time > last->time) last = &seen;
  }
  if (last == nullptr || in_even_rhythm(newest.time, newest.time - last->time)) return;
  note_rival(*last, newest, at_first, clusters);
  note_rival(newest, *last, at_first, clusters);
}

void RecentComplexes::note_rival(Seen& of, const Seen& by, bool at_first, QrsClusters& clusters) const noexcept {
  if (by.log_odds < of.log_odds - settings_.rival_odds) return;
  const bool usual = clusters.beside(of.cluster, by.cluster, to_seconds(by.time - of.time),
                                     to_seconds(settings_.rival_scatter), at_first);
  if (!usual || !of.waits_for_rival) return;
  of.waits_for_rival = false;
  clusters.rivalled(of.cluster, true);
}

bool RecentComplexes::crowded(Duration longest) const noexcept {
  return std::any_of(seen_.begin(), seen_.end(), [&](const Seen& seen) {
    const Duration apart = newest().time - seen.time;
    return seen.learnt && seen.log_odds >= settings_.qrs_like && apart >= settings_.crowd_from && apart <= longest;
  });
}

double RecentComplexes::sharpest_before(Instant t) const noexcept {
  double sharpest = 0.0;
  for (const Seen& seen : seen_) {
    const Duration apart = t - seen.time;
    if (seen.cluster >= 0 && apart > settings_.t_wave_begins && apart < settings_.t_wave_ends) {
      sharpest = std::max(sharpest, seen.sharpness);
    }
  }
  return sharpest;
}

void RecentComplexes::expire(Instant now, QrsClusters& clusters) noexcept {
  for (Seen& seen : seen_) {
    const Duration age = now - seen.time;
    if (seen.waits_for_follower && age >= settings_.time_to_decide + settings_.pr_longest / 2) {
      clusters.followed(seen.cluster, false);
      seen.waits_for_follower = false;
    }
    if (seen.waits_for_rival && age >= settings_.rt_longest + settings_.time_if_known) {
      clusters.rivalled(seen.cluster, false);
      seen.waits_for_rival = false;
    }
  }
}

}  // namespace perimap

#include "core/phase/beat_decision.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perimap {
namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();  // log odds

}  // namespace

void BeatDecision::forget() noexcept {
  clusters_.clear();
  beats_.clear();
  rr_s_.clear();
  rhythm_ = {};
  rr_deviation_ = 0.05;
  beats_told_ = 0;
  changed_count_ = 0;
  disturbances_.clear();
  count_ = 0;
  has_last_ = has_sure_ = false;
}

void BeatDecision::fall_silent() noexcept {
  beats_.forget_size();
  told_since_silence_ = 0;
  as_before_ = false;
  hidden_ = true;
}

void BeatDecision::restart(Instant now) noexcept {
  count_ = 0;
  has_last_ = has_sure_ = false;
  since_ = now;
  complexes_.clear();
}

bool BeatDecision::learning(Instant now) const noexcept {
  if (beats_told_ == 0) return true;
  const double since_s = to_seconds(now - (has_last_ ? last_.time : since_));
  if (since_s <= settings_.silence_s || since_s <= settings_.silence_cycles * rhythm_.cycle_s) return false;
  // What hides the beats says nothing of them, unless it lasts for longer than it would.
  return !in_burst(now) || since_s > to_seconds(settings_.longer_than_bursts);
}

bool BeatDecision::in_burst(Instant now) const noexcept {
  if (!beats_.known() || !clusters_.any_settled()) return false;
  const bool beats_come = now - familiar_at_ < settings_.beats_come;
  return disturbances_.at(now) > (beats_come ? settings_.much_noise : settings_.burst);
}

bool BeatDecision::noisy(Instant now) const noexcept {
  if (disturbances_.near_to_beats(beats_) || disturbances_.at(now) > settings_.some_noise) return true;
  if (!overdue(now)) return false;
  const auto waits = waiting_.begin();
  return disturbances_.last_at() > familiar_at_ ||
         std::any_of(waits, waits + count_, [&](const Waiting& waiting) { return strange(waiting); });
}

void BeatDecision::consider(const QrsCandidate& candidate, Duration one_complex, Instant now) noexcept {
  if (candidate.shape.points == 0 || (has_last_ && candidate.time - last_.time < one_complex)) return;
  // Of two that are one complex the larger is its middle; the first, which was found by its shape, if they are alike.
  for (int i = 0; i < count_; ++i) {
    const QrsCandidate& other = waiting_[static_cast<std::size_t>(i)].candidate;
    const Duration apart = candidate.time - other.time;
    if (apart >= one_complex || -apart >= one_complex) continue;
    if (candidate.energy < settings_.larger * other.energy) return;
    remove(i--, 1);
  }
  if (count_ == BeatPath::kMost) {
    const auto least = std::min_element(waiting_.begin(), waiting_.end(), [](const Waiting& a, const Waiting& b) {
      return a.probability < b.probability;
    });
    refuse(*least);
    remove(static_cast<int>(least - waiting_.begin()), 1);
  }
  Waiting waiting;
  waiting.candidate = candidate;
  const ClusterMatch match = clusters_.nearest(candidate.shape, settings_.displaced, levels_.slope_noise_rms());
  waiting.correlation = match.correlation;
  waiting.gain = match.gain;
  waiting.cluster = match.correlation > 0.0 ? match.of : -1;
  const bool large = candidate.energy > settings_.cluster_of_quiet * levels_.quiet() &&
                     candidate.energy > settings_.cluster_of_top * levels_.top_energy();
  int learnt = -1;
  if (large) {
    const Surroundings around = in_burst(now)                                             ? Surroundings::kBurst
                                : disturbances_.at(candidate.time) < settings_.some_noise ? Surroundings::kCalm
                                                                                          : Surroundings::kDisturbed;
    learnt = clusters_.learn(candidate.shape, candidate.points_up, around, candidate.time);
    if (waiting.cluster >= 0 && learnt != waiting.cluster && !clusters_.recurs(waiting.cluster)) waiting.cluster = -1;
  }
  // What is too small to be learnt of, but like what recurs, is one of its kind: a P wave among larger ones.
  const bool of_a_kind = clusters_.recurs(waiting.cluster) && waiting.correlation >= settings_.familiar;
  const int kind = learnt < 0 && of_a_kind ? waiting.cluster : learnt;
  if (kind >= 0) {
    complexes_.note(candidate, kind, learnt >= 0, within_cycle(settings_.pr_longest, settings_.pr_of_cycle), clusters_);
  }
  waiting.sharpest_before = complexes_.sharpest_before(candidate.time);
  waiting.log_odds = by_itself(waiting);
  // What stands out too little to be believed says nothing of its kind.
  if (!lost_at_start(waiting)) clusters_.judged(learnt, waiting.log_odds);
  if (kind >= 0) {
    complexes_.judge(waiting.log_odds, candidate.time - since_ < settings_.longer_than_bursts, clusters_);
  }
  if (learnt >= 0) note_crowding(waiting);
  const bool too_large = beats_.known() && candidate.energy > settings_.too_large * beats_.energy();
  if (too_large && !clusters_.has_a_beats_shape(candidate.shape, settings_.very_familiar)) {
    disturbances_.note(candidate.time, 1.0);
  }
  // Where a step is large it is no beat, whatever follows; the lead may be off within the second.
  if (candidate.step > settings_.pure_step && strange(waiting)) {
    disturbances_.note(candidate.time, 1.0);
    waiting.noted = true;
  }
  int at = count_;
  while (at > 0 && waiting_[static_cast<std::size_t>(at - 1)].candidate.time > candidate.time) {
    waiting_[static_cast<std::size_t>(at)] = waiting_[static_cast<std::size_t>(at - 1)];
    --at;
  }
  waiting_[static_cast<std::size_t>(at)] = waiting;
  ++count_;
  weigh(now);
}

Duration BeatDecision::within_cycle(Duration longest, double share) const noexcept {
  if (rr_s_.count() == 0) return longest;
  return std::min(longest, from_seconds(share * std::min(rhythm_.cycle_s, rr_s_.mean())));
}

// Two complexes that each look like a QRS by themselves, closer than ventricles can contract: arcs, a loose cable.
void BeatDecision::note_crowding(const Waiting& waiting) noexcept {
  // Before any kind is settled a P wave looks like a QRS complex as well.
  if (waiting.log_odds < settings_.qrs_like || !clusters_.any_settled()) return;
  const Duration longest = within_cycle(settings_.crowd_to, settings_.crowd_of_cycle);
  if (complexes_.crowded(longest)) disturbances_.note(waiting.candidate.time, 0.7);
}

double BeatDecision::like(const Waiting& waiting) const noexcept {
  if (!clusters_.recurs(waiting.cluster)) return 0.0;
  // A beat may be small where no noise is, but a P or T wave is not suddenly large. And what recurs in bursts alone
  // speaks for no beat.
  const bool of_waves = clusters_.log_odds(waiting.cluster) < 0.0;
  if (!of_waves && !clusters_.settled(waiting.cluster)) return 0.0;
  const double small = std::pow(std::min(waiting.gain, 1.0), disturbances_.noisiness(beats_));
  return likeness(waiting.correlation, of_waves ? std::max(waiting.gain, 1.0) : small);
}

// It is of a kind that is known not to be a P wave, and no noise is near that the beat might be still to come after.
bool BeatDecision::followed_by_none(const Waiting& waiting) const noexcept {
  return waiting.disturbed <= settings_.some_noise && familiar(waiting) &&
         clusters_.followers_known(waiting.cluster) >= 3.0 &&
         clusters_.followers(waiting.cluster) < settings_.followed_by_chance;
}

// Noise that stands where a beat is due, or a beat: nobody can tell.
bool BeatDecision::unknown_in_noise(const Waiting& waiting) const noexcept {
  return clusters_.any_settled() && disturbances_.at(waiting.candidate.time) > settings_.burst && !familiar(waiting);
}

// Like a settled kind that looks like a QRS complex.
bool BeatDecision::of_settled_beats(const Waiting& waiting) const noexcept {
  return clusters_.settled(waiting.cluster) && waiting.correlation >= settings_.familiar &&
         clusters_.log_odds(waiting.cluster) > 0.0;
}

bool BeatDecision::familiar(const Waiting& waiting) const noexcept {
  return of_settled_beats(waiting) && !disturbances_.unlike_any_beat(waiting.candidate);
}

bool BeatDecision::strange(const Waiting& waiting) const noexcept {
  const bool another = waiting.correlation < settings_.familiar &&
                       !clusters_.has_a_beats_shape(waiting.candidate.shape, settings_.very_familiar);
  return beats_.known() && beats_.size(waiting.candidate) > settings_.size_of_disturbance &&
         disturbances_.stands_out(waiting.candidate, levels_.noise()) &&
         (another || (disturbances_.unlike_any_beat(waiting.candidate) && !of_known_kind(waiting)));
}

// Whatever the line about it does: a wave of a settled kind, as T waves are, and a beat of a kind that has recurred for
// longer than a burst lasts. A kind whose own members count as disturbances would never be seen in calm, nor settle.
bool BeatDecision::of_known_kind(const Waiting& waiting) const noexcept {
  if (waiting.correlation < settings_.familiar || !clusters_.recurs(waiting.cluster)) return false;
  const double log_odds = clusters_.log_odds(waiting.cluster);
  if (log_odds < 0.0) return clusters_.settled(waiting.cluster) && waiting.candidate.step <= settings_.pure_step;
  return log_odds > settings_.qrs_like && waiting.correlation >= settings_.very_familiar &&
         waiting.candidate.time - clusters_.born(waiting.cluster) > settings_.longer_than_bursts;
}

EvidenceOf<ComplexEvidence> BeatDecision::complex_evidence(const Waiting& waiting) const noexcept {
  ComplexContext context;
  context.top_energy = levels_.top_energy();
  context.top_sharpness = levels_.top_sharpness();
  context.quiet_energy = levels_.quiet();
  if (clusters_.recurs(waiting.cluster)) {
    // A P wave is one whether it is conducted or not.
    const double share = clusters_.leads(waiting.cluster) ? 1.0 : clusters_.followers(waiting.cluster);
    context.followed = likeness(waiting.correlation, std::max(waiting.gain, 1.0)) * share;
  }
  context.sharpest_before = waiting.sharpest_before;
  return evidence_of(waiting.candidate, context);
}

// Bare noise recurs as well as beats do, if not as exactly, and there is nothing yet to hold it against.
bool BeatDecision::lost_at_start(const Waiting& waiting) const noexcept {
  if (std::min(beats_told_, told_since_silence_) >= settings_.beats_at_start) return false;
  return !familiar(waiting) && waiting.correlation < settings_.exactly_alike &&
         !disturbances_.stands_out(waiting.candidate, levels_.quiet());
}

double BeatDecision::by_itself(const Waiting& waiting) const noexcept {
  if (lost_at_start(waiting)) return -settings_.most_odds;
  const auto evidence = complex_evidence(waiting);
  return std::clamp(log_odds(evidence, weights_.complex), -settings_.most_odds, settings_.most_odds);
}

void BeatDecision::weigh(Instant now) noexcept {
  evaluated_at_ = now;
  BeatContext context;
  context.any_recurs = clusters_.any_settled();
  const double in_noise = disturbances_.steady(beats_);
  for (int i = 0; i < count_; ++i) {
    Waiting& waiting = waiting_[static_cast<std::size_t>(i)];
    waiting.log_odds = by_itself(waiting);
    context.complex_log_odds = waiting.log_odds;
    context.like = like(waiting);
    context.gain = waiting.gain;
    context.cluster_log_odds = context.like > 0.0 ? clusters_.log_odds(waiting.cluster) : 0.0;
    waiting.disturbed = disturbances_.at(waiting.candidate.time);
    context.disturbed = std::max(waiting.disturbed, in_noise);
    context.strangers = 0.0;
    for (int k = 0; k < count_; ++k) {
      const Waiting& other = waiting_[static_cast<std::size_t>(k)];
      const Duration apart = other.candidate.time - waiting.candidate.time;
      if (k != i && apart < settings_.around && -apart < settings_.around && strange(other)) context.strangers += 1.0;
    }
    waiting.evidence = evidence_of(context);
  }
  path_.weigh(
      count_, [&](int before, int candidate) { return odds(before, candidate); },
      [&](int last) {
        if (last < 0 && !has_last_) return std::max(rhythm_.survival(to_seconds(now - since_)), settings_.unheard);
        const Instant from = last >= 0 ? waiting_[static_cast<std::size_t>(last)].candidate.time : last_.time;
        return rhythm_.survival(to_seconds(now - from) - 0.1);
      });
  for (int i = 0; i < count_; ++i) waiting_[static_cast<std::size_t>(i)].probability = path_.probability(i);
}

// With what it tells that the beat before was `last`.
double BeatDecision::odds_after(const QrsCandidate& last, const Waiting& waiting) const noexcept {
  if (waiting.candidate.time - last.time < settings_.refractory) return kNever;
  PairContext pair;
  pair.rr_s = to_seconds(waiting.candidate.time - last.time);
  pair.cycle_s = rhythm_.cycle_s > 0.0 ? rhythm_.cycle_s : 0.8;
  pair.log_rhythm = rhythm_.log_density(pair.rr_s);
  pair.disturbed = waiting.disturbed;
  pair.before_sharpness = last.sharpness;
  pair.sharpness = waiting.candidate.sharpness;
  EvidenceOf<BeatEvidence> evidence = waiting.evidence;
  add_pair(pair, evidence);
  return log_odds(evidence, weights_.beat);
}

double BeatDecision::odds(int before, int candidate) const noexcept {
  const Waiting& waiting = waiting_[static_cast<std::size_t>(candidate)];
  // The filters see a step where the line begins.
  if (waiting.candidate.time - since_ < settings_.begins && clusters_.any_recurs() &&
      (waiting.correlation < settings_.very_familiar || waiting.cluster < 0 ||
       clusters_.log_odds(waiting.cluster) < settings_.qrs_like)) {
    return kNever;
  }
  if (before >= 0) return odds_after(waiting_[static_cast<std::size_t>(before)].candidate, waiting);
  if (!has_last_) return log_odds(waiting.evidence, weights_.beat);
  const double after = odds_after(last_, waiting);
  // What was told with doubt may have been a P wave. What is like the beats is then weighed after the one before, too;
  // but a second maximum of one wide complex is no beat in either case.
  const bool apart = waiting.candidate.time - last_.time >= settings_.crowd_from;
  if (last_probability_ > settings_.sure || !has_sure_ || !apart || !familiar(waiting)) return after;
  return std::log(last_probability_ * std::exp(after) +
                  (1.0 - last_probability_) * std::exp(odds_after(sure_, waiting)));
}

// It is a beat, and what comes after it would hardly change that.
bool BeatDecision::known(const Waiting& waiting, Instant now, bool ending) const noexcept {
  const Duration age = now - waiting.candidate.time;
  if (age < settings_.cut_off && waiting.probability < settings_.certain) return false;
  const bool starting = beats_told_ < settings_.beats_at_start && !familiar(waiting);
  // While there is nothing to hold it against, what is no beat by itself is none because one is due: it may be a P wave
  // that is not conducted.
  if (starting && waiting.log_odds < -settings_.sure_by_itself) return false;
  const bool stranger = clusters_.any_settled() && !familiar(waiting);
  const bool may_be_followed = clusters_.followers(waiting.cluster) >= settings_.followed_by_chance;
  if (!starting && !stranger && !may_be_followed && waiting.probability >= settings_.sure &&
      waiting.log_odds >= settings_.sure_by_itself) {
    return true;
  }
  const bool new_one = !clusters_.recurs(waiting.cluster) || waiting.correlation < settings_.familiar;
  const bool early = waiting.disturbed <= settings_.some_noise && has_last_ &&
                     to_seconds(waiting.candidate.time - last_.time) < settings_.before_due * rhythm_.cycle_s;
  const Duration beside = new_one && !early ? settings_.time_of_strangers : settings_.time_if_known;
  if (!starting && stranger && waiting.probability >= settings_.sure && age >= beside) return true;
  const Duration time = starting                    ? settings_.time_at_start
                        : followed_by_none(waiting) ? settings_.time_if_known
                                                    : settings_.time_to_decide;
  return (ending || age >= time) && waiting.probability > settings_.more_likely;
}

void BeatDecision::decide(Instant now, bool ending) noexcept {
  complexes_.expire(now, clusters_);
  hidden_ = hidden_ || in_burst(now);
  if (count_ == 0) return;
  if (now - evaluated_at_ >= settings_.evaluate_every || ending) weigh(now);
  for (bool again = true; again && count_ > 0;) {
    again = false;
    for (int i = 0; i < count_; ++i) {
      if (!known(waiting_[static_cast<std::size_t>(i)], now, ending)) continue;
      accept(i, now);
      again = true;
      break;
    }
  }
  while (count_ > 0 && (ending || now - waiting_[0].candidate.time > settings_.too_late)) {
    refuse(waiting_[0]);
    remove(0, 1);
  }
}

// Those before it that are beats, given that it is one, are told first.
void BeatDecision::accept(int index, Instant now) noexcept {
  const Waiting accepted = waiting_[static_cast<std::size_t>(index)];
  BeatPath before;
  before.weigh(
      index, [&](int b, int c) { return odds(b, c); }, [&](int last) { return std::exp(odds(last, index)); });
  for (int i = 0; i < index; ++i) {
    Waiting& waiting = waiting_[static_cast<std::size_t>(i)];
    if (before.probability(i) > settings_.more_likely) {
      waiting.probability = before.probability(i);
      tell(waiting, now);
    } else {
      refuse(waiting);
    }
  }
  tell(accepted, now);
  remove(0, index + 1);
  weigh(now);
}

void BeatDecision::refuse(const Waiting& waiting) noexcept {
  if (strange(waiting) && !waiting.noted) disturbances_.note(waiting.candidate.time, 1.0);
}

BeatCircumstances BeatDecision::circumstances(const Waiting& waiting, bool familiar, Instant now) const noexcept {
  BeatCircumstances beat;
  beat.probability = waiting.probability;
  beat.correlation = waiting.correlation;
  beat.gain = waiting.gain;
  if (has_last_ && rhythm_.cycle_s > 0.0) {
    beat.of_cycle = to_seconds(waiting.candidate.time - last_.time) / rhythm_.cycle_s;
  }
  beat.usual_of_cycle = std::min(std::exp(clusters_.log_of_cycle(waiting.cluster)), 1.0);
  beat.spread = rhythm_.spread;
  beat.disturbed = disturbances_.at(now);
  beat.familiar = familiar;
  beat.long_known = familiar && now - clusters_.born(waiting.cluster) > settings_.longer_than_bursts;
  beat.any_known = clusters_.any_recurs();
  beat.heard_for_long = now - since_ > settings_.longer_than_bursts;
  beat.unlike_any_beat = disturbances_.unlike_any_beat(waiting.candidate);
  beat.may_be_followed = clusters_.followers(waiting.cluster) >= settings_.followed_by_chance;
  beat.rivalled = clusters_.rivals(waiting.cluster) >= settings_.rivalled;
  beat.in_steady_noise = disturbances_.near_to_beats(beats_);
  beat.lost_in_noise = unknown_in_noise(waiting);
  return beat;
}

// Beats in a row that are alike, and of no kind known from before: the gain or the conduction has changed, or the
// electrodes sit elsewhere. They are the usual beats from now on.
void BeatDecision::follow_change(const Waiting& waiting, bool familiar) noexcept {
  const bool alike = !familiar && clusters_.recurs(waiting.cluster) && waiting.correlation >= settings_.familiar &&
                     !disturbances_.unlike_any_beat(waiting.candidate);
  changed_count_ = !alike ? 0 : waiting.cluster == changed_to_ ? changed_count_ + 1 : 1;
  changed_to_ = waiting.cluster;
  if (changed_count_ < settings_.changed_after) return;
  changed_count_ = 0;
  clusters_.settle(waiting.cluster);
  beats_.forget_size();
  disturbances_.clear();
}

// What is told in a beat's place may be something else: like no kind, and in noise, where the line stays away, or more
// likely none by itself.
bool BeatDecision::anywhere(const Waiting& waiting) const noexcept {
  if (unknown_in_noise(waiting)) return true;
  if (!clusters_.any_settled() || familiar(waiting) || of_known_kind(waiting)) return false;
  return disturbances_.unlike_any_beat(waiting.candidate) || waiting.log_odds < 0.0;
}

// A complex has its R peak where its kind has, but one that is not exactly like it where its largest wave is. In noise,
// where what is largest is often no heart's, it is the wave that points as the beats do and is as large.
QrsWave BeatDecision::r_wave(const Waiting& waiting) const noexcept {
  const QrsCandidate& candidate = waiting.candidate;
  const QrsWave own{candidate.time, candidate.deviation, candidate.peak_mV};
  const bool lost = unknown_in_noise(waiting);
  const QrsWave& other = lost ? candidate.upright : candidate.larger;
  const double least_mV =
      lost ? settings_.height_of_beat * beats_.height() : settings_.larger_wave * std::abs(candidate.peak_mV);
  const bool exact = waiting.correlation >= settings_.exactly_alike && clusters_.recurs(waiting.cluster);
  if (exact && !lost) return own;
  if (other.mV == 0.0 || std::abs(other.mV) < least_mV) return own;
  return has_last_ && other.time - last_.time < settings_.refractory ? own : other;
}

void BeatDecision::tell(const Waiting& waiting, Instant now) noexcept {
  const QrsCandidate& candidate = waiting.candidate;
  const bool familiar = this->familiar(waiting);
  follow_change(waiting, familiar);
  const bool learnt = waiting.probability >= settings_.learnt;
  if (familiar || !beats_.known() || (learnt && !clusters_.any_recurs())) beats_.learn(candidate);
  beats_.turn(candidate, settings_);

  RPeak peak;
  const QrsWave r = r_wave(waiting);
  peak.time = r.time;
  peak.shape = candidate.shape;
  peak.deviation = anywhere(waiting) ? from_seconds(settings_.doubtful_deviation_s) : r.deviation;
  peak.confidence = confidence(circumstances(waiting, familiar, now), settings_);
  if (strange(waiting) && !waiting.noted) disturbances_.note(candidate.time, 0.5);
  if (familiar) familiar_at_ = candidate.time;
  as_before_ = as_before_ || (familiar && std::abs(std::log(waiting.gain)) < settings_.same_gain);
  if (peak.time <= now && queue_count_ < kQueue) {
    peak.detected_at = now;
    queue_[static_cast<std::size_t>((queue_begin_ + queue_count_) % kQueue)] = peak;
    ++queue_count_;
  }
  learn_rhythm(waiting);
  has_sure_ = has_sure_ || (has_last_ && last_probability_ > settings_.sure);
  if (has_last_ && last_probability_ > settings_.sure) sure_ = last_;
  last_ = candidate;
  last_probability_ = waiting.probability;
  has_last_ = true;
  hidden_ = false;
  ++beats_told_;
  ++told_since_silence_;
}

void BeatDecision::learn_rhythm(const Waiting& waiting) noexcept {
  if (!has_last_ || hidden_ || std::min(waiting.probability, last_probability_) < settings_.learnt) return;
  const double rr_s = to_seconds(waiting.candidate.time - last_.time);
  if (rhythm_.cycle_s > 0.0) {
    const double log_of_cycle = std::log(rr_s / rhythm_.cycle_s);
    rr_deviation_ += (std::min(std::abs(log_of_cycle), 0.7) - rr_deviation_) / 12.0;
    if (familiar(waiting)) clusters_.came(waiting.cluster, log_of_cycle);
  }
  rr_s_.push(rr_s);
  const double usual_s = rr_s_.count() < 8 ? std::max(rr_s_.median(), rr_s_.mean_of_last_two()) : rr_s_.median();
  rhythm_.cycle_s = std::min(usual_s, settings_.slowest_cycle_s);
  rhythm_.spread = std::clamp(1.25 * rr_deviation_, 0.06, 0.4);
}

void BeatDecision::remove(int index, int count) noexcept {
  std::copy(waiting_.begin() + index + count, waiting_.begin() + count_, waiting_.begin() + index);
  count_ -= count;
}

Pondered BeatDecision::ponders(Instant t, Duration near) const noexcept {
  Pondered pondered = Pondered::kNothing;
  for (int i = 0; i < count_; ++i) {
    const Waiting& waiting = waiting_[static_cast<std::size_t>(i)];
    const Duration apart = waiting.candidate.time - t;
    if (apart >= near || -apart >= near || waiting.probability <= settings_.more_likely) continue;
    if (of_settled_beats(waiting)) return Pondered::kBeat;
    pondered = Pondered::kStranger;
  }
  return pondered;
}

std::optional<RPeak> BeatDecision::pop() noexcept {
  if (queue_count_ == 0) return std::nullopt;
  const RPeak peak = queue_[static_cast<std::size_t>(queue_begin_)];
  queue_begin_ = (queue_begin_ + 1) % kQueue;
  --queue_count_;
  return peak;
}

}  // namespace perimap

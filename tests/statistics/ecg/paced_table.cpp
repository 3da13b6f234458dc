// Paced hearts with ventricular premature beats: none of the records is paced.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "core/phase/beat_finder.hpp"
#include "core/statistics/nearest_pairs.hpp"
#include "tables.hpp"

namespace perimap::test {
namespace {

constexpr double kMatch_s = 0.15;
constexpr double kDuration_s = 300.0;
constexpr double kLeast = 0.9;  // sensitivity, and precision where all other beats are paced
constexpr double kLeastAmongOwn =
    0.75;  // precision where some are the heart's own: what one draw after another kept to
constexpr double kMostWrongBeats = 0.01;  // missed or false

enum class Origin { kPaced, kOwn, kFused, kVentricular };

struct PacedBeat {
  double at_s = 0.0;  // of the R peak
  Origin origin = Origin::kPaced;
};

struct PacedLead {
  double rate_hz = 360.0;
  std::vector<double> mV;
  std::vector<PacedBeat> beats;
};

// A QRS complex and its T wave: bells, beside the R peak.
struct Bell {
  double after_s = 0.0;
  double height_mV = 0.0;
  double sigma_s = 0.0;
};
using Complex = std::array<Bell, 4>;

class PacedHeart {
 public:
  // `conducts`: at times the heart's own beats come before the pacemaker's, which then keeps still.
  PacedHeart(std::uint64_t seed, bool conducts) : conducts_(conducts), generator_(seed) {}

  PacedLead draw() {
    constexpr std::array<double, 4> kRates{125.0, 250.0, 360.0, 500.0};
    lead_ = {};
    lead_.rate_hz = kRates[static_cast<std::size_t>(uniform(0.0, 3.999))];
    lead_.mV.assign(static_cast<std::size_t>(kDuration_s * lead_.rate_hz), 0.0);
    const double sign = uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    const Complex paced = complex(sign, 0.14, 0.18);
    // Ventricular beats come from elsewhere than the electrode: of the other polarity in two thirds of the patients.
    const Complex ectopic = complex(uniform(0.0, 1.0) < 0.67 ? -sign : sign, 0.12, 0.2);
    const double cycle_s = 60.0 / uniform(55.0, 90.0);
    const double coupling = uniform(0.45, 0.75);
    const double share = uniform(0.02, 0.15);
    // P waves before, which it follows. What gives way to the heart's own beats paces the ventricles alone.
    const bool dual = uniform(0.0, 1.0) < 0.5 && !conducts_;
    const double spike_mV = uniform(0.5, 4.0) * (uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0);
    const double jitter = dual ? uniform(0.01, 0.04) : 0.002;
    const OwnRhythm own = conducts_ ? draw_own(cycle_s) : OwnRhythm{};
    int in_a_row = 0;
    Origin origin = Origin::kPaced;
    int own_left = 0;
    for (double at_s = 0.6; at_s < kDuration_s - 0.5;) {
      if (origin != Origin::kOwn) {
        add(at_s, paced, origin == Origin::kFused ? 0.5 : 1.0);
        add_spike(at_s - 0.06, spike_mV);
      }
      if (origin != Origin::kPaced) add(at_s, own.complex, origin == Origin::kFused ? 0.5 : 1.0);
      if (dual || (origin != Origin::kPaced && !own.fibrillates)) add(at_s - 0.2, {Bell{0.0, 0.12, 0.02}});
      lead_.beats.push_back({at_s, origin});
      double next_s = at_s + cycle_s * (1.0 + jitter * normal());
      origin = Origin::kPaced;
      if (conducts_ && own_left == 0 && uniform(0.0, 1.0) < own.begins) own_left = static_cast<int>(uniform(1.0, 12.0));
      if (own_left > 0) {
        --own_left;
        const double own_s = at_s + next_interval(own);
        // Where both come within 40 ms either has a part of the ventricles.
        if (own_s < next_s + 0.02) origin = own_s < next_s - 0.02 ? Origin::kOwn : Origin::kFused;
        if (origin == Origin::kOwn) next_s = own_s;
      }
      // One or two, and the pacemaker begins anew with the last.
      while (uniform(0.0, 1.0) < (in_a_row == 0 ? share : 0.1) && in_a_row < 2) {
        const double ectopic_s = at_s + coupling * cycle_s * (1.0 + 0.04 * normal());
        if (ectopic_s > kDuration_s - 0.5) break;
        add(ectopic_s, ectopic);
        lead_.beats.push_back({ectopic_s, Origin::kVentricular});
        at_s = ectopic_s;
        next_s = ectopic_s + cycle_s;
        origin = Origin::kPaced;
        ++in_a_row;
      }
      in_a_row = 0;
      at_s = next_s;
    }
    const double noise_mV = uniform(0.005, 0.04);
    for (std::size_t i = 0; i < lead_.mV.size(); ++i) {
      lead_.mV[i] += noise_mV * normal() + 0.05 * std::sin(1.6 * static_cast<double>(i) / lead_.rate_hz);
    }
    return lead_;
  }

 private:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(generator_); }
  double normal() { return std::normal_distribution<double>(0.0, 1.0)(generator_); }

  // R, a notch or shoulder beside it, S, and a T wave of the other sign, as in complexes that ventricles conduct.
  Complex complex(double sign, double narrowest_s, double widest_s) {
    const double sigma_s = uniform(narrowest_s, widest_s) / 7.5;
    const double size = sign * uniform(0.6, 1.8);
    return {Bell{0.0, size, sigma_s}, Bell{uniform(1.2, 2.2) * sigma_s, uniform(-0.3, 0.45) * size, 0.8 * sigma_s},
            Bell{-uniform(1.8, 2.6) * sigma_s, uniform(-0.3, 0.1) * size, 0.9 * sigma_s},
            Bell{uniform(0.26, 0.32), -uniform(0.2, 0.5) * size, uniform(0.04, 0.06)}};
  }

  // The heart's own beats are narrow, and come by a rhythm that is a little faster than the pacemaker's, or by none.
  struct OwnRhythm {
    Complex complex{};
    bool fibrillates = false;
    double cycle_s = 0.0;
    double begins = 0.0;  // probability, at any beat
  };
  OwnRhythm draw_own(double paced_cycle_s) {
    OwnRhythm own;
    own.complex = complex(uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0, 0.07, 0.11);
    own.fibrillates = uniform(0.0, 1.0) < 0.4;
    own.cycle_s = paced_cycle_s * uniform(0.8, 1.0);
    own.begins = uniform(0.005, 0.04);
    return own;
  }
  double next_interval(const OwnRhythm& own) {
    return own.cycle_s * (own.fibrillates ? uniform(0.65, 1.15) : 1.0 + 0.03 * normal());
  }

  void add(double at_s, const auto& bells, double share = 1.0) {
    const double scale = share * (1.0 + 0.03 * normal());
    for (const Bell& bell : bells) {
      if (bell.sigma_s <= 0.0) continue;
      const double middle_s = at_s + bell.after_s;
      const auto begin = static_cast<long>((middle_s - 5.0 * bell.sigma_s) * lead_.rate_hz);
      const auto end = static_cast<long>((middle_s + 5.0 * bell.sigma_s) * lead_.rate_hz);
      for (long i = std::max(begin, 0L); i <= std::min(end, static_cast<long>(lead_.mV.size()) - 1); ++i) {
        const double x = (static_cast<double>(i) / lead_.rate_hz - middle_s) / bell.sigma_s;
        lead_.mV[static_cast<std::size_t>(i)] += scale * bell.height_mV * std::exp(-0.5 * x * x);
      }
    }
  }
  void add(double at_s, std::initializer_list<Bell> bells) { add(at_s, std::vector<Bell>(bells)); }

  // 2 ms, of which a slower converter takes the mean over a sample.
  void add_spike(double at_s, double height_mV) {
    const auto begin = static_cast<long>(at_s * lead_.rate_hz);
    const auto width = std::max(1L, static_cast<long>(0.002 * lead_.rate_hz));
    for (long i = begin; i < begin + width; ++i) {
      if (i < 0) continue;
      lead_.mV[static_cast<std::size_t>(i)] += height_mV * std::min(1.0, 0.002 * lead_.rate_hz);
    }
  }

  bool conducts_;
  std::mt19937_64 generator_;
  PacedLead lead_;
};

// Whether the detector and the classer keep to their bounds.
bool print_row(const char* name, bool conducts, int draws, std::uint64_t seed) {
  PacedHeart heart(seed, conducts);
  int beats = 0;
  int missed = 0;
  int extra = 0;
  int ventricular = 0;
  int hits = 0;
  int false_ones = 0;
  int below_sensitivity = 0;
  int below_precision = 0;
  for (int draw = 0; draw < draws; ++draw) {
    const PacedLead lead = heart.draw();
    BeatFinder finder;
    std::vector<RPeak> peaks;
    for (std::size_t i = 0; i < lead.mV.size(); ++i) {
      const Instant t(from_seconds(static_cast<double>(i) / lead.rate_hz));
      if (const auto peak = finder.push(t, static_cast<float>(lead.mV[i]))) peaks.push_back(*peak);
    }
    while (const auto peak = finder.flush()) peaks.push_back(*peak);
    std::vector<double> beats_s;
    std::vector<double> told_s;
    for (const PacedBeat& beat : lead.beats) beats_s.push_back(beat.at_s);
    for (const RPeak& peak : peaks) told_s.push_back(to_seconds(peak.time.time_since_epoch()));
    const std::vector<int> matched = nearest_pairs(beats_s, told_s, kMatch_s);
    std::vector<std::optional<Origin>> origins(peaks.size());
    int of_lead = 0;
    int found = 0;
    for (std::size_t i = 0; i < matched.size(); ++i) {
      of_lead += lead.beats[i].origin == Origin::kVentricular ? 1 : 0;
      found += matched[i] >= 0 ? 1 : 0;
      if (matched[i] >= 0) origins[static_cast<std::size_t>(matched[i])] = lead.beats[i].origin;
    }
    int hits_here = 0;
    int false_here = 0;
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      // Fused beats count neither way, as in records.
      if (peaks[i].beat_class != BeatClass::kPremature || origins[i] == Origin::kFused) continue;
      (origins[i] == Origin::kVentricular ? hits_here : false_here) += 1;
    }
    beats += static_cast<int>(lead.beats.size());
    missed += static_cast<int>(lead.beats.size()) - found;
    extra += static_cast<int>(peaks.size()) - found;
    ventricular += of_lead;
    hits += hits_here;
    false_ones += false_here;
    const bool insensitive = hits_here < 0.9 * of_lead;
    const bool imprecise = hits_here < 0.9 * (hits_here + false_here);
    below_sensitivity += insensitive ? 1 : 0;
    below_precision += imprecise ? 1 : 0;
    if (insensitive || imprecise) {
      fmt::print(stderr, "{}, lead {}: {} of {} found, {} false\n", name, draw, hits_here, of_lead, false_here);
    }
  }
  fmt::print("| {} | {} | {} | {:.2f} / {:.2f} | {} | {:.1f} | {:.1f} | {} / {} |\n", name, draws, beats,
             100.0 * missed / std::max(beats, 1), 100.0 * extra / std::max(beats, 1), ventricular,
             100.0 * hits / std::max(ventricular, 1), 100.0 * hits / std::max(hits + false_ones, 1), below_sensitivity,
             below_precision);
  return missed + extra <= kMostWrongBeats * beats && hits >= kLeast * ventricular &&
         hits >= (conducts ? kLeastAmongOwn : kLeast) * (hits + false_ones);
}

}  // namespace

bool print_paced(int draws, std::uint64_t seed) {
  fmt::print(
      "| hearts | leads | beats | missed / false, % | ventricular | sensitivity, % | precision, % | leads below 90 % "
      "in "
      "one / the other |\n|---|---|---|---|---|---|---|---|\n");
  const bool always = print_row("paced always", false, draws, seed);
  const bool at_times = print_row("with beats of their own", true, draws, seed);
  return always && at_times;
}

}  // namespace perimap::test

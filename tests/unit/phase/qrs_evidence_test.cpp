#include "core/phase/qrs_evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

namespace perimap {
namespace {

// As the largest of late, well above the quiet level.
QrsCandidate usual() {
  QrsCandidate candidate;
  candidate.energy = 1.0;
  candidate.sharpness = 1.0;
  candidate.upward = 1.0;
  return candidate;
}
ComplexContext usual_context() {
  ComplexContext context;
  context.top_energy = 1.0;
  context.top_sharpness = 1.0;
  context.quiet_energy = 0.02;
  return context;
}
double by_itself(const QrsCandidate& candidate, const ComplexContext& context = usual_context()) {
  return log_odds(evidence_of(candidate, context), kFittedWeights.complex);
}

TEST(ComplexEvidence, OneLikeTheLargestIsTakenForAQrs) { EXPECT_GT(by_itself(usual()), 2.0); }

TEST(ComplexEvidence, ABluntOneIsNot) {
  QrsCandidate t_wave = usual();
  t_wave.sharpness = 0.15;
  EXPECT_LT(by_itself(t_wave), 0.0);
}

TEST(ComplexEvidence, ASmallOneIsLessLikelyThanALargeOne) {
  QrsCandidate small = usual();
  small.energy = small.sharpness = 0.4;
  QrsCandidate smaller = usual();
  smaller.energy = smaller.sharpness = 0.1;
  EXPECT_LT(by_itself(small), by_itself(usual()) - 1.0);
  EXPECT_LT(by_itself(smaller), -3.0);
}

TEST(ComplexEvidence, AFarLargerOneIsLessLikely) {
  QrsCandidate arc = usual();
  arc.energy = arc.sharpness = 8.0;
  EXPECT_LT(by_itself(arc), by_itself(usual()) - 2.0);
}

TEST(ComplexEvidence, OneThatIsMostlyFollowedByASharperOneIsAPWave) {
  ComplexContext context = usual_context();
  context.followed = 0.95;
  EXPECT_LT(by_itself(usual(), context), -2.0);
  context.followed = 0.2;
  EXPECT_EQ(by_itself(usual(), context), by_itself(usual())) << "so many are followed by chance";
}

TEST(ComplexEvidence, StepsAndRoughLinesCountAgainstIt) {
  QrsCandidate step = usual();
  step.step = 1.0;
  QrsCandidate rough = usual();
  rough.rough = 1.0;
  EXPECT_LT(by_itself(step), by_itself(usual()) - 0.8);
  EXPECT_LT(by_itself(rough), by_itself(usual()) - 0.8);
}

TEST(ComplexEvidence, ALineWithoutNoiseIsAsQuietAsCanBe) {
  ComplexContext context = usual_context();
  context.quiet_energy = 0.0;
  EXPECT_GE(by_itself(usual(), context), by_itself(usual()));
}

TEST(Likeness, FallsWithTheShapeAndWithTheSize) {
  EXPECT_EQ(likeness(1.0, 1.0), 1.0);
  EXPECT_EQ(likeness(1.0, 1.3), 1.0);
  EXPECT_EQ(likeness(0.5, 1.0), 0.0);
  EXPECT_EQ(likeness(1.0, 2.2), 0.0);
  EXPECT_GT(likeness(0.9, 1.0), likeness(0.8, 1.0));
  EXPECT_GT(likeness(0.9, 1.4), likeness(0.9, 1.7));
}

TEST(BeatEvidence, ATWaveFollowsAsOneDoesAndIsBlunter) {
  PairContext pair;
  pair.rr_s = 0.3;
  pair.cycle_s = 0.8;
  pair.before_sharpness = 1.0;
  pair.sharpness = 0.3;
  EvidenceOf<BeatEvidence> soon{};
  add_pair(pair, soon);
  EXPECT_GT(part(soon, BeatEvidence::kTWave), 1.0);
  pair.rr_s = 0.6;
  EvidenceOf<BeatEvidence> late{};
  add_pair(pair, late);
  EXPECT_EQ(part(late, BeatEvidence::kTWave), 0.0);
}

TEST(BeatEvidence, WhatASharperOneFollowsAtOnceWasAPWave) {
  PairContext pair;
  pair.rr_s = 0.16;
  pair.cycle_s = 0.8;
  pair.before_sharpness = 0.5;
  pair.sharpness = 1.0;
  EvidenceOf<BeatEvidence> evidence{};
  add_pair(pair, evidence);
  EXPECT_GT(part(evidence, BeatEvidence::kBeforeSharper), 0.5);
}

TEST(BeatEvidence, RhythmCountsMoreAmongDisturbances) {
  PairContext pair;
  pair.rr_s = 0.8;
  pair.cycle_s = 0.8;
  pair.log_rhythm = -2.0;
  EvidenceOf<BeatEvidence> calm{};
  add_pair(pair, calm);
  pair.disturbed = 2.0;
  EvidenceOf<BeatEvidence> disturbed{};
  add_pair(pair, disturbed);
  EXPECT_LT(log_odds(disturbed, kFittedWeights.beat), log_odds(calm, kFittedWeights.beat));
}

TEST(BeatEvidence, AStrangerCountsAgainstABeatAndTheMoreSoAmongOthers) {
  BeatContext context;
  context.complex_log_odds = 2.0;
  context.any_recurs = true;
  context.like = 1.0;
  context.cluster_log_odds = 2.0;
  const double familiar = log_odds(evidence_of(context), kFittedWeights.beat);
  context.like = 0.0;
  const double strange = log_odds(evidence_of(context), kFittedWeights.beat);
  context.disturbed = 2.0;
  context.strangers = 2.0;
  const double in_noise = log_odds(evidence_of(context), kFittedWeights.beat);
  EXPECT_LT(strange, familiar - 1.5);
  EXPECT_LT(in_noise, strange - 1.0);
}

// ---- what each piece is worth: natural units of log odds, by which the weights were set on the development records.
// Each changes one thing in a complex or a beat that has all for it.

struct Worth {
  const char* name;
  std::function<void(QrsCandidate&, ComplexContext&)> change;
  double log_odds;
};

TEST(ComplexEvidence, IsWorthWhatTheRecordsSay) {
  const double half = std::log(2.0);
  const double tenth = std::log(10.0);
  const Worth all[] = {
      {"half as sharp", [](auto& c, auto&) { c.sharpness = 0.5; }, -1.1 * half - 0.5 * half},
      {"a tenth as sharp: blunter than any ectopic beat", [](auto& c, auto&) { c.sharpness = 0.1; },
       -1.1 * tenth - 1.75 * (tenth - 1.1) - 0.5 * 2.0},
      {"five times as sharp: more than the patient's beats differ", [](auto& c, auto&) { c.sharpness = 5.0; },
       -1.2 * (std::log(5.0) - 0.7)},
      {"half the energy", [](auto& c, auto&) { c.energy = 0.5; }, -1.0 * half},
      {"a tenth of the energy", [](auto& c, auto&) { c.energy = 0.1; },
       -1.0 * tenth - 1.35 * (tenth - 1.1) - 0.33 * (std::log(1.0 / 0.02) > 3.0 ? 3.0 - std::log(5.0) : tenth)},
      {"five times the energy", [](auto& c, auto&) { c.energy = 5.0; },
       -1.2 * (std::log(5.0) - 0.7) - 0.5 * std::log(5.0)},
      {"hardly above the quiet level", [](auto&, auto& k) { k.quiet_energy = 0.9; },
       0.33 * (std::log(1.0 / 0.9) - 3.0)},
      {"another level after it", [](auto& c, auto&) { c.step = 0.7; }, -0.7 * 1.2},
      {"another level by nearly its height", [](auto& c, auto&) { c.step = 0.9; }, -0.9 * 1.2 - 0.5 * 4.0},
      {"no way back at all", [](auto& c, auto&) { c.step = 1.0; }, -1.2 - 4.0},
      {"as rough as it is large", [](auto& c, auto&) { c.rough = 1.0; }, -1.4 * half},
      {"mostly followed by a sharper one", [](auto&, auto& k) { k.followed = 0.65; }, -7.0 * 0.5},
      {"after one twice as sharp", [](auto&, auto& k) { k.sharpest_before = 2.0; }, -1.0 * half},
  };
  const double usual_one = by_itself(usual());
  EXPECT_NEAR(usual_one, 2.7 + 0.33 * 3.0, 0.3);
  for (const Worth& worth : all) {
    QrsCandidate candidate = usual();
    ComplexContext context = usual_context();
    worth.change(candidate, context);
    EXPECT_NEAR(by_itself(candidate, context) - usual_one, worth.log_odds, 0.12 * std::abs(worth.log_odds))
        << worth.name;
  }
}

TEST(ComplexEvidence, LittleMoreOrLessCountsNeitherWay) {
  EvidenceOf<ComplexEvidence> v{};
  const auto see = [&](double sharpness, double energy) {
    QrsCandidate candidate = usual();
    candidate.sharpness = sharpness;
    candidate.energy = energy;
    v = evidence_of(candidate, usual_context());
  };
  see(1.75, 1.75);
  EXPECT_EQ(part(v, ComplexEvidence::kSharper), 0.0) << "beats of one patient differ by a factor of two";
  EXPECT_EQ(part(v, ComplexEvidence::kMoreEnergy), 0.0);
  see(2.4, 2.4);
  EXPECT_GT(part(v, ComplexEvidence::kSharper), 0.0);
  EXPECT_GT(part(v, ComplexEvidence::kMoreEnergy), 0.0);
  see(0.40, 0.40);
  EXPECT_EQ(part(v, ComplexEvidence::kBlunt), 0.0) << "ectopic beats are less by up to a third";
  EXPECT_EQ(part(v, ComplexEvidence::kWeak), 0.0);
  see(0.27, 0.27);
  EXPECT_GT(part(v, ComplexEvidence::kBlunt), 0.0);
  EXPECT_GT(part(v, ComplexEvidence::kWeak), 0.0);
  see(1e-6, 1e-6);
  EXPECT_NEAR(part(v, ComplexEvidence::kLessSharp), 3.0, 0.1) << "no factor beyond twenty says more";
}

TEST(ComplexEvidence, SoManyAreFollowedByASharperOneByChance) {
  ComplexContext context = usual_context();
  const auto followed = [&](double share) {
    context.followed = share;
    auto evidence = evidence_of(usual(), context);
    return part(evidence, ComplexEvidence::kFollowed);
  };
  EXPECT_EQ(followed(0.27), 0.0);
  EXPECT_GT(followed(0.35), 0.03);
  EXPECT_NEAR(followed(1.0), 1.0, 1e-12);
}

TEST(Likeness, IsThatOfOneKindFromNoNoiseToTwiceTheSize) {
  EXPECT_EQ(likeness(0.58, 1.0), 0.0);
  EXPECT_GT(likeness(0.65, 1.0), 0.05);
  EXPECT_LT(likeness(0.90, 1.0), 0.95);
  EXPECT_EQ(likeness(0.96, 1.0), 1.0);
  EXPECT_EQ(likeness(1.0, std::exp(0.27)), 1.0);
  EXPECT_LT(likeness(1.0, std::exp(0.35)), 0.95);
  EXPECT_GT(likeness(1.0, std::exp(0.65)), 0.05);
  EXPECT_EQ(likeness(1.0, std::exp(-0.75)), 0.0);
}

double beat(const std::function<void(BeatContext&, PairContext&)>& change) {
  BeatContext context;
  context.complex_log_odds = 2.0;
  context.any_recurs = true;
  context.like = 1.0;
  context.cluster_log_odds = 2.0;
  PairContext pair;
  pair.rr_s = 0.8;
  pair.cycle_s = 0.8;
  pair.before_sharpness = 1.0;
  pair.sharpness = 1.0;
  change(context, pair);
  auto evidence = evidence_of(context);
  add_pair(pair, evidence);
  return log_odds(evidence, kFittedWeights.beat);
}

TEST(BeatEvidence, IsWorthWhatTheRecordsSay) {
  struct {
    const char* name;
    std::function<void(BeatContext&, PairContext&)> change;
    double log_odds;
  } const all[] = {
      {"looks less like a QRS", [](auto& c, auto&) { c.complex_log_odds = 1.0; }, -0.9},
      {"of a kind that looks less like one", [](auto& c, auto&) { c.cluster_log_odds = 1.0; }, -1.0},
      {"of a kind that looks like anything but one", [](auto& c, auto&) { c.cluster_log_odds = -50.0; }, -2.0 - 6.0},
      {"like nothing", [](auto& c, auto&) { c.like = 0.0; }, -2.0 - 0.5},
      {"like nothing, in noise", [](auto& c, auto&) { c.like = 0.0, c.disturbed = 2.0; }, -2.0 - 0.5 - 2.0 * 0.5},
      {"like nothing, among others", [](auto& c, auto&) { c.like = 0.0, c.strangers = 2.0; }, -2.0 - 0.5 - 2.0 * 0.3},
      {"of another size", [](auto& c, auto&) { c.gain = std::exp(1.0); }, -0.5},
      {"where a T wave is and less sharp", [](auto&, auto& p) { p.rr_s = 0.35, p.sharpness = 0.5; },
       -0.7 * std::log(2.0)},
      {"sharper, and a PR interval after", [](auto&, auto& p) { p.rr_s = 0.2, p.before_sharpness = 0.5; },
       -3.0 * std::log(2.0)},
      {"out of rhythm", [](auto&, auto& p) { p.log_rhythm = -2.0; }, -1.0},
      {"out of rhythm in noise", [](auto&, auto& p) { p.log_rhythm = -2.0, p.disturbed = 2.0; }, -1.0 - 0.25 * 4.0},
  };
  const double usual_one = beat([](auto&, auto&) {});
  for (const auto& worth : all) {
    EXPECT_NEAR(beat(worth.change) - usual_one, worth.log_odds, 0.03 * std::abs(worth.log_odds)) << worth.name;
  }
}

TEST(BeatEvidence, TWavesEndWithTheCycleAndPrIntervalsAreShort) {
  const auto pair = [](BeatEvidence kind, double rr_s, double before, double sharpness, double cycle_s = 0.64) {
    PairContext p;
    p.rr_s = rr_s;
    p.cycle_s = cycle_s;
    p.before_sharpness = before;
    p.sharpness = sharpness;
    EvidenceOf<BeatEvidence> evidence{};
    add_pair(p, evidence);
    return part(evidence, kind);
  };
  // 0.45 times the root of the cycle (Bazett): 0.36 s.
  EXPECT_GT(pair(BeatEvidence::kTWave, 0.33, 1.0, 0.5), 0.5);
  EXPECT_EQ(pair(BeatEvidence::kTWave, 0.39, 1.0, 0.5), 0.0);
  EXPECT_GT(pair(BeatEvidence::kBeforeSharper, 0.26, 0.5, 1.0), 0.5);
  EXPECT_EQ(pair(BeatEvidence::kBeforeSharper, 0.30, 0.5, 1.0), 0.0);
  // And 0.45 of a fast heart's cycle.
  EXPECT_GT(pair(BeatEvidence::kBeforeSharper, 0.16, 0.5, 1.0, 0.4), 0.5);
  EXPECT_EQ(pair(BeatEvidence::kBeforeSharper, 0.20, 0.5, 1.0, 0.4), 0.0);
}

// In a slow heart no longer than the longest usual PR interval, in a fast one than a share of the cycle.
TEST(BeatEvidence, ABlunterBeatBeforeMayBeThePWaveWithinAPrInterval) {
  const auto before_sharper = [](double rr_s, double cycle_s) {
    PairContext pair;
    pair.rr_s = rr_s;
    pair.cycle_s = cycle_s;
    pair.before_sharpness = 1.0;
    pair.sharpness = 2.0;
    EvidenceOf<BeatEvidence> evidence{};
    add_pair(pair, evidence);
    return part(evidence, BeatEvidence::kBeforeSharper);
  };
  EXPECT_GT(before_sharper(0.27, 1.0), 0.0);
  EXPECT_EQ(before_sharper(0.29, 1.0), 0.0);
  EXPECT_GT(before_sharper(0.21, 0.5), 0.0);
  EXPECT_EQ(before_sharper(0.24, 0.5), 0.0);
}

}  // namespace
}  // namespace perimap

#include "core/phase/qrs_evidence.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace perimap

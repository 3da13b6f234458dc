#include "core/phase/qrs_clusters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perimap {
namespace {

constexpr Instant kNow{Duration(0)};

// The slope of a wave of that height and width in steps.
QrsShape shape(double height, double width, double middle = 18.0) {
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) {
    const double x = (i - middle) / width;
    s.slope[static_cast<std::size_t>(i)] = static_cast<float>(-height * x * std::exp(-0.5 * x * x));
  }
  return s;
}

const QrsShape kBeat = shape(1.0, 2.5);
const QrsShape kOther = shape(1.0, 7.0, 12.0);

TEST(QrsClusters, AShapeRecursWhenItWasSeenThreeTimes) {
  QrsClusters clusters;
  const int first = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  EXPECT_EQ(clusters.learn(kBeat, true, Surroundings::kCalm, kNow), first);
  EXPECT_FALSE(clusters.any_recurs());
  EXPECT_EQ(clusters.learn(kBeat, true, Surroundings::kCalm, kNow), first);
  EXPECT_TRUE(clusters.recurs(first));
}

TEST(QrsClusters, ShapesAndSizesAreToldApart) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  EXPECT_NE(clusters.learn(kOther, true, Surroundings::kCalm, kNow), beat);
  EXPECT_NE(clusters.learn(shape(0.4, 2.5), true, Surroundings::kCalm, kNow), beat)
      << "a P wave may have a QRS complex's shape";
  EXPECT_EQ(clusters.learn(shape(1.4, 2.5), true, Surroundings::kCalm, kNow), beat);
}

TEST(QrsClusters, FindsTheNearestAndItsGain) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  const ClusterMatch match = clusters.nearest(shape(1.5, 2.6), 3, 0.0);
  EXPECT_EQ(match.of, beat);
  EXPECT_GT(match.correlation, 0.95);
  EXPECT_NEAR(match.gain, 1.5, 0.1);
}

// Noise has made a P wave look a little more like the QRS complex than like its own kind.
TEST(QrsClusters, InNoiseAKindIsToldByItsSizeAsWell) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  const int wave = clusters.learn(shape(0.5, 4.5), true, Surroundings::kCalm, kNow);
  ASSERT_NE(wave, beat);
  const QrsShape between = shape(0.55, 3.3);
  EXPECT_EQ(clusters.nearest(between, 3, 0.0).of, beat);
  EXPECT_EQ(clusters.nearest(between, 3, 0.2).of, wave);
  EXPECT_EQ(clusters.nearest(shape(0.9, 3.0), 3, 0.2).of, beat);
}

TEST(QrsClusters, WhatRecursInBurstsAloneIsNotSettled) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 10; ++i) beat = clusters.learn(kBeat, true, Surroundings::kDisturbed, kNow);
  EXPECT_TRUE(clusters.recurs(beat));
  EXPECT_FALSE(clusters.settled(beat));
  EXPECT_FALSE(clusters.any_settled());
  for (int i = 0; i < 12; ++i) clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  EXPECT_TRUE(clusters.settled(beat));
}

TEST(QrsClusters, ABurstDoesNotUnsettleTheBeatsBeforeIt) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 60; ++i) beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 25; ++i) clusters.learn(kBeat, true, Surroundings::kDisturbed, kNow);
  EXPECT_TRUE(clusters.settled(beat));
}

TEST(QrsClusters, CanBeSettledAtOnce) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 6; ++i) beat = clusters.learn(kBeat, true, Surroundings::kDisturbed, kNow);
  clusters.settle(beat);
  EXPECT_TRUE(clusters.settled(beat));
}

TEST(QrsClusters, KnowsTheShareThatASharperOneFollows) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 8; ++i) clusters.followed(wave, i % 2 == 0);
  EXPECT_NEAR(clusters.followers(wave), 0.5, 0.07);
  EXPECT_EQ(clusters.followers_known(wave), 8.0);
}

// Of ten P waves so many are conducted, and of ten QRS complexes so many come after one.
bool leads(int conducted, int with_p_wave, int qrs_complexes = 10) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 10; ++i) clusters.followed(wave, i < conducted);
  for (int i = 0; i < qrs_complexes; ++i) clusters.preceded(beat, i < with_p_wave ? wave : -1);
  EXPECT_FALSE(clusters.leads(beat));
  return clusters.leads(wave);
}

TEST(QrsClusters, AWaveThatHalfOfTheTimeLeadsAComplexWhichNeverComesWithoutItIsAPWave) {
  EXPECT_TRUE(leads(5, 10)) << "2:1 block";
  EXPECT_TRUE(leads(10, 10));
  EXPECT_FALSE(leads(3, 10)) << "chance";
  EXPECT_TRUE(leads(5, 9)) << "one ventricular beat among them";
  EXPECT_FALSE(leads(5, 7)) << "what follows comes without it as well: an ectopic beat after a normal one";
  EXPECT_FALSE(leads(5, 1, 1));
  EXPECT_TRUE(leads(5, 2, 2)) << "two are enough: each that is not known as a P wave is told as a beat";
}

TEST(QrsClusters, WhatComesBeforeIsOfOneKind) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  const int other = clusters.learn(shape(0.4, 2.5), true, Surroundings::kCalm, kNow);
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 12; ++i) {
    clusters.followed(wave, true);
    clusters.followed(other, true);
    clusters.preceded(beat, i % 2 == 0 ? wave : other);
  }
  EXPECT_FALSE(clusters.leads(wave));
  EXPECT_FALSE(clusters.leads(other));
  // The P wave's shape has changed for good.
  for (int i = 0; i < 60; ++i) clusters.preceded(beat, other);
  EXPECT_TRUE(clusters.leads(other));
  EXPECT_FALSE(clusters.leads(wave));
}

// So many strange complexes, each unlike the others: is the kind that was known before them still?
bool still_known(Surroundings around) {
  QrsClusters clusters;
  int beat = -1;
  for (int i = 0; i < 4; ++i) beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  std::mt19937 generator(0x5b0e71c3U);
  std::normal_distribution<float> normal(0.0F, 0.4F);
  for (int i = 0; i < 150; ++i) {
    QrsShape strange = kBeat;
    for (float& slope : strange.slope) slope = normal(generator);
    clusters.learn(strange, true, around, kNow);
  }
  return clusters.nearest(kBeat, 0).of == beat && clusters.settled(beat);
}

TEST(QrsClusters, InABurstWhatIsSettledNeitherFadesNorGivesWay) {
  EXPECT_TRUE(still_known(Surroundings::kBurst));
  EXPECT_FALSE(still_known(Surroundings::kDisturbed));
}

QrsShape unlike_others(unsigned number) {
  std::mt19937 generator(number);
  std::normal_distribution<float> normal(0.0F, 0.4F);
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) s.slope[static_cast<std::size_t>(i)] = normal(generator);
  return s;
}

// So many new kinds that the one is forgotten.
void forget_all_but_newest(QrsClusters& clusters, int kept, const QrsShape& kept_shape) {
  for (int i = 0; i < QrsClusters::kClusters; ++i) {
    clusters.learn(unlike_others(static_cast<unsigned>(i)), true, Surroundings::kCalm, kNow);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(clusters.learn(kept_shape, true, Surroundings::kCalm, kNow), kept);
  }
}

TEST(QrsClusters, AKindThatTakesThePlaceOfPWavesIsNotTakenForThem) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 12; ++i) clusters.preceded(beat, wave);
  forget_all_but_newest(clusters, beat, kBeat);
  for (int i = 0; i < 10; ++i) clusters.followed(wave, true);  // another kind now
  clusters.preceded(beat, wave);
  EXPECT_FALSE(clusters.leads(wave)) << "one is not enough";
  clusters.preceded(beat, wave);
  EXPECT_TRUE(clusters.leads(wave));
}

TEST(QrsClusters, AKindThatTakesThePlaceOfARivalIsANewOne) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  EXPECT_TRUE(clusters.beside(beat, wave, 0.3, 0.02, true));
  EXPECT_FALSE(clusters.beside(beat, wave, 0.4, 0.02, true)) << "its distance is another";
  EXPECT_TRUE(clusters.beside(beat, wave, -0.4, 0.02, true)) << "before it is another matter";
  forget_all_but_newest(clusters, beat, kBeat);
  EXPECT_TRUE(clusters.beside(beat, wave, 0.4, 0.02, true));
}

TEST(QrsClusters, TheDistanceOfRivalsIsFollowedByAFifth) {
  QrsClusters clusters;
  int wave = -1;
  for (int i = 0; i < 4; ++i) wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  clusters.beside(wave, wave, 0.300, 0.02, false);
  EXPECT_TRUE(clusters.beside(wave, wave, 0.319, 0.02, false));   // now 0.3038
  EXPECT_TRUE(clusters.beside(wave, wave, 0.3235, 0.02, false));  // 0.3077
  EXPECT_FALSE(clusters.beside(wave, wave, 0.3280, 0.02, false));
}

// A P wave and the QRS complex are of one kind: a PR interval lies between them, and the rest of the cycle.
TEST(QrsClusters, ARivalMayComeAtMoreThanOneDistance) {
  QrsClusters clusters;
  int kind = -1;
  for (int i = 0; i < 4; ++i) kind = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  const auto come = [&](double a_s, double b_s) {
    bool all = true;
    for (const double after_s : {a_s, b_s, -a_s, -b_s}) all = clusters.beside(kind, kind, after_s, 0.02, false) && all;
    return all;
  };
  EXPECT_FALSE(come(0.23, 0.43));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(come(0.23, 0.43)) << i;
  EXPECT_FALSE(clusters.beside(kind, kind, 0.33, 0.02, false)) << "a fifth, which takes the place of the oldest";
  EXPECT_FALSE(clusters.beside(kind, kind, 0.23, 0.02, false));
  EXPECT_TRUE(clusters.beside(kind, kind, -0.43, 0.02, false));
}

TEST(QrsClusters, AKindComesEarlyThatHasThreeTimes) {
  QrsClusters clusters;
  const int kind = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  EXPECT_EQ(clusters.log_of_cycle(-1), 0.0);
  for (int i = 0; i < 2; ++i) clusters.came(kind, -0.4);
  EXPECT_EQ(clusters.log_of_cycle(kind), 0.0) << "chance";
  clusters.came(kind, -0.4);
  EXPECT_NEAR(clusters.log_of_cycle(kind), -0.4, 1e-9);
  for (int i = 0; i < 20; ++i) clusters.came(kind, -0.4);
  clusters.came(kind, 0.08);
  EXPECT_NEAR(clusters.log_of_cycle(kind), -0.36, 1e-9) << "the last twelve count";
}

TEST(QrsClusters, JudgesByTheMeanOfItsMembersAndCautiouslyWhereTheyAreFew) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  clusters.judged(beat, 3.0);
  EXPECT_GT(clusters.log_odds(beat), 0.0);
  EXPECT_LT(clusters.log_odds(beat), 1.5);
  for (int i = 0; i < 30; ++i) clusters.judged(beat, 3.0);
  EXPECT_NEAR(clusters.log_odds(beat), 3.0, 0.5);
}

// ---- what makes a kind

// Beside kBeat, as like it as `correlation` says.
QrsShape mixed(double correlation) {
  QrsShape other = kOther;
  const ShapeMatch along = match(other, kBeat);
  for (int i = 0; i < other.points; ++i) {
    other.slope[static_cast<std::size_t>(i)] -=
        static_cast<float>(along.gain) * kBeat.slope[static_cast<std::size_t>(i)];
  }
  const double scale = std::sqrt(1.0 - correlation * correlation) * root_mean_square(kBeat) / root_mean_square(other);
  QrsShape shape = kBeat;
  for (int i = 0; i < shape.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    shape.slope[k] = static_cast<float>(correlation * static_cast<double>(kBeat.slope[k]) +
                                        scale * static_cast<double>(other.slope[k]));
  }
  return shape;
}

QrsClusters knowing_beats(int count = 10) {
  QrsClusters clusters;
  for (int i = 0; i < count; ++i) clusters.judged(clusters.learn(kBeat, true, Surroundings::kCalm, kNow), 3.0);
  return clusters;
}

TEST(QrsClusters, AShapeIsOfAKindFromACorrelationOfEightyFivePercentOn) {
  QrsClusters clusters = knowing_beats();
  const int beat = clusters.nearest(kBeat, 0).of;
  EXPECT_EQ(clusters.learn(mixed(0.90), true, Surroundings::kCalm, kNow), beat);
  EXPECT_NE(knowing_beats().learn(mixed(0.78), true, Surroundings::kCalm, kNow), beat);
}

TEST(QrsClusters, AKindIsOfSizesUpToTwiceAndDownToHalf) {
  const QrsClusters clusters = knowing_beats();
  for (const double gain : {1.8, 0.56}) EXPECT_GE(clusters.nearest(shape(gain, 2.5), 0).of, 0) << gain;
  for (const double gain : {2.25, 0.45}) EXPECT_LT(clusters.nearest(shape(gain, 2.5), 0).of, 0) << gain;
}

TEST(QrsClusters, AGainThatFallsFromBeatToBeatIsFollowed) {
  const auto kinds = [](double by) {
    QrsClusters clusters;
    for (int i = 0; i < 8; ++i) clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
    double height = 1.0;
    const int beat = clusters.nearest(kBeat, 0).of;
    int others = 0;
    for (int i = 0; i < 12; ++i) {
      height *= by;
      others += clusters.learn(shape(height, 2.5), true, Surroundings::kCalm, kNow) == beat ? 0 : 1;
    }
    return others;
  };
  EXPECT_EQ(kinds(0.82), 0) << "the median of eight would be behind by more than half of the size";
  EXPECT_GT(kinds(0.65), 0);
}

TEST(QrsClusters, ABeatIsLookedForDownToAQuarterOfItsSize) {
  const QrsClusters clusters = knowing_beats();
  EXPECT_GE(clusters.nearest_beat(shape(0.28, 2.5)).of, 0);
  EXPECT_LT(clusters.nearest_beat(shape(0.22, 2.5)).of, 0);
}

TEST(QrsClusters, PeaksOfOneKindAreFoundUpToFifteenMillisecondsApart) {
  for (const double apart : {3.0, 4.0}) {
    QrsClusters clusters;
    const int narrow = clusters.learn(shape(1.0, 1.2, 14.0), true, Surroundings::kCalm, kNow);
    EXPECT_EQ(clusters.learn(shape(1.0, 1.2, 14.0 + apart), true, Surroundings::kCalm, kNow) == narrow, apart == 3.0);
  }
}

// ---- what is remembered

TEST(QrsClusters, ATemplateFollowsItsMembersByAnEighthEach) {
  QrsClusters clusters = knowing_beats(100);
  const QrsShape bent = mixed(0.88);
  for (int i = 0; i < 4; ++i) clusters.learn(bent, true, Surroundings::kCalm, kNow);
  const double share = 1.0 - std::pow(7.0 / 8.0, 4.0);
  const double along = 1.0 - share + 0.88 * share;
  const double across = std::sqrt(1.0 - 0.88 * 0.88) * share;
  EXPECT_NEAR(std::acos(clusters.nearest(kBeat, 0).correlation), std::atan(across / along), 0.03);
}

TEST(QrsClusters, SharesAreOfTheLastTwelveMembers) {
  QrsClusters clusters;
  const int wave = clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 40; ++i) clusters.followed(wave, true);
  for (int i = 0; i < 8; ++i) clusters.followed(wave, false);
  EXPECT_NEAR(clusters.followers(wave), std::pow(11.0 / 12.0, 8.0), 0.02);
}

TEST(QrsClusters, ABurstOfTwentySecondsDoesNotOutweighTheBeatsBeforeItAndALongerOneDoes) {
  const auto settled_after = [](int in_burst) {
    QrsClusters clusters = knowing_beats(200);
    int beat = -1;
    for (int i = 0; i < in_burst; ++i) beat = clusters.learn(kBeat, true, Surroundings::kDisturbed, kNow);
    return clusters.settled(beat);
  };
  EXPECT_TRUE(settled_after(36));
  EXPECT_FALSE(settled_after(48));
}

TEST(QrsClusters, AKindIsSettledWhenMostOfItsMembersWereSeenInCalm) {
  const auto settled = [](int calm) {
    QrsClusters clusters;
    int beat = -1;
    for (int i = 0; i < 20; ++i)
      beat = clusters.learn(kBeat, true, i < calm ? Surroundings::kCalm : Surroundings::kDisturbed, kNow);
    return clusters.settled(beat);
  };
  EXPECT_FALSE(settled(8));
  EXPECT_TRUE(settled(12));
}

TEST(QrsClusters, OneMemberIsJudgedAsIfTwoOthersHadSaidNothing) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  clusters.judged(beat, 3.0);
  EXPECT_NEAR(clusters.log_odds(beat), 1.0, 0.05);
}

TEST(QrsClusters, WhatIsSeenAgainOutweighsWhatIsNotInAHundredComplexes) {
  QrsClusters clusters;
  const int beat = clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 5; ++i) clusters.learn(kBeat, true, Surroundings::kCalm, kNow);
  for (int i = 0; i < 60; ++i) clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  EXPECT_TRUE(clusters.recurs(beat));
  for (int i = 0; i < 60; ++i) clusters.learn(kOther, true, Surroundings::kCalm, kNow);
  EXPECT_FALSE(clusters.recurs(beat));
}

}  // namespace
}  // namespace perimap

#include "core/phase/recent_complexes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "decision_patient.hpp"

namespace perimap::test {
namespace {

// A lead of which the complexes of each kind are noted one after the other.
struct Lead {
  int kind(const QrsShape& shape) {
    int of = -1;
    for (int i = 0; i < 4; ++i) of = clusters.learn(shape, true, Surroundings::kCalm, at(0.0));
    return of;
  }
  void see(double at_s, int of, double log_odds = 3.0, double sharpness = 1.0, bool at_first = false) {
    complexes.expire(at(at_s), clusters);
    QrsCandidate candidate;
    candidate.time = at(at_s);
    candidate.sharpness = sharpness;
    complexes.note(candidate, of, true, settings.pr_longest, clusters);
    complexes.judge(log_odds, at_first, clusters);
  }

  DecisionSettings settings;
  QrsClusters clusters;
  RecentComplexes complexes{settings};
  int first = kind(wave(1.0, 2.5));
  int second = kind(wave(1.0, 7.0, 12.0));
  int third = kind(wave(0.3, 2.5));
};

// Shares that are rivalled, where `second` comes so long after `first`, at so many distances that are twice the scatter
// apart, and has so much less log odds.
struct Rivalry {
  double of_first = 0.0;
  double of_second = 0.0;
};
Rivalry rivalry(double after_s, double less, double scatter_s = 0.0, int distances = 2) {
  Lead lead;
  for (int i = 0; i < 60; ++i) {
    lead.see(1.0 * i, lead.first);
    const int offset = 2 * (5 * i % distances) - distances + 1;
    lead.see(1.0 * i + after_s + offset * scatter_s, lead.second, 3.0 - less);
  }
  return {lead.clusters.rivals(lead.first), lead.clusters.rivals(lead.second)};
}

TEST(RecentComplexes, TwoOfACycleThatAreAboutAsLikelyAreRivals) {
  EXPECT_GT(rivalry(0.3, 1.8).of_first, 0.8);
  EXPECT_GT(rivalry(0.3, 1.8).of_second, 0.8);
  EXPECT_EQ(rivalry(0.3, 2.2).of_first, 0.0) << "it is far likelier to be the beat";
  EXPECT_GT(rivalry(0.3, 2.2).of_second, 0.8) << "and the other far less";
  EXPECT_EQ(rivalry(0.3, 3.1).of_second, 0.0) << "what looks like none is none";
}

TEST(RecentComplexes, RivalsAreAsFarApartAsPOrTFromR) {
  EXPECT_GT(rivalry(0.12, 0.0).of_first, 0.8);
  EXPECT_EQ(rivalry(0.08, 0.0).of_first, 0.0) << "one complex";
  EXPECT_GT(rivalry(0.43, 0.0).of_first, 0.8);
  EXPECT_EQ(rivalry(0.46, 0.0).of_first, 0.0) << "an early beat";
}

TEST(RecentComplexes, RivalsAreOfFewDistances) {
  EXPECT_GT(rivalry(0.3, 0.0, 0.015).of_first, 0.8);
  EXPECT_GT(rivalry(0.3, 0.0, 0.05).of_first, 0.8) << "two";
  EXPECT_LT(rivalry(0.3, 0.0, 0.011, 7).of_first, 0.1) << "fibrillation";
  EXPECT_GT(rivalry(0.3, 0.0, 0.009, 7).of_first, 0.8);
}

TEST(RecentComplexes, RivalsAreOfOneKindUnlessLittleIsKnownYet) {
  const auto of_two_kinds = [](bool at_first) {
    Lead lead;
    for (int i = 0; i < 20; ++i) {
      lead.see(1.0 * i, lead.first, 3.0, 1.0, at_first);
      lead.see(1.0 * i + 0.3, i % 2 == 0 ? lead.second : lead.third, 3.0, 1.0, at_first);
    }
    return lead.clusters.rivals(lead.first);
  };
  EXPECT_EQ(of_two_kinds(false), 0.0);
  EXPECT_EQ(of_two_kinds(true), 1.0);
}

TEST(RecentComplexes, AtFirstTheFirstRivalIsOne) {
  const auto after_one_cycle = [](bool at_first) {
    Lead lead;
    lead.see(0.0, lead.first, 3.0, 1.0, at_first);
    lead.see(0.3, lead.second, 3.0, 1.0, at_first);
    return lead.clusters.rivals(lead.first);
  };
  EXPECT_EQ(after_one_cycle(true), 1.0);
  EXPECT_EQ(after_one_cycle(false), 0.0);
}

// Intervals of these lengths in turn, each from a kind of its own.
double rivals_in(const std::vector<double>& intervals_s) {
  Lead lead;
  double at_s = 0.0;
  const std::array<int, 3> kinds{lead.first, lead.second, lead.third};
  for (std::size_t i = 0; i < 60; ++i) {
    lead.see(at_s, kinds[i % intervals_s.size()]);
    at_s += intervals_s[i % intervals_s.size()];
  }
  return lead.clusters.rivals(lead.first);
}

TEST(RecentComplexes, AFastHeartsBeatsAreNoRivals) {
  EXPECT_LT(rivals_in({0.36}), 0.1);
  EXPECT_LT(rivals_in({0.35, 0.38}), 0.1);
  EXPECT_GT(rivals_in({0.335, 0.385}), 0.3) << "every second is another";
  EXPECT_GT(rivals_in({0.25, 0.26, 0.5}), 0.6) << "P, R and T";
}

TEST(RecentComplexes, WhatComesBeforeAComplexIsTheNearestInTime) {
  Lead lead;
  constexpr int kRing = 8;
  const int other = lead.kind(strange_shape(5));
  double at_s = 0.0;
  const auto others = [&](int count) {
    for (int i = 0; i < count; ++i) lead.see(at_s += 1.0, other, -3.0, 5.0);
  };
  others(kRing - 1);
  for (int i = 0; i < 3; ++i) {  // the older of two blunt ones stands last in the ring, the newer first
    lead.see(at_s += 1.0, lead.second, 1.0, 0.3);
    lead.see(at_s += 0.1, lead.third, 1.0, 0.2);
    lead.see(at_s += 0.12, lead.first, 3.0, 1.0);
    others(kRing - 3);
  }
  EXPECT_TRUE(lead.clusters.leads(lead.third));
  EXPECT_FALSE(lead.clusters.leads(lead.second));
}

}  // namespace
}  // namespace perimap::test

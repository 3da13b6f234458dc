#include "core/setup_watch/setup_belief.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

namespace perimap {
namespace {

using std::chrono::seconds;

SetupVerdict verdict(SetupState state) {
  SetupVerdict verdict;
  verdict.state = state;
  return verdict;
}

SetupVerdict telling(SetupState state, double surface_deviation_mm, double widening_mm) {
  SetupVerdict told = verdict(state);
  told.matches = 500;
  told.surface_deviation_mm = surface_deviation_mm;
  told.widening_mm = told.suspected_mm = widening_mm;
  return told;
}

SetupVerdict doubt_of(SetupPart part) {
  SetupVerdict doubt = verdict(SetupState::kDoubted);
  doubt.matches = 500;
  doubt.blamed[index_of(part)] = true;
  return doubt;
}

TEST(SetupBelief, DoubtsAfterTwoWindowsInARowThatBlameTheSame) {
  SetupBelief belief;
  belief.add(doubt_of(SetupPart::kHandEyeTurn), seconds(10));
  EXPECT_FALSE(belief.doubted());
  EXPECT_EQ(belief.told().state, SetupState::kUndetermined) << "it was seen once";
  EXPECT_FALSE(belief.told().blamed[index_of(SetupPart::kHandEyeTurn)]);
  belief.add(doubt_of(SetupPart::kHandEyeTurn), seconds(13));
  EXPECT_TRUE(belief.doubted());
  EXPECT_TRUE(belief.told().blamed[index_of(SetupPart::kHandEyeTurn)]);
  EXPECT_EQ(belief.first_doubted(), seconds(13));
  EXPECT_EQ(belief.judged(), 2U);
}

TEST(SetupBelief, DoubtsAtOnceWhatIsFarBeyondChance) {
  SetupBelief belief;
  SetupVerdict certain = doubt_of(SetupPart::kHandEyeTurn);
  certain.certainty = 2.5;
  belief.add(certain, seconds(8));
  EXPECT_TRUE(belief.doubted());
}

TEST(SetupBelief, DoesNotDoubtWhereEachWindowBlamesAnotherNumber) {
  SetupBelief belief;
  for (int i = 0; i < 6; ++i) {
    belief.add(doubt_of(i % 2 == 0 ? SetupPart::kFocalLength : SetupPart::kTimeOffset), seconds(3 * i));
  }
  EXPECT_FALSE(belief.doubted());
}

TEST(SetupBelief, DoesNotDoubtWhereAWindowBetweenShowsNothing) {
  SetupBelief belief;
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(3));
  belief.add(verdict(SetupState::kConsistent), seconds(6));
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(9));
  EXPECT_FALSE(belief.doubted());
  EXPECT_FALSE(belief.first_doubted().has_value());
}

TEST(SetupBelief, BelievesAgainAfterThreeWindowsThatWouldHaveShownIt) {
  SetupBelief belief;
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(3));
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(6));
  for (int i = 0; i < 5; ++i) belief.add(verdict(SetupState::kUndetermined), seconds(9 + 3 * i));
  EXPECT_TRUE(belief.doubted()) << "it would not have shown";
  for (int i = 0; i < 2; ++i) belief.add(verdict(SetupState::kConsistent), seconds(30 + 3 * i));
  EXPECT_TRUE(belief.doubted());
  EXPECT_EQ(belief.told().state, SetupState::kDoubted);
  belief.add(verdict(SetupState::kConsistent), seconds(36));
  EXPECT_FALSE(belief.doubted());
  EXPECT_EQ(belief.told().state, SetupState::kConsistent);
  EXPECT_EQ(belief.first_doubted(), seconds(6));
}

TEST(SetupBelief, BelievesAgainThoughTheScopeRestsInBetween) {
  SetupBelief belief;
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(3));
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(6));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(belief.doubted());
    belief.add(verdict(SetupState::kConsistent), seconds(9 + 6 * i));
    belief.add(verdict(SetupState::kUndetermined), seconds(12 + 6 * i));
  }
  EXPECT_FALSE(belief.doubted());
}

TEST(SetupBelief, AWindowOfWhichNothingIsKnownChangesNothing) {
  SetupBelief belief;
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(3));
  belief.add(verdict(SetupState::kUnknown), seconds(6));
  belief.add(doubt_of(SetupPart::kFocalLength), seconds(9));
  EXPECT_TRUE(belief.doubted());
  belief.add(verdict(SetupState::kUnknown), seconds(12));
  EXPECT_TRUE(belief.doubted());
}

TEST(SetupBelief, IsNotConsistentAnyMoreWhenThreeWindowsInARowTellNothing) {
  SetupBelief belief;
  belief.add(verdict(SetupState::kConsistent), seconds(3));
  for (int i = 0; i < 2; ++i) belief.add(verdict(SetupState::kUnknown), seconds(6 + 3 * i));
  EXPECT_EQ(belief.told().state, SetupState::kConsistent);
  belief.add(verdict(SetupState::kUnknown), seconds(12));
  EXPECT_EQ(belief.told().state, SetupState::kUnknown);
  belief.add(verdict(SetupState::kConsistent), seconds(15));
  EXPECT_EQ(belief.told().state, SetupState::kConsistent);
}

TEST(SetupBelief, StaysDoubtedWhileWindowsTellNothing) {
  SetupBelief belief;
  for (int i = 0; i < 2; ++i) belief.add(doubt_of(SetupPart::kFocalLength), seconds(3 + 3 * i));
  for (int i = 0; i < 9; ++i) belief.add(verdict(SetupState::kUnknown), seconds(9 + 3 * i));
  EXPECT_TRUE(belief.doubted());
  EXPECT_EQ(belief.told().state, SetupState::kDoubted);
}

TEST(SetupBelief, WidensByTheNewestWindow) {
  SetupBelief belief;
  EXPECT_EQ(belief.widening_mm(), 0.0);
  SetupVerdict told = verdict(SetupState::kConsistent);
  told.widening_mm = 0.6;
  belief.add(told, seconds(3));
  EXPECT_NEAR(belief.widening_mm(), 0.6, 1e-12);
  belief.add(verdict(SetupState::kConsistent), seconds(6));
  EXPECT_EQ(belief.widening_mm(), 0.0);
}

TEST(SetupBelief, WhatAWindowWidenedThatKnewLittleIsTakenBackByOneThatKnowsMore) {
  SetupBelief belief;
  belief.add(telling(SetupState::kUndetermined, 4.0, 1.5), seconds(3));
  EXPECT_NEAR(belief.widening_mm(), 1.5, 1e-12);
  belief.add(telling(SetupState::kUndetermined, 5.0, 0.0), seconds(5));
  EXPECT_NEAR(belief.widening_mm(), 1.5, 1e-12) << "it knows less";
  belief.add(telling(SetupState::kUndetermined, 3.0, 0.0), seconds(6));
  EXPECT_EQ(belief.widening_mm(), 0.0);
}

TEST(SetupBelief, WhatAWindowHasWidenedThatKnewMuchIsNotTakenBackByTwoThatKnowLittle) {
  SetupBelief belief;
  belief.add(telling(SetupState::kConsistent, 0.5, 0.8), seconds(3));
  belief.add(telling(SetupState::kUndetermined, 3.0, 0.9), seconds(6));
  belief.add(telling(SetupState::kUndetermined, 2.9, 0.0), seconds(9));
  EXPECT_NEAR(belief.widening_mm(), 0.9, 1e-12);
}

// As of another patient, whose window is short yet.
TEST(SetupBelief, WhatAWindowLeavesUnknownThatWasKnownDoesNotWiden) {
  SetupBelief belief;
  belief.add(telling(SetupState::kConsistent, 0.7, 0.1), seconds(20));
  SetupVerdict little = telling(SetupState::kUndetermined, 5.0, 0.8);
  little.suspected_mm = 0.0;
  belief.add(little, seconds(40));
  EXPECT_NEAR(belief.widening_mm(), 0.1, 1e-12);
  little.suspected_mm = 0.6;
  belief.add(little, seconds(42));
  EXPECT_NEAR(belief.widening_mm(), 0.6, 1e-12) << "but what it tells does";
}

TEST(SetupBelief, StaysWideWhileTheScopeRests) {
  SetupBelief belief;
  SetupVerdict told = verdict(SetupState::kConsistent);
  told.widening_mm = 0.6;
  belief.add(told, seconds(3));
  belief.add(verdict(SetupState::kUndetermined), seconds(6));
  EXPECT_NEAR(belief.widening_mm(), 0.6, 1e-12);
  belief.add(verdict(SetupState::kConsistent), seconds(9));
  EXPECT_EQ(belief.widening_mm(), 0.0);
}

TEST(SetupBelief, HoldsEverythingBackUntilAWindowHasTold) {
  SetupBelief belief;
  EXPECT_LT(belief.within_mm(1.0), 0.0);
  for (int i = 0; i < 20; ++i) {
    belief.add(verdict(SetupState::kUnknown), seconds(6 * i));           // nothing explains it
    belief.add(verdict(SetupState::kUndetermined), seconds(6 * i + 3));  // the scope rests: no matches were judged
  }
  EXPECT_FALSE(belief.asked());
  EXPECT_LT(belief.within_mm(1.0), 0.0) << "however long";
  belief.add(telling(SetupState::kUndetermined, 3.0, 0.6), seconds(130));
  EXPECT_TRUE(belief.asked());
  EXPECT_NEAR(belief.within_mm(1.0), 0.8, 1e-12) << "all of the widening may lie in one direction";
  belief.add(telling(SetupState::kUndetermined, 3.0, 1.6), seconds(133));
  EXPECT_EQ(belief.within_mm(1.0), 0.0);
  for (int i = 0; i < 20; ++i) belief.add(verdict(SetupState::kUnknown), seconds(136 + i));
  EXPECT_TRUE(belief.asked()) << "what was told holds";
}

TEST(SetupBelief, GoesOnInAnotherRunAsItWasInTheFirst) {
  SetupBelief first;
  for (int i = 0; i < 2; ++i) first.add(doubt_of(SetupPart::kFocalLength), seconds(3 * i));
  SetupBelief second;
  second.recall(first.memory());
  EXPECT_EQ(second.asked(), first.asked());
  EXPECT_TRUE(second.doubted());
  EXPECT_TRUE(second.told().blamed[index_of(SetupPart::kFocalLength)]);
  EXPECT_EQ(second.within_mm(1.0), first.within_mm(1.0));
  for (int i = 0; i < 2; ++i) second.add(verdict(SetupState::kConsistent), seconds(3 * i));
  EXPECT_TRUE(second.doubted()) << "three would have to show nothing";
  second.add(verdict(SetupState::kConsistent), seconds(9));
  EXPECT_FALSE(second.doubted());

  SetupBelief wide;
  wide.add(telling(SetupState::kConsistent, 0.5, 0.8), seconds(3));
  SetupBelief after;
  after.recall(wide.memory());
  EXPECT_NEAR(after.within_mm(1.0), 0.6, 1e-12);
  after.add(telling(SetupState::kUndetermined, 3.0, 0.0), seconds(3));
  EXPECT_NEAR(after.within_mm(1.0), 0.6, 1e-12) << "it knows less than the window that widened";
}

}  // namespace
}  // namespace perimap

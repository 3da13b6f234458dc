#include "core/pipeline/load_shedding.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/pipeline/feature_stages.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using Decision = LoadSheddingDecision;

constexpr Duration kBudget = milliseconds(10);
constexpr FrameTime kTooLong{milliseconds(11), false, {}};
constexpr FrameTime kLong{milliseconds(9), false, {}};
constexpr FrameTime kShort{milliseconds(2), false, {}};

int frames_of(Duration time, const FrameRate& rate = {}) { return static_cast<int>(rate.frames(time)); }

// So many frames of one kind, with as many features followed as may be. How often more had to be shed.
int frames(Decision& decision, int n, const FrameTime& time, int followed = 1000) {
  int times = 0;
  for (int i = 0; i < n; ++i) times += decision.add(time, std::min(followed, decision.limit())) ? 1 : 0;
  return times;
}

TEST(LoadSheddingDecision, NothingIsShedWhileFramesFitTheBudget) {
  Decision decision(120, kBudget);
  EXPECT_EQ(frames(decision, 1000, kLong), 0);
  EXPECT_EQ(decision.limit(), 120);
}

TEST(LoadSheddingDecision, FramesThatTakeTooLongNowAndThenShedNothing) {
  Decision decision(120, kBudget);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(frames(decision, 7, kTooLong), 0);
    EXPECT_EQ(frames(decision, 9, kShort), 0);
  }
  EXPECT_EQ(decision.limit(), 120);
}

TEST(LoadSheddingDecision, RepeatedOverrunsShedAnEighthAtATimeDownToTheLeastThatTellThePhase) {
  Decision decision(120, kBudget);
  EXPECT_EQ(frames(decision, 7, kTooLong), 0);
  EXPECT_EQ(frames(decision, 1, kTooLong), 1);
  EXPECT_EQ(decision.limit(), 105);
  frames(decision, 8, kTooLong);
  EXPECT_EQ(decision.limit(), 92) << "an eighth of those that are left";
  frames(decision, 1000, kTooLong);
  EXPECT_EQ(decision.limit(), Decision::kLeast);
  EXPECT_EQ(frames(decision, 1000, kTooLong), 0) << "no fewer, and no word of it";
}

TEST(LoadSheddingDecision, WhatIsShedIsAShareOfThoseThatAreFollowed) {
  Decision decision(1000, kBudget);
  frames(decision, 8, kTooLong, 80);
  EXPECT_EQ(decision.limit(), 70);
}

TEST(LoadSheddingDecision, LearningThatIsPutOffIsAnOverrun) {
  Decision decision(120, kBudget);
  EXPECT_EQ(frames(decision, 8, {milliseconds(1), true, {}}), 1);
}

TEST(LoadSheddingDecision, TakesBackWhenThereIsRoomAndNotBefore) {
  Decision decision(160, kBudget);
  frames(decision, 8, kTooLong);
  ASSERT_EQ(decision.limit(), 140);
  frames(decision, 1000, kLong);
  EXPECT_EQ(decision.limit(), 140) << "within the budget, but more would not be";
  frames(decision, frames_of(Decision::kCalm) - 1, kShort);
  EXPECT_EQ(decision.limit(), 140);
  frames(decision, 1, kShort);
  EXPECT_EQ(decision.limit(), 150);
  frames(decision, 1000, kShort);
  EXPECT_EQ(decision.limit(), 160) << "all, and no more than all";
}

TEST(LoadSheddingDecision, TheCalmLastsAsLongAtEveryRate) {
  for (const double per_s : {15.0, 60.0, 240.0}) {
    const FrameRate rate(per_s);
    const FrameTime brief{milliseconds(1), false, rate};
    Decision decision(160, kBudget);
    frames(decision, 8, kTooLong);
    frames(decision, frames_of(Decision::kCalm, rate) - 1, brief);
    EXPECT_EQ(decision.limit(), 140) << per_s;
    frames(decision, 1, brief);
    EXPECT_EQ(decision.limit(), 150) << per_s;
    EXPECT_NEAR(frames_of(Decision::kCalm, rate) / per_s, to_seconds(Decision::kCalm), 0.5 / per_s);
  }
}

TEST(LoadSheddingDecision, AnOverrunBeginsTheCalmAnew) {
  Decision decision(160, kBudget);
  frames(decision, 8, kTooLong);
  frames(decision, frames_of(Decision::kCalm) - 1, kShort);
  frames(decision, 1, kTooLong);
  frames(decision, frames_of(Decision::kCalm) - 1, kShort);
  EXPECT_EQ(decision.limit(), 140);
  frames(decision, 1, kShort);
  EXPECT_EQ(decision.limit(), 150);
}

// A machine on which a feature costs as much as the budget has for 100 of them.
TEST(LoadSheddingDecision, SettlesBelowWhatTheMachineCanDoInsteadOfSwinging) {
  Decision decision(160, kBudget);
  int changes = 0;
  int last = decision.limit();
  for (int i = 0; i < 20'000; ++i) {
    decision.add({kBudget * decision.limit() / 100, false, {}}, decision.limit());
    if (i >= 1000) {
      EXPECT_GE(decision.limit(), 60);
      EXPECT_LE(decision.limit(), 110);
    }
    changes += i >= 1000 && decision.limit() != last ? 1 : 0;
    last = decision.limit();
  }
  EXPECT_LE(changes, 10) << "in 19'000 frames";
}

// A machine whose frames are short now and too long as soon as more features are followed.
TEST(LoadSheddingDecision, WhatWasTakenBackInVainIsTriedLessOften) {
  Decision decision(160, kBudget);
  frames(decision, 24, kTooLong);
  const int low = decision.limit();
  std::vector<int> waits;
  for (int attempt = 0; attempt < 8; ++attempt) {
    int waited = 0;
    for (; decision.limit() <= low && waited < 5000; ++waited) decision.add(kShort, decision.limit());
    waits.push_back(waited);
    while (decision.limit() > low) frames(decision, 1, kTooLong);
    if (decision.limit() < low) frames(decision, 1, kShort);
  }
  EXPECT_LT(2 * waits.front(), waits.back());
  EXPECT_LE(waits.back(), 3 * frames_of(Decision::kCalm) * Decision::kLongestPatience) << "but it is tried";
}

class Shedding : public ::testing::Test {
 protected:
  FeatureSlot& add(std::uint32_t id, SlotState state, bool converged = false, double deviation_mm = 0.0) {
    FeatureSlot& slot = slots[used++];
    slot.id = id;
    slot.state = state;
    slot.converged = converged;
    slot.largest_deviation_mm = deviation_mm;
    return slot;
  }
  std::vector<std::uint32_t> shed() const {
    std::vector<std::uint32_t> ids;
    for (const FeatureSlot& slot : slots) {
      if (slot.shed) ids.push_back(slot.id);
    }
    return ids;
  }

  std::vector<FeatureSlot> slots = std::vector<FeatureSlot>(8);
  std::size_t used = 0;
};

TEST_F(Shedding, TheLeastUsefulGoFirst) {
  add(1, SlotState::kMapped, true, 0.5);
  add(2, SlotState::kTracked);
  add(3, SlotState::kMapped, false, 3.0);
  add(4, SlotState::kMapped, true, 0.2);
  add(5, SlotState::kMapped, false, 2.0);
  add(6, SlotState::kTracked);
  LoadShedding shedding(slots);
  const std::vector<std::vector<std::uint32_t>> expected = {{}, {6}, {2, 6}, {2, 3, 6}, {2, 3, 5, 6}, {1, 2, 3, 5, 6}};
  for (int limit = 6; limit >= 1; --limit) {
    const std::vector<std::uint32_t>& now = expected[static_cast<std::size_t>(6 - limit)];
    EXPECT_EQ(shedding.apply(limit), now.size());
    EXPECT_EQ(shed(), now) << limit;
    EXPECT_EQ(shedding.followed(), limit);
  }
  for (int limit = 1; limit <= 6; ++limit) {
    shedding.apply(limit);
    EXPECT_EQ(shed(), expected[static_cast<std::size_t>(6 - limit)]) << "taken back in the opposite order";
  }
}

TEST_F(Shedding, WithRoomForAllNothingIsShed) {
  add(1, SlotState::kMapped, true, 0.5);
  add(2, SlotState::kTracked);
  LoadShedding shedding(slots);
  EXPECT_EQ(shedding.apply(8), 0U);
  EXPECT_TRUE(shed().empty());
}

TEST_F(Shedding, TheyDoNotTakeTurnsWhileTheNumberStays) {
  FeatureSlot& a = add(1, SlotState::kMapped, true, 0.5);
  FeatureSlot& b = add(2, SlotState::kMapped, true, 0.6);
  LoadShedding shedding(slots);
  shedding.apply(1);
  EXPECT_TRUE(b.shed);
  std::swap(a.largest_deviation_mm, b.largest_deviation_mm);
  shedding.apply(1);
  EXPECT_TRUE(b.shed);
  EXPECT_FALSE(a.shed);
}

TEST_F(Shedding, OneThatIsLostMakesRoomForOneThatWasShed) {
  FeatureSlot& a = add(1, SlotState::kMapped, true, 0.5);
  FeatureSlot& b = add(2, SlotState::kMapped, true, 0.6);
  LoadShedding shedding(slots);
  shedding.apply(1);
  ASSERT_TRUE(b.shed);
  a.state = SlotState::kEmpty;
  EXPECT_EQ(shedding.apply(1), 0U);
  EXPECT_FALSE(b.shed);
}

// Frames in which the features named are found, with as many followed as `limit` says.
class SheddingInView : public Shedding {
 protected:
  SheddingInView() {
    for (std::uint32_t id = 1; id <= 6; ++id) add(id, SlotState::kMapped, true, 0.1 * id);
  }
  void frames(int n, int limit, const std::vector<std::uint32_t>& seen, bool measurable = true) {
    for (int i = 0; i < n; ++i) {
      ++frame;
      for (FeatureSlot& slot : slots) {
        const bool found = std::find(seen.begin(), seen.end(), slot.id) != seen.end();
        if (found && !slot.shed && slot.state != SlotState::kEmpty) slot.last_found_frame = frame;
      }
      shedding.note(frame, measurable, {});
      shedding.apply(limit);
    }
  }
  std::vector<std::uint32_t> followed() const {
    std::vector<std::uint32_t> ids;
    for (const FeatureSlot& slot : slots) {
      if (slot.state != SlotState::kEmpty && !slot.shed) ids.push_back(slot.id);
    }
    return ids;
  }
  const int a_while = frames_of(LoadShedding::kReview) + frames_of(LoadShedding::kMissesAllowed);
  using Ids = std::vector<std::uint32_t>;

  LoadShedding shedding{slots};
  std::uint64_t frame = 100;
};

TEST_F(SheddingInView, ThoseThatTheScopeHasLeftMakeRoomForThoseThatItShows) {
  frames(1, 2, {1, 2, 3, 4, 5, 6});
  ASSERT_EQ(followed(), (Ids{1, 2}));
  for (const std::size_t left : {0U, 1U, 2U, 3U}) slots[left].in_view = false;
  frames(a_while, 2, {5, 6});
  EXPECT_EQ(followed(), (Ids{5, 6}));
  EXPECT_EQ(shedding.in_sight(), 2);
}

TEST_F(SheddingInView, WhereNoneOfThemIsToBeSeenThereIsRoomForNewOnes) {
  frames(1, 2, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(shedding.in_sight(), 6);
  for (FeatureSlot& slot : slots) slot.in_view = false;
  frames(a_while, 2, {});
  EXPECT_EQ(shedding.in_sight(), 0);
  FeatureSlot& young = add(7, SlotState::kTracked);
  frames(1, 2, {7});
  EXPECT_FALSE(young.shed) << "it is seen";
  EXPECT_EQ(followed().size(), 2U);
}

// Something hides three of them where the map has them in the image.
TEST_F(SheddingInView, HiddenOnesDoNotTakeTurnsAndThoseThatAreSeenAreKept) {
  const Ids seen = {4, 6};
  frames(20 * a_while, 2, seen);
  EXPECT_EQ(followed(), seen);
  int changes = 0;
  for (int i = 0; i < 20; ++i) {
    const Ids before = followed();
    frames(a_while, 2, seen);
    changes += followed() != before ? 1 : 0;
  }
  EXPECT_EQ(changes, 0);
}

TEST_F(SheddingInView, OneThatWasHiddenIsTriedAgainAfterAWhile) {
  frames(4 * a_while, 1, {6});
  ASSERT_EQ(followed(), (Ids{6}));
  frames(frames_of(LoadShedding::kSetAside) + 6 * a_while, 1, {1});
  EXPECT_EQ(followed(), (Ids{1}));
}

TEST_F(SheddingInView, FramesThatCanNotTellWhereToLookCountAgainstNone) {
  frames(1, 2, {1, 2});
  frames(10 * a_while, 2, {}, false);
  EXPECT_EQ(followed(), (Ids{1, 2}));
}

TEST_F(SheddingInView, BetterOnesThatWereShedDoNotReturnWhileTheOthersAreSeen) {
  for (const std::size_t left : {0U, 1U}) slots[left].in_view = false;
  frames(2 * a_while, 2, {3, 4, 5, 6});
  ASSERT_EQ(followed(), (Ids{3, 4}));
  for (const std::size_t left : {0U, 1U}) slots[left].in_view = true;
  frames(10 * a_while, 2, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(followed(), (Ids{3, 4}));
}

TEST_F(Shedding, AShedFeatureSaysSoAndIsNotCalledConvergedForEver) {
  FeatureSlot& slot = add(1, SlotState::kMapped, true, 0.5);
  slot.last_observed = Instant(std::chrono::seconds(100));
  slot.shed = true;
  FeatureSnapshot snapshot;
  describe(slot, slot.last_observed + kBelievedUnseen, FrameDoubts{}, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kConverged);
  EXPECT_EQ(snapshot.reason, FeatureReason::kShed);
  describe(slot, slot.last_observed + kBelievedUnseen + milliseconds(1), FrameDoubts{}, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kConverging);
  EXPECT_EQ(snapshot.reason, FeatureReason::kShed);
}

TEST_F(Shedding, TakenBackAFeatureIsCalledConvergedOnlyWhenItHasBeenObserved) {
  FeatureSlot& slot = add(1, SlotState::kMapped, true, 0.5);
  slot.last_observed = Instant(std::chrono::seconds(100));
  FeatureSnapshot snapshot;
  const Instant now = slot.last_observed + 2 * kBelievedUnseen;
  describe(slot, now, FrameDoubts{}, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kConverging);
  EXPECT_EQ(snapshot.reason, FeatureReason::kNotObserved);
  slot.match_agrees = true;
  describe(slot, now, FrameDoubts{}, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kConverged);
  EXPECT_EQ(snapshot.reason, FeatureReason::kNone);
}

TEST_F(Shedding, AShedFeatureIsNotExpectedToBeSeenNorIsOneOutOfView) {
  FeatureSlot& slot = add(1, SlotState::kMapped, true, 0.5);
  FeatureSnapshot snapshot;
  describe(slot, slot.last_observed, FrameDoubts{}, snapshot);
  EXPECT_TRUE(snapshot.expected);
  slot.shed = true;
  describe(slot, slot.last_observed, FrameDoubts{}, snapshot);
  EXPECT_FALSE(snapshot.expected);
  slot.shed = false;
  slot.in_view = false;
  describe(slot, slot.last_observed, FrameDoubts{}, snapshot);
  EXPECT_FALSE(snapshot.expected);
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/scouts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "core/bank/lanes.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kFrame = 100;

// Features on a grid of 640x480, all of which can scout.
std::vector<FeatureSlot> features(std::size_t count = 120) {
  std::vector<FeatureSlot> slots(count);
  for (FeatureSlot& slot : slots) {
    slot.state = SlotState::kMapped;
    slot.converged = true;
    slot.last_found_frame = kFrame - 1;
    slot.pose_deviation_px = 6.0;
  }
  return slots;
}

std::size_t scouts_of(const std::vector<FeatureSlot>& slots) {
  return static_cast<std::size_t>(
      std::count_if(slots.begin(), slots.end(), [](const FeatureSlot& slot) { return slot.is_scout; }));
}

// Each scout found where `off` has it off its prediction.
void find(std::vector<FeatureSlot>& slots, const std::function<Vector2d(const Vector2d&)>& off) {
  static_cast<void>(choose_scouts(slots, kFrame));
  for (std::size_t i = 0; i < slots.size(); ++i) {
    FeatureSlot& slot = slots[i];
    const Vector2d predicted(40.0 + 50.0 * static_cast<double>(i % 12), 30.0 + 45.0 * static_cast<double>(i / 12));
    slot.off_px = off(predicted);
    slot.match.px = predicted + slot.off_px;
    slot.match.state = MatchState::kFound;
    slot.match_agrees = true;
  }
}

Vector2d linear(const Vector2d& px) { return {7.0 + 0.01 * px.x() - 0.02 * px.y(), -9.0 + 0.03 * px.x()}; }

TEST(Scouts, AreAFewSpreadOverTheFeaturesThatAreSure) {
  std::vector<FeatureSlot> slots = features();
  slots[0].converged = false;
  slots[1].last_found_frame = kFrame - 2;
  slots[2].shed = true;
  slots[3].in_view = false;
  slots[4].state = SlotState::kTracked;
  EXPECT_TRUE(choose_scouts(slots, kFrame));
  EXPECT_EQ(scouts_of(slots), 12U);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_FALSE(slots[i].is_scout) << i;
  const auto last = std::find_if(slots.rbegin(), slots.rend(), [](const FeatureSlot& slot) { return slot.is_scout; });
  EXPECT_LT(last - slots.rbegin(), 24);
  // All the same in the next frame, in which nothing was found in this one.
  EXPECT_FALSE(choose_scouts(slots, kFrame + 1));
  EXPECT_EQ(scouts_of(slots), 0U);
}

TEST(Scouts, AreAsManyInGroupsOfEachOfTwoWorkers) {
  for (const std::size_t count : {96U, 120U, 192U, 200U, 384U}) {
    std::vector<FeatureSlot> slots = features(count);
    ASSERT_TRUE(choose_scouts(slots, kFrame));
    std::array<int, 2> of_worker{};
    for (std::size_t i = 0; i < slots.size(); ++i) of_worker[i / kLanes % 2] += slots[i].is_scout ? 1 : 0;
    EXPECT_EQ(of_worker[0] + of_worker[1], 12) << count;
    EXPECT_LE(std::abs(of_worker[0] - of_worker[1]), 1) << count;
  }
}

TEST(Scouts, AreNoneWhereThePoseIsSureByItself) {
  std::vector<FeatureSlot> slots = features();
  for (FeatureSlot& slot : slots) slot.pose_deviation_px = 1.5;
  EXPECT_FALSE(choose_scouts(slots, kFrame));
  EXPECT_EQ(scouts_of(slots), 0U);
}

TEST(Scouts, AreNoneWhereThereAreHardlyMoreFeaturesThanScouts) {
  std::vector<FeatureSlot> slots = features();
  for (std::size_t i = 23; i < slots.size(); ++i) slots[i].converged = false;
  EXPECT_FALSE(choose_scouts(slots, kFrame));
  EXPECT_EQ(scouts_of(slots), 0U);
}

TEST(Scouts, TellAShiftThatGrowsWithThePlaceInSpiteOfSomeThatMislead) {
  std::vector<FeatureSlot> slots = features();
  find(slots, &linear);
  int misled = 0;
  for (FeatureSlot& slot : slots) {
    if (!slot.is_scout || misled == 2) continue;
    slot.off_px += Vector2d(misled == 0 ? 15 : -20, 10);
    slot.match.px += Vector2d(misled == 0 ? 15 : -20, 10);
    ++misled;
  }
  const CommonShift shift = shift_of_scouts(slots);
  ASSERT_TRUE(shift.known);
  for (const Vector2d& px : {Vector2d(50, 40), Vector2d(320, 240), Vector2d(600, 440)}) {
    EXPECT_LT((shift.at(px) - linear(px)).norm(), 2.0) << px.transpose();
  }
}

TEST(Scouts, TellNothingWhenTooFewAreFoundOrWhenTheyDoNotAgree) {
  std::vector<FeatureSlot> slots = features();
  find(slots, &linear);
  ASSERT_TRUE(shift_of_scouts(slots).known);
  int lost = 0;
  for (FeatureSlot& slot : slots) {
    if (!slot.is_scout || lost == 5) continue;
    if (++lost % 2 == 0) {
      slot.match_agrees = false;
    } else {
      slot.match.state = MatchState::kLowCorrelation;
    }
  }
  EXPECT_FALSE(shift_of_scouts(slots).known);
  find(slots, [](const Vector2d& px) { return Vector2d(20 * std::sin(0.3 * px.x()), 20 * std::cos(0.7 * px.y())); });
  EXPECT_FALSE(shift_of_scouts(slots).known);
}

TEST(Scouts, TellNothingWherePoseAndModelAreSureByThemselves) {
  std::vector<FeatureSlot> slots = features();
  find(slots, &linear);
  for (FeatureSlot& slot : slots) slot.pose_deviation_px = 1.5;
  EXPECT_FALSE(shift_of_scouts(slots).known);
}

TEST(Scouts, TellLessTheFartherAwayTheyAre) {
  std::vector<FeatureSlot> slots = features();
  find(slots, &linear);
  // All in one corner, nearly on one line.
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const Vector2d predicted(40.0 + 0.5 * static_cast<double>(i), 30.0 + 0.25 * static_cast<double>(i % 12));
    slots[i].off_px = linear(predicted);
    slots[i].match.px = predicted + slots[i].off_px;
  }
  const CommonShift shift = shift_of_scouts(slots);
  ASSERT_TRUE(shift.known);
  EXPECT_LT(shift.variance_at({60, 30}), 1.3);
  const Vector2d far(600, 440);
  EXPECT_GT(shift.variance_at(far), 100.0);
  EXPECT_LT((shift.at(far) - linear(far)).squaredNorm(), 9.0 * shift.variance_at(far));
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/map_keeping.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/pipeline/pipeline_settings.hpp"

namespace perimap {
namespace {

// Ten slots in two groups.
struct Keeping : ::testing::Test {
  static constexpr std::size_t kSlots = 10;

  PipelineSettings settings;
  std::vector<FeatureSlot> slots{kSlots};
  std::unique_ptr<MapBank> bank;
  std::vector<FeatureGroup> groups;
  std::unique_ptr<MapKeeping> keeping;
  std::unique_ptr<Breathing> breathing;
  HeartPhase heart;
  SetupBelief setup;

  Keeping() {
    settings.estimator.layout = {2, 2};
    settings.respiration.enabled = true;
    bank = std::make_unique<MapBank>(
        BankSettings{.layout = settings.estimator.layout, .features = static_cast<int>(kSlots)}, Precision::kDouble);
    groups.emplace_back(*bank, 0, std::span(slots).first(kLanes));
    groups.emplace_back(*bank, 1, std::span(slots).subspan(kLanes));
    keeping = std::make_unique<MapKeeping>(slots, *bank, groups);
    breathing = std::make_unique<Breathing>(settings.respiration);
  }

  [[nodiscard]] FeatureMemory feature(std::uint32_t id) const {
    FeatureMemory memory;
    memory.id = id;
    memory.updates = static_cast<int>(id) + 1000;
    memory.converged = id % 2 == 0;
    memory.largest_deviation_mm = 0.01 * id;
    memory.first_observed = Instant(std::chrono::milliseconds(id));
    memory.first_observed_px = Vector2d(id, 2.0 * id);
    memory.last_observed = Instant(std::chrono::seconds(id));
    memory.patch.levels[0].mean = id;
    memory.patch_state.px = Vector2d(3.0 * id, 4.0 * id);
    memory.patch_state.gain = 1.0 + 0.001 * id;
    memory.estimate = prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(id, 2.0, 100.0));
    return memory;
  }
  [[nodiscard]] std::vector<FeatureMemory> features(std::size_t count) const {
    std::vector<FeatureMemory> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back(feature(static_cast<std::uint32_t>(50 - i)));
    return all;
  }
  // What is neither counted nor estimated.
  static void expect_looks(const FeatureMemory& memory, const FeatureMemory& as) {
    EXPECT_EQ(memory.first_observed, as.first_observed);
    EXPECT_EQ(memory.first_observed_px, as.first_observed_px);
    EXPECT_EQ(memory.last_observed, as.last_observed);
    EXPECT_EQ(memory.patch.levels[0].mean, as.patch.levels[0].mean);
    EXPECT_EQ(memory.patch_state.px, as.patch_state.px);
    EXPECT_EQ(memory.patch_state.gain, as.patch_state.gain);
    EXPECT_EQ(memory.converged, as.converged);
    EXPECT_EQ(memory.largest_deviation_mm, as.largest_deviation_mm);
  }
  [[nodiscard]] FeatureEstimate estimate(std::size_t slot) const {
    FeatureEstimate of;
    bank->get(static_cast<int>(slot), of);
    return of;
  }
  // The next batch, as its reader gets it.
  [[nodiscard]] MapFeed::Batch feed(std::uint64_t maps_ended = 0) {
    keeping->fill_feed({*breathing, heart, setup}, maps_ended);
    const MapFeed::Batch* batch = keeping->feed().front();
    EXPECT_NE(batch, nullptr);
    const MapFeed::Batch copy = *batch;
    keeping->feed().give_back();
    return copy;
  }
  void breathe() {
    RespirationMemory memory;
    memory.found = true;
    memory.wave.a[0] = Vector3d(1.0, 2.0, 3.0);
    breathing->recall(memory, Instant(std::chrono::seconds(60)));
    ASSERT_TRUE(breathing->begun());
  }
};

TEST_F(Keeping, WhatIsRecalledIsMappedAsItWas) {
  EXPECT_EQ(keeping->recall(features(3), *breathing), 50U) << "the largest id";
  for (std::size_t i = 0; i < kSlots; ++i) {
    if (i >= 3) {
      EXPECT_EQ(slots[i].state, SlotState::kEmpty);
      continue;
    }
    const FeatureMemory as = feature(static_cast<std::uint32_t>(50 - i));
    EXPECT_EQ(slots[i].state, SlotState::kMapped);
    EXPECT_EQ(slots[i].id, as.id);
    EXPECT_EQ(slots[i].updates, as.updates);
    EXPECT_EQ(slots[i].converged, as.converged);
    EXPECT_EQ(slots[i].recalled_converged, as.converged);
    EXPECT_EQ(slots[i].last_learnt, as.last_observed);
    EXPECT_EQ(slots[i].carried_px, as.patch_state.px);
    EXPECT_EQ(estimate(i).x, as.estimate.x);
    // In the first frame the map alone tells where it is.
    EXPECT_GE(std::uint64_t{0} - slots[i].last_found_frame, kFramesLongAgo);
  }
}

TEST_F(Keeping, WhatIsRecalledAndFedIsTheSameFeature) {
  const std::vector<FeatureMemory> all = features(2);
  static_cast<void>(keeping->recall(all, *breathing));
  const MapFeed::Batch batch = feed();
  for (std::size_t i = 0; i < all.size(); ++i) expect_looks(batch.entries[i].feature, all[i]);
}

TEST_F(Keeping, WhatContradictsItsMapIsNotKept) {
  static_cast<void>(keeping->recall(features(2), *breathing));
  for (int i = 0; i < 1000 && slots[1].health.state() != HealthState::kInconsistent; ++i) {
    static_cast<void>(slots[1].health.add(100.0, true));
  }
  ASSERT_EQ(slots[1].health.state(), HealthState::kInconsistent);
  const MapFeed::Batch batch = feed();
  EXPECT_TRUE(batch.entries[0].mapped);
  EXPECT_FALSE(batch.entries[1].mapped);
}

TEST_F(Keeping, TheLawIsFedAsItIsKnown) {
  LawMemory law;
  law.law = PhaseLaw::kTimeLocked;
  law.usual = Seconds(0.8);
  law.cycles = 12.0;
  HeartPhaseSettings by_image;
  by_image.law_from_image = true;
  heart = HeartPhase(by_image);
  heart.recall(law);
  EXPECT_EQ(feed().law.usual, law.usual);
  EXPECT_EQ(feed().law.cycles, law.cycles);
}

TEST_F(Keeping, NoMoreThanThereIsRoomForAndOnlyOfThisLayout) {
  std::vector<FeatureMemory> all = features(kSlots + 5);
  all[0].estimate = prior_estimate({8, 0}, settings.estimator.prior, Vector3d(0, 0, 100));
  EXPECT_EQ(keeping->recall(all, *breathing), 49U);
  EXPECT_EQ(slots[0].id, 49U);
  EXPECT_EQ(slots[kSlots - 1].id, 50U - kSlots);
  EXPECT_EQ(keeping->recall({}, *breathing), 0U);
}

TEST_F(Keeping, AFeatureThatWasKeptBeforeBreathingWasFoundTakesItsWave) {
  breathe();
  std::vector<FeatureMemory> all = features(2);
  all[0].breathing = true;
  static_cast<void>(keeping->recall(all, *breathing));
  EXPECT_EQ(estimate(0).x, all[0].estimate.x);
  EXPECT_EQ(estimate(0).P, all[0].estimate.P);
  EXPECT_NE(estimate(1).x, all[1].estimate.x);
}

TEST_F(Keeping, TheFeedGoesRoundAllSlotsTwoAtATime) {
  static_cast<void>(keeping->recall(features(kSlots), *breathing));
  slots[3].health = FeatureHealth();
  slots[4].state = SlotState::kStarting;
  for (std::size_t round = 0; round < 2; ++round) {
    for (std::size_t slot = 0; slot < kSlots; slot += MapFeed::kSlotsABatch) {
      const MapFeed::Batch batch = feed(7);
      EXPECT_EQ(batch.maps_ended, 7U);
      for (std::size_t i = 0; i < MapFeed::kSlotsABatch; ++i) {
        EXPECT_EQ(batch.entries[i].slot, slot + i);
        EXPECT_EQ(batch.entries[i].mapped, slot + i != 4);
        if (!batch.entries[i].mapped) continue;
        EXPECT_EQ(batch.entries[i].feature.id, slots[slot + i].id);
        EXPECT_EQ(batch.entries[i].feature.updates, slots[slot + i].updates);
        EXPECT_EQ(batch.entries[i].feature.estimate.x, estimate(slot + i).x);
        EXPECT_FALSE(batch.entries[i].feature.breathing);
      }
    }
  }
}

TEST_F(Keeping, WhatIsFedSaysWhetherBreathingIsInIt) {
  breathe();
  static_cast<void>(keeping->recall(features(2), *breathing));
  const MapFeed::Batch batch = feed();
  EXPECT_TRUE(batch.entries[0].feature.breathing);
  EXPECT_TRUE(batch.respiration.found);
}

TEST_F(Keeping, WhatIsFedIsAsUncertainAsASlowErrorOfTheTrackerMakesIt) {
  static_cast<void>(keeping->recall(features(1), *breathing));
  slots[0].slow_error = std::make_unique<CorrelatedPoseNoise>(settings.estimator.layout.state_size(), 5.0);
  EXPECT_EQ(feed().entries[0].feature.estimate.P, estimate(0).P + slots[0].slow_error->covariance());
}

TEST_F(Keeping, WhatIsFedIsAsUncertainAsErrorsThatComeAgainMakeIt) {
  static_cast<void>(keeping->recall(features(1), *breathing));
  slots[0].repeated.add(Matrix2d::Identity(), Matrix2d::Identity(), 1000.0);
  EXPECT_LT((feed().entries[0].feature.estimate.P - 2.0 * estimate(0).P).norm(), 1e-9);
}

TEST_F(Keeping, WhatIsBelievedOfTheSetUpIsFedToo) {
  EXPECT_FALSE(feed().setup.asked);
  SetupVerdict told;
  told.state = SetupState::kConsistent;
  told.matches = 500;
  told.widening_mm = 0.4;
  setup.add(told, std::chrono::seconds(7));
  const SetupMemory fed = feed().setup;
  EXPECT_TRUE(fed.asked);
  EXPECT_EQ(fed.told.state, SetupState::kConsistent);
  EXPECT_EQ(fed.widening_mm, 0.4);
}

TEST_F(Keeping, TheReaderIsNotHurried) {
  static_cast<void>(keeping->recall(features(kSlots), *breathing));
  keeping->fill_feed({*breathing, heart, setup}, 0);
  for (int i = 0; i < 5; ++i) keeping->fill_feed({*breathing, heart, setup}, 0);
  EXPECT_EQ(keeping->feed().front()->entries[0].slot, 0U);
  keeping->feed().give_back();
  EXPECT_EQ(feed().entries[0].slot, MapFeed::kSlotsABatch);
}

TEST_F(Keeping, AFeatureHasNothingOfTheOneThatTheSlotHadBefore) {
  static_cast<void>(keeping->recall(features(kSlots), *breathing));
  FeatureSlot& slot = slots[4];
  slot.shed = slot.seen_by_last_view = slot.is_scout = slot.match_agrees = slot.follows_something_else = true;
  slot.in_view = false;
  slot.velocity_px = slot.off_px = Vector2d(3.0, 4.0);
  slot.pose_deviation_px = slot.last_learnt_rad = 5.0;
  slot.stale_matches = slot.refused_in_a_row = slot.unseen_frames = 6;
  slot.failed_starts = 2;
  slot.held.push({});
  static_cast<void>(slot.health.add(9.0, true));
  keeping->forget();
  TrackedFeature begun;
  begun.id = 77;
  slot.follow(begun);
  const FeatureSlot fresh;
  EXPECT_EQ(slot.state, SlotState::kTracked);
  EXPECT_EQ(slot.id, 77U);
  EXPECT_EQ(slot.first_observed, fresh.first_observed);
  EXPECT_EQ(slot.first_observed_px, fresh.first_observed_px);
  EXPECT_FALSE(slot.shed || slot.seen_by_last_view || slot.is_scout || slot.match_agrees ||
               slot.follows_something_else || slot.converged || slot.recalled_converged);
  EXPECT_TRUE(slot.in_view);
  EXPECT_EQ(slot.patch.levels[0].mean, fresh.patch.levels[0].mean);
  EXPECT_EQ(slot.patch_state.px, fresh.patch_state.px);
  EXPECT_EQ(slot.carried_px, fresh.carried_px);
  EXPECT_EQ(slot.velocity_px, fresh.velocity_px);
  EXPECT_EQ(slot.off_px, fresh.off_px);
  EXPECT_EQ(slot.pose_deviation_px, fresh.pose_deviation_px);
  EXPECT_EQ(slot.last_found_frame, fresh.last_found_frame);
  EXPECT_EQ(slot.stale_matches + slot.refused_in_a_row + slot.unseen_frames, 0U);
  EXPECT_EQ(slot.held.size(), 0U);
  EXPECT_EQ(slot.failed_starts + slot.updates, 0);
  EXPECT_EQ(slot.health.monitor().count(), fresh.health.monitor().count());
  EXPECT_EQ(slot.last_observed, fresh.last_observed);
  EXPECT_EQ(slot.last_learnt, fresh.last_learnt);
  EXPECT_EQ(slot.last_learnt_rad, fresh.last_learnt_rad);
  EXPECT_EQ(slot.largest_deviation_mm, fresh.largest_deviation_mm);
}

// Every coefficient of the motion, and how uncertain it is in each direction.
TEST_F(Keeping, AMapThatIsMovedKeepsItsMotions) {
  FeatureMemory memory = feature(50);
  const int n = settings.estimator.layout.size();
  for (int i = 0; i < memory.estimate.x.size(); ++i) memory.estimate.x(i) += std::sin(i);
  for (int i = 0; i < n; ++i) memory.estimate.P(i, i) *= 4.0;
  ASSERT_EQ(keeping->recall(std::vector{memory}, *breathing), 50U);
  const Pose X{so3_exp(Vector3d(0.1, -0.2, 0.3)), Vector3d(5.0, -4.0, 3.0)};
  keeping->displace(X, 0.1);
  FeatureEstimate moved;
  bank->get(0, moved);
  EXPECT_EQ((moved.P - moved.P.transpose()).norm(), 0.0);
  for (const double phase : {0.0, 1.0, 3.0}) {
    const Basis b = basis_at(settings.estimator.layout, phase, 0.5 * phase);
    EXPECT_LT((moved.position(b) - X * memory.estimate.position(b)).norm(), 1e-9);
    const Matrix3d more = moved.position_covariance(b) - X.R * memory.estimate.position_covariance(b) * X.R.transpose();
    // Less certain alike in every direction, by less than a millimetre.
    EXPECT_LT((more - more(0, 0) * Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_GT(more(0, 0), 0.1);
    EXPECT_LT(more(0, 0), 1.0);
  }
}

TEST_F(Keeping, WhatIsForgottenIsGoneButForStartsThatAreUnderWay) {
  static_cast<void>(keeping->recall(features(kSlots), *breathing));
  slots[5].state = SlotState::kStarting;
  slots[9].state = SlotState::kTracked;
  keeping->forget();
  for (std::size_t i = 0; i < kSlots; ++i) {
    EXPECT_EQ(slots[i].state, i == 5 ? SlotState::kStarting : SlotState::kEmpty);
    EXPECT_EQ(slots[i].forgotten, i == 5);
    EXPECT_EQ(estimate(i).x.isZero(), i != 5) << "the bank's place is free";
  }
  for (int i = 0; i < 5; ++i) {
    for (const MapFeed::Entry& entry : feed().entries) EXPECT_FALSE(entry.mapped);
  }
}

}  // namespace
}  // namespace perimap

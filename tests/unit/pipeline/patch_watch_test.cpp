#include "core/pipeline/patch_watch.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/feature_stages.hpp"

namespace perimap {
namespace {

// Converged features 7 mm apart on a plane 90 mm before a camera that looks along z, at 20 frames a second. The map is
// off by 0.3 mm, and says so.
struct Patches : ::testing::Test {
  static constexpr double kFocal_px = 250.0;
  static constexpr double kMap_mm = 0.3;
  static constexpr double kMatch_px = 0.5;

  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{1, 0});
  std::vector<FeatureSlot> slots{63};
  PatchWatch watch{slots};
  std::vector<Vector3d> places;
  std::vector<Vector3d> map_errors;
  std::mt19937 generator{5};
  Vector3d dent_W_mm = Vector3d(14.0, 7.0, 90.0);
  double depth_mm = 0.0;  // of the dent, away from the camera
  bool ectopic = false;
  double phase_deviation_s = 0.005;
  bool law_undecided = false;

  Patches() {
    for (int x = -4; x <= 4; ++x) {
      for (int y = -3; y <= 3; ++y) {
        places.emplace_back(7.0 * x, 7.0 * y, 90.0);
        map_errors.emplace_back(kMap_mm * normal3());
      }
    }
    for (std::size_t f = 0; f < slots.size(); ++f) {
      slots[f].id = static_cast<std::uint32_t>(f + 1);
      slots[f].state = SlotState::kMapped;
      slots[f].converged = true;
    }
  }

  Vector3d normal3() {
    std::normal_distribution<double> normal;
    const double x = normal(generator);
    const double y = normal(generator);
    return {x, y, normal(generator)};
  }

  void frame() {
    FrameStamp stamp;
    stamp.sequence = history->count();
    stamp.capture = stamp.arrival = Instant(std::chrono::milliseconds(1000 + 50 * stamp.sequence));
    FrameRecord& record = history->append(stamp);
    record.measurable = true;
    record.phase = {1.0, 7.0, phase_deviation_s, PhaseState::kLocked, false};
    record.phase.ectopic = ectopic;
    record.phase.law_undecided = law_undecided;
    for (std::size_t f = 0; f < slots.size(); ++f) {
      const Vector3d& p = places[f];
      Matrix23d J;
      J << kFocal_px / p.z(), 0.0, -kFocal_px * p.x() / (p.z() * p.z()), 0.0, kFocal_px / p.z(),
          -kFocal_px * p.y() / (p.z() * p.z());
      const double share2 = (p - dent_W_mm).squaredNorm() / (16.0 * 16.0);
      const double share = share2 < 1.0 ? (1.0 - share2) * (1.0 - share2) : 0.0;
      const Vector2d noise = 0.1 * normal3().head<2>();
      slots[f].beside = {true,
                         record.index,
                         J * (share * depth_mm * Vector3d::UnitZ() + map_errors[f]) + noise,
                         J,
                         kMatch_px * kMatch_px * Matrix2d::Identity(),
                         p,
                         kMap_mm * kMap_mm * Matrix3d::Identity()};
      slots[f].held.push({record.index, Vector2d::Zero(), Matrix2d::Identity()});
    }
    watch.watch(record, *history);
  }
  void seconds(double s) {
    for (int i = 0; i < static_cast<int>(20.0 * s); ++i) frame();
  }

  [[nodiscard]] std::size_t pressed() const {
    std::size_t n = 0;
    for (const FeatureSlot& slot : slots) n += slot.pressed ? 1 : 0;
    return n;
  }
  [[nodiscard]] const FeatureSlot& at(double x, double y) const {
    std::size_t best = 0;
    for (std::size_t f = 0; f < places.size(); ++f) {
      if ((places[f] - Vector3d(x, y, 90.0)).norm() < (places[best] - Vector3d(x, y, 90.0)).norm()) best = f;
    }
    return slots[best];
  }
};

TEST_F(Patches, OnlyWhatIsPressedInIsDoubted) {
  seconds(2.0);
  ASSERT_EQ(pressed(), 0U);
  depth_mm = 7.0;
  seconds(1.5);
  EXPECT_EQ(watch.patches(), 1U);
  EXPECT_TRUE(at(14.0, 7.0).pressed);
  EXPECT_TRUE(at(21.0, 7.0).pressed);
  EXPECT_FALSE(at(-14.0, -7.0).pressed);
  EXPECT_LT(2 * pressed(), slots.size());
}

TEST_F(Patches, AreGoodAgainWhenTheyAreLetGo) {
  seconds(2.0);
  depth_mm = 7.0;
  seconds(4.0);
  ASSERT_TRUE(at(14.0, 7.0).pressed);
  depth_mm = 0.0;
  seconds(3.5);
  EXPECT_EQ(watch.patches(), 0U);
  EXPECT_EQ(pressed(), 0U);
}

TEST_F(Patches, StayWhileNobodySeesThem) {
  seconds(2.0);
  depth_mm = 7.0;
  seconds(4.0);
  ASSERT_EQ(watch.patches(), 1U);
  // The frames have no matches.
  for (int i = 0; i < 100; ++i) {
    FrameStamp stamp;
    stamp.sequence = history->count();
    stamp.capture = stamp.arrival = Instant(std::chrono::milliseconds(1000 + 50 * stamp.sequence));
    watch.watch(history->append(stamp), *history);
  }
  EXPECT_TRUE(at(14.0, 7.0).pressed);
}

TEST_F(Patches, TeachNothingFromWhenTheyBegan) {
  seconds(3.0);
  depth_mm = 9.0;
  int frames = 0;
  while (!at(14.0, 7.0).pressed && ++frames < 100) frame();
  ASSERT_LT(frames, 20);
  const FeatureSlot& in_it = at(14.0, 7.0);
  ASSERT_GT(in_it.held.size(), 0U);
  EXPECT_LT(in_it.held[in_it.held.size() - 1].frame_index, history->count() - static_cast<std::uint64_t>(frames));
  // Others are learnt as ever.
  const FeatureSlot& beside = at(-14.0, -7.0);
  EXPECT_EQ(beside.held[beside.held.size() - 1].frame_index, history->count() - 1);
}

TEST_F(Patches, AreNoneWhereTheMapIsOffByWhatItSays) {
  // By chance in one of 1000 maps or so.
  std::size_t told = 0;
  for (int i = 0; i < 100; ++i) {
    for (Vector3d& error : map_errors) error = kMap_mm * normal3();
    watch.forget();
    seconds(3.0);
    told += watch.patches();
  }
  EXPECT_LE(told, 2U);
}

TEST_F(Patches, AreNotToldByWhatMovesOtherwise) {
  depth_mm = 7.0;
  ectopic = true;
  seconds(3.0);
  EXPECT_EQ(watch.patches(), 0U) << "a premature beat";
  ectopic = false;
  phase_deviation_s = 0.03;
  seconds(3.0);
  EXPECT_EQ(watch.patches(), 0U) << "a phase that is not known";
  phase_deviation_s = 0.005;
  law_undecided = true;
  seconds(3.0);
  EXPECT_EQ(watch.patches(), 0U) << "a law that is not known";
}

TEST_F(Patches, AreNotToldOfAMapThatHasNotConverged) {
  for (FeatureSlot& slot : slots) slot.converged = false;
  depth_mm = 7.0;
  seconds(3.0);
  EXPECT_EQ(watch.patches(), 0U);
}

TEST_F(Patches, GoWithTheMap) {
  depth_mm = 7.0;
  seconds(3.0);
  ASSERT_EQ(watch.patches(), 1U);
  watch.forget();
  EXPECT_EQ(watch.patches(), 0U);
  EXPECT_EQ(pressed(), 0U);
}

TEST(PressedFeature, IsInconsistentAndAskedNothingThatAllAreAsked) {
  FeatureSlot slot;
  slot.state = SlotState::kMapped;
  slot.converged = true;
  slot.match_agrees = true;
  const Instant now(std::chrono::seconds(9));
  slot.last_observed = now;
  FeatureSnapshot snapshot;
  describe(slot, now, FrameDoubts{}, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kConverged);
  slot.pressed = true;
  describe(slot, now, FrameDoubts{}, snapshot);
  EXPECT_EQ(snapshot.state, FeatureState::kInconsistent);
  EXPECT_EQ(snapshot.reason, FeatureReason::kInnovationsHigh);
  EXPECT_FALSE(snapshot.held_back);
  EXPECT_FALSE(is_called_converged(slot, now, FrameDoubts{}));
  EXPECT_FALSE(is_asked(slot, Asked::kConverged));
  EXPECT_FALSE(is_asked(slot, Asked::kWellKnown));
  EXPECT_TRUE(is_asked(slot, Asked::kMapped));
}

}  // namespace
}  // namespace perimap

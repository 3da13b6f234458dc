#include "core/pipeline/surface_keeper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "tests/unit/surface/made_organ.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Features on an organ, as mapped ones in their slots, and frames of 30 a second.
class Kept : public ::testing::Test {
 protected:
  static constexpr std::size_t kSlots = 40;

  Kept()
      : bank_({.layout = test::kLayout, .features = static_cast<int>(kSlots)}, Precision::kDouble),
        maker_(test::kLayout, kSlots, 300, true),
        keeper_(slots_, bank_, maker_, milliseconds(500), counters_),
        thread_([this] { maker_.serve(); }) {
    std::mt19937_64 random(81);
    const auto places = test::places_on_disc(kSlots, 40.0, 4.0, random);
    for (std::size_t i = 0; i < kSlots; ++i) {
      FeatureEstimate estimate;
      estimate.x = test::state_of(test::MadeOrgan::coefficients(places[i]));
      estimate.P = 1e-4 * StateMatrix::Identity(estimate.x.size(), estimate.x.size());
      bank_.set(static_cast<int>(i), estimate);
      slots_[i].state = SlotState::kMapped;
      slots_[i].id = static_cast<std::uint32_t>(i + 1);
      slots_[i].converged = true;
    }
  }
  ~Kept() override {
    maker_.dismiss();
    thread_.join();
  }

  [[nodiscard]] Instant capture() const { return Instant(seconds(100)) + frame_.index * milliseconds(33); }
  // So many frames more.
  void frames(int count, const FrameDoubts& doubts = {}) {
    for (int i = 0; i < count; ++i) {
      frame_.stamp.capture = capture();
      frame_.stamp.sequence = 1000 + frame_.index;
      frame_.pose.state = CameraPose::State::kInterpolated;
      keeper_.on_frame(frame_, PhaseLaw::kLinear, doubts);
      ++frame_.index;
    }
  }
  void see_all() {
    for (FeatureSlot& slot : slots_) slot.last_observed = capture();
  }

  std::vector<FeatureSlot> slots_{kSlots};
  MapBank bank_;
  PipelineCounters counters_;
  SurfaceMaker maker_;
  SurfaceKeeper keeper_;
  FrameRecord frame_;
  std::thread thread_;
};

TEST_F(Kept, MakesASurfaceOfAllFeaturesAndAdoptsItAtItsFrame) {
  see_all();
  // Two slots a frame: a round of them all has been gathered with the twentieth; half a second is fifteen frames.
  frames(20 + 14);
  EXPECT_EQ(maker_.newest(), nullptr);
  frames(2);
  const auto made = maker_.newest();
  ASSERT_NE(made, nullptr);
  EXPECT_EQ(made->number, 1U);
  EXPECT_EQ(made->frame_sequence, 1019U);
  ASSERT_TRUE(made->surface.has_value()) << made->refusal.message;
  EXPECT_EQ(made->surface->features() + made->surface->contradicted().size(), kSlots);
  EXPECT_FALSE(made->mesh.triangles.empty());
  frames(30);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_EQ(maker_.newest()->number, 2U);
  EXPECT_FALSE(maker_.withdrawn());
}

TEST_F(Kept, IsMadeOfWhatIsConvergedAndBelieved) {
  see_all();
  slots_[0].converged = false;
  slots_[1].state = SlotState::kStarting;
  slots_[2].last_observed = capture() - seconds(31);
  frames(36);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_EQ(maker_.newest()->surface->features() + maker_.newest()->surface->contradicted().size(), kSlots - 3);
}

TEST_F(Kept, IsNotMadeOfWhatTheSetUpHoldsBack) {
  see_all();
  for (std::size_t i = 0; i < kSlots; ++i) slots_[i].largest_deviation_mm = i < 5 ? 0.8 : 0.3;
  FrameDoubts doubts;
  doubts.converged_within_mm = -1.0;
  frames(36, doubts);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_FALSE(maker_.newest()->surface.has_value()) << "nothing has told of the set-up yet";
  doubts.converged_within_mm = 0.5;
  frames(60, doubts);
  ASSERT_TRUE(maker_.newest()->surface.has_value());
  EXPECT_EQ(maker_.newest()->surface->features() + maker_.newest()->surface->contradicted().size(), kSlots - 5);
}

TEST_F(Kept, WithdrawsASurfaceAtOnceWhenTheSetUpIsDoubtedAndMakesNoneUntilItIsNot) {
  see_all();
  frames(36);
  ASSERT_TRUE(keeper_.there());
  FrameDoubts doubts;
  doubts.setup_doubted = true;
  frames(1, doubts);
  EXPECT_EQ(maker_.newest(), nullptr);
  EXPECT_FALSE(keeper_.there());
  frames(90, doubts);
  EXPECT_FALSE(keeper_.there());
  frames(90);
  EXPECT_TRUE(keeper_.there());
}

// Its own matches have told little yet beside what the surface did.
TEST_F(Kept, IsNotMadeOfWhatBeganOnItUntilThatIsKnownByItself) {
  see_all();
  for (std::size_t i = 0; i < 5; ++i) slots_[i].began_on_surface = true;
  slots_[4].updates = 200;
  frames(36);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_EQ(maker_.newest()->surface->features() + maker_.newest()->surface->contradicted().size(), kSlots - 4);
}

TEST_F(Kept, SaysWhetherThereIsOne) {
  see_all();
  EXPECT_FALSE(keeper_.there());
  frames(36);
  EXPECT_TRUE(keeper_.there());
  keeper_.begin_again();
  EXPECT_FALSE(keeper_.there());
}

TEST_F(Kept, IsNotThereWhereItIsRefused) {
  for (std::size_t i = 7; i < kSlots; ++i) slots_[i].state = SlotState::kEmpty;
  see_all();
  frames(36);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_FALSE(keeper_.there());
}

TEST_F(Kept, IsAsUncertainAsTheSetUpMakesEveryPosition) {
  see_all();
  frames(36);
  const Eigen::MatrixXd certain = maker_.newest()->mesh.covariances_W_mm2;
  const auto support = maker_.newest()->mesh.support;
  FrameDoubts doubts;
  doubts.setup_widening_mm = std::sqrt(1.2);
  frames(30, doubts);
  const auto wider = maker_.newest();
  ASSERT_EQ(wider->number, 2U);
  EXPECT_EQ(wider->mesh.support, support);
  for (const int e : {0, 3, 5}) EXPECT_NEAR((wider->mesh.covariances_W_mm2.row(e) - certain.row(e)).mean(), 0.4, 1e-3);
  for (const int e : {1, 2, 4}) EXPECT_NEAR((wider->mesh.covariances_W_mm2.row(e) - certain.row(e)).mean(), 0.0, 1e-3);
}

TEST_F(Kept, SaysWhyWhereThereAreTooFew) {
  for (std::size_t i = 7; i < kSlots; ++i) slots_[i].state = SlotState::kEmpty;
  see_all();
  frames(36);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_FALSE(maker_.newest()->surface.has_value());
  EXPECT_EQ(maker_.newest()->refusal.kind, SurfaceRefusalKind::kTooFewFeatures);
}

TEST_F(Kept, WithdrawsWhatTheMapDoesNotHoldAnyMore) {
  see_all();
  frames(36);
  ASSERT_NE(maker_.newest(), nullptr);
  frames(20);  // another is under way
  keeper_.begin_again();
  EXPECT_EQ(maker_.newest(), nullptr);
  EXPECT_TRUE(maker_.withdrawn());
  // What was under way is void too; what is made of a whole round since then is not.
  frames(18);
  EXPECT_EQ(maker_.newest(), nullptr);
  frames(40);
  ASSERT_NE(maker_.newest(), nullptr);
  EXPECT_EQ(maker_.newest()->number, 3U);
}

TEST_F(Kept, AsksForNothingBeforeTheCameraIsKnown) {
  see_all();
  for (int i = 0; i < 60; ++i) {
    frame_.stamp.capture = capture();
    keeper_.on_frame(frame_, PhaseLaw::kLinear, {});
    ++frame_.index;
  }
  EXPECT_EQ(maker_.newest(), nullptr);
  frames(17);
  EXPECT_NE(maker_.newest(), nullptr);
}

}  // namespace
}  // namespace perimap

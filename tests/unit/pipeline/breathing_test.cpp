#include "core/pipeline/breathing.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr double kPeriod_s = 4.0;
constexpr double kExactTracker_mm2 = 0.04;
constexpr double kNoisyTracker_mm2 = 1.4 * 1.4;
const Vector3d kDirection(0.1, -0.35, -0.93);

// Frames at 30/s of a patient who breathes every 4 s by 10 mm, at rest most of the time, and a heart that beats every
// 0.8 s.
struct BreathingPatient : ::testing::Test {
  RespirationSettings settings;
  std::unique_ptr<Breathing> breathing;
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{2, 2});
  CardiacClockTracker heart{{}};
  double tracker_mm2 = kExactTracker_mm2;
  FrameRecord* frame = nullptr;
  Breathing::Change change;  // before the last frame
  int begun = 0;

  BreathingPatient() { settings.enabled = true; }

  void make() { breathing = std::make_unique<Breathing>(settings); }

  [[nodiscard]] double time_s() const { return to_seconds(frame->stamp.capture.time_since_epoch()); }
  [[nodiscard]] static double breath_mm(double t_s) {
    return 10.0 * std::pow(std::sin(std::numbers::pi * t_s / kPeriod_s), 4);
  }

  void next_frame() {
    if (breathing == nullptr) make();
    change = breathing->begin_frame(*history);
    if (change.begun) ++begun;
    const Instant capture(milliseconds(5000) + history->count() * std::chrono::microseconds(33'333));
    if (history->count() % 24 == 0) heart.on_r_peak({capture, capture, 1.0, milliseconds(1)});
    frame = &history->append({history->count(), capture, capture + milliseconds(12)});
    CameraPose pose;
    pose.state = CameraPose::State::kInterpolated;
    pose.position_variance_mm2 = tracker_mm2;
    FrameHistory::set_pose(*frame, pose);
    history->set_phase(*frame, heart.clock(), breathing->clock());
    breathing->expect_displacement(*frame);
  }

  // What a map without breathing sees of a frame, and looks for in it.
  void see_displacement() {
    next_frame();
    if (breathing->asks_for_displacement(*frame, false)) {
      breathing->add_displacement(*frame, breath_mm(time_s()) * kDirection);
    }
    breathing->search(*frame);
  }
  void see_displacements(double seconds) {
    for (int i = 0; i < static_cast<int>(30.0 * seconds); ++i) see_displacement();
  }
  // Until the frame before which the map is told.
  bool find() {
    const int before = begun;
    for (int i = 0; i < 30 * 25 && begun == before; ++i) see_displacement();
    return begun > before;
  }
  // What a map with breathing sees: the phase where the patient has it.
  void see_phase(double early_rad = 0.0) {
    next_frame();
    const RespiratoryPhase told = breathing->clock().at(frame->stamp.capture);
    static_cast<void>(
        breathing->observe({ImagePhaseOutcome::kObserved, {frame->stamp.capture, told.phase_rad + early_rad, 0.05}},
                           frame->stamp.capture));
    breathing->search(*frame);
  }
  bool correct() {
    for (int i = 0; i < 30 * 20 && !change.learnt_again && breathing->published().corrected == false; ++i) see_phase();
    return breathing->published().corrected;
  }
  bool lose() {
    for (int i = 0; i < 30 * 3 && breathing->clock().state == RespirationState::kLocked; ++i) {
      next_frame();
      static_cast<void>(breathing->observe({ImagePhaseOutcome::kContradicts, {}}, frame->stamp.capture));
    }
    return breathing->clock().state == RespirationState::kSearching;
  }
};

TEST_F(BreathingPatient, EarlierFramesAreToldThatItIsSearchedFor) {
  next_frame();
  EXPECT_TRUE(change.told_anew);
  EXPECT_FALSE(change.begun || change.map_changes());
  next_frame();
  EXPECT_FALSE(change.told_anew);
  EXPECT_TRUE(breathing->published().doubtful());
}

TEST_F(BreathingPatient, TheMapTakesItAsAStartOnceItsPhaseIsKnown) {
  ASSERT_TRUE(find());
  EXPECT_TRUE(change.told_anew && change.begun && change.map_changes());
  EXPECT_TRUE(change.begun_again) << "with a tracker that is exact";
  EXPECT_FALSE(change.lost_before || change.learnt_again);
  EXPECT_TRUE(breathing->begun());
  EXPECT_NEAR(to_seconds(breathing->clock().period()), kPeriod_s, 0.05);
  next_frame();
  EXPECT_FALSE(change.told_anew || change.map_changes());
}

TEST_F(BreathingPatient, FoundAgainBeforeItWasCorrectedBeginsAnewAndWhatWasLearntIsDoubted) {
  ASSERT_TRUE(find());
  ASSERT_TRUE(lose());
  next_frame();
  EXPECT_TRUE(change.told_anew) << "what is not known is reckoned with again";
  EXPECT_FALSE(change.map_changes() || change.lost_before);
  EXPECT_TRUE(breathing->begun()) << "the map has breathing in it all the same";
  ASSERT_TRUE(find());
  EXPECT_TRUE(change.begun && change.lost_before && change.told_anew);
}

TEST_F(BreathingPatient, IsLearntOnceMoreByTheRateThatTheImagesHaveCorrectedAndThenNoMore) {
  ASSERT_TRUE(find());
  bool told_early = false;
  while (!breathing->clock().corrected) {
    see_phase();
    ASSERT_FALSE(change.learnt_again);
    ASSERT_LT(history->count(), 30U * 60U);
    told_early = told_early || breathing->published().corrected;
  }
  EXPECT_FALSE(told_early || breathing->published().corrected) << "before the map has followed";
  next_frame();
  EXPECT_TRUE(change.learnt_again && change.told_anew && change.map_changes());
  EXPECT_FALSE(change.begun);
  EXPECT_TRUE(breathing->published().corrected);
  EXPECT_FALSE(breathing->published().doubtful());
  ASSERT_TRUE(lose());
  next_frame();
  EXPECT_FALSE(change.told_anew || change.map_changes()) << "what was learnt stays, and the history with it";
  EXPECT_TRUE(breathing->published().doubtful());
}

TEST_F(BreathingPatient, NothingIsLearntTwiceWithATrackerThatIsNotExact) {
  tracker_mm2 = kNoisyTracker_mm2;
  ASSERT_TRUE(find());
  EXPECT_TRUE(change.begun);
  EXPECT_FALSE(change.begun_again);
  ASSERT_TRUE(correct());
  EXPECT_FALSE(change.learnt_again || change.map_changes());
  EXPECT_TRUE(change.told_anew);
}

TEST_F(BreathingPatient, ItPaysToLearnAgainByTheTrackersErrorAlone) {
  EXPECT_FALSE(pays_to_learn_again(*history)) << "nothing";
  next_frame();
  ASSERT_GT(frame->pose.position_variance_mm2, 20.0);
  EXPECT_TRUE(pays_to_learn_again(*history)) << "the displacement that is not known is no error of the tracker's";
  tracker_mm2 = kNoisyTracker_mm2;
  next_frame();
  EXPECT_FALSE(pays_to_learn_again(*history));
}

// The status shows what is published, and so does the reason of each surface.
TEST_F(BreathingPatient, BreathingThatIsSuspectedIsPublishedWhereItIsOff) {
  settings.enabled = false;
  for (int i = 0; i < 30 * 25 && (breathing == nullptr || !breathing->published().suspected); ++i) see_displacement();
  EXPECT_TRUE(breathing->published().suspected);
  EXPECT_TRUE(breathing->published().doubtful());
  EXPECT_EQ(breathing->published().state, RespirationState::kOff);
  next_frame();
  EXPECT_FALSE(change.map_changes());
  EXPECT_NEAR(frame->respiration.deviation_mm, settings.displacement_mm, 1e-12) << "it is reckoned with";
}

TEST_F(BreathingPatient, WhereItIsOffEveryThirdFrameOfAKnownPhaseIsWatched) {
  settings.enabled = false;
  const auto asked_in = [this](int frames) {
    int asked = 0;
    for (int i = 0; i < frames; ++i) {
      next_frame();
      asked += breathing->asks_for_displacement(*frame, true) ? 1 : 0;
    }
    return asked;
  };
  EXPECT_EQ(asked_in(30), 0) << "a phase that is not known displaces the surface too";
  static_cast<void>(asked_in(30));
  EXPECT_EQ(asked_in(90), 30);
}

TEST_F(BreathingPatient, WhereItIsOnEachFrameThatDoesNotTellItsPhaseIsAsked) {
  next_frame();
  const Instant capture = frame->stamp.capture;
  EXPECT_TRUE(breathing->asks_for_displacement(*frame, false));
  EXPECT_FALSE(breathing->asks_for_displacement(*frame, true));
  EXPECT_TRUE(breathing->observe({ImagePhaseOutcome::kObserved, {capture, 0.0, 0.1}}, capture));
  EXPECT_TRUE(breathing->observe({ImagePhaseOutcome::kContradicts, {}}, capture));
  EXPECT_FALSE(breathing->observe({ImagePhaseOutcome::kCanNotTell, {}}, capture));
  EXPECT_FALSE(breathing->observe({ImagePhaseOutcome::kTentative, {}}, capture));
}

TEST_F(BreathingPatient, TheSurfaceIsExpectedWhereItWasSeenLastUntilThatIsTooOld) {
  next_frame();
  EXPECT_EQ(frame->displacement_mm.norm(), 0.0);
  EXPECT_NEAR(frame->displacement_deviation_mm, settings.displacement_mm, 1e-12);
  breathing->add_displacement(*frame, Vector3d(3.0, 0.0, 4.0));
  next_frame();
  EXPECT_NEAR(frame->displacement_mm.norm(), 5.0, 1e-12);
  EXPECT_NEAR(frame->displacement_deviation_mm, 1.0 + 15.0 / 30.0, 1e-3);
  for (int i = 0; i < 10; ++i) next_frame();
  EXPECT_EQ(frame->displacement_mm.norm(), 0.0) << "no better known than without";
  EXPECT_NEAR(frame->displacement_deviation_mm, settings.displacement_mm, 1e-12);
}

TEST_F(BreathingPatient, ARecalledMapWithBreathingInItIsNotLearntAnew) {
  ASSERT_TRUE(find());
  ASSERT_TRUE(correct());
  const RespirationMemory memory = breathing->memory();
  Breathing next(settings);
  next.recall(memory, frame->stamp.capture + std::chrono::seconds(1));
  EXPECT_TRUE(next.begun());
  EXPECT_TRUE(next.published().corrected);
  const Breathing::Change nothing = next.begin_frame(*history);
  EXPECT_FALSE(nothing.told_anew || nothing.map_changes());
  Breathing without(settings);
  without.recall({}, frame->stamp.capture);
  EXPECT_FALSE(without.begun());
  EXPECT_TRUE(without.begin_frame(*history).told_anew);
}

// As of a patient of whom nothing is known.
TEST_F(BreathingPatient, AnotherPatientsIsAnotherBreathing) {
  ASSERT_TRUE(find());
  ASSERT_TRUE(correct());
  *breathing = Breathing(settings);
  EXPECT_FALSE(breathing->begun());
  EXPECT_FALSE(breathing->published().corrected);
  next_frame();
  EXPECT_TRUE(change.told_anew);
  EXPECT_EQ(frame->displacement_mm.norm(), 0.0);
  ASSERT_TRUE(find());
  EXPECT_FALSE(change.lost_before);
}

}  // namespace
}  // namespace perimap

#include "core/pipeline/setup_watcher.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <thread>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr double kWithin_mm = 1.0;
const BasisLayout kWatchedLayout{2, 0};

PipelineSettings watched_settings() {
  PipelineSettings settings;
  settings.camera.width = 640;
  settings.camera.height = 480;
  settings.camera.fx = settings.camera.fy = 500.0;
  settings.camera.cx = 320.0;
  settings.camera.cy = 240.0;
  settings.estimator.layout = kWatchedLayout;
  settings.features.maximum = 14;
  settings.lockstep = true;
  return settings;
}

// 20 frames a second of a camera that sways before features that beat with a heart, every 800 ms.
class Watched : public ::testing::Test {
 protected:
  Watched() : thread_([this] { watcher_.serve(); }) {
    for (int i = 0; i < settings_.features.maximum; ++i) {
      FeatureEstimate estimate;
      estimate.x = StateVector::Zero(kWatchedLayout.state_size());
      const int n = kWatchedLayout.size();
      estimate.x(0) = 15.0 * std::cos(2.0 * i);
      estimate.x(n) = 12.0 * std::sin(1.3 * i);
      estimate.x(2 * n) = 4.0 * std::sin(0.7 * i);
      estimate.x(2 * n + 1) = 2.0 + 0.1 * i;
      estimate.P = 1e-4 * StateMatrix::Identity(estimate.x.size(), estimate.x.size());
      bank_.set(i, estimate);
      coefficients_.push_back(estimate.x);
      FeatureSlot& slot = slots_[static_cast<std::size_t>(i)];
      slot.state = SlotState::kMapped;
      slot.id = static_cast<std::uint32_t>(i + 1);
      slot.match.state = MatchState::kFound;
      slot.match.covariance_px2 = 0.09 * Matrix2d::Identity();
    }
  }
  ~Watched() override {
    watcher_.dismiss();
    thread_.join();
  }

  void seconds(double count) {
    for (const int until = frames_ + static_cast<int>(20.0 * count); frames_ < until;) next_frame();
  }
  void only(std::size_t features) {
    for (std::size_t i = features; i < slots_.size(); ++i) slots_[i].match.state = MatchState::kTooFar;
  }
  [[nodiscard]] FrameDoubts doubts() const {
    FrameDoubts told;
    watcher_.tell(told, kWithin_mm);
    return told;
  }

  PipelineSettings settings_ = watched_settings();
  SetupWatcher watcher_{settings_};
  double sway_ = 1.0;
  Pose hand_eye_error_;  // of what is configured
  double scatter_px_ = 0.3;
  CardiacClockTracker clock_{{}};

 private:
  void next_frame() {
    const Instant capture{milliseconds(3000 + 50 * frames_)};
    while (Instant(milliseconds(next_beat_ms_ + 60)) <= capture) {
      const Instant t{milliseconds(next_beat_ms_)};
      clock_.on_r_peak({t, t + milliseconds(60), 1.0, milliseconds(1)});
      history_->refresh_phases(clock_.clock(), {});
      next_beat_ms_ += 800;
    }
    FrameRecord& frame = history_->append({static_cast<std::uint64_t>(frames_), capture, capture + milliseconds(12)});
    const double t_s = to_seconds(capture.time_since_epoch());
    const auto sway = [&](double amplitude, double frequency_hz) {
      return sway_ * amplitude * std::sin(2.0 * std::numbers::pi * frequency_hz * t_s);
    };
    const Pose X_WC{so3_exp(Vector3d(sway(0.05, 0.11), sway(0.04, 0.17), sway(0.15, 0.053))),
                    {sway(33.0, 0.127), sway(25.0, 0.097), -90.0 + sway(12.0, 0.062)}};
    CameraPose told;
    told.state = CameraPose::State::kInterpolated;
    told.X_WC = X_WC * hand_eye_error_;
    told.position_variance_mm2 = 0.01;
    told.rotation_variance_rad2 = 1e-7;
    FrameHistory::set_pose(frame, told);
    history_->set_phase(frame, clock_.clock(), {});
    std::normal_distribution<double> scatter(0.0, scatter_px_);
    const double phase_rad = 2.0 * std::numbers::pi * (t_s / 0.8 - 1000.0 / 800.0);
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      const Vector3d p = position_of(coefficients_[i], basis_at(kWatchedLayout, phase_rad));
      Vector2d px;
      static_cast<void>(settings_.camera.project(X_WC.inverse() * p, px));
      slots_[i].match.px = px + Vector2d(scatter(random_), scatter(random_));
    }
    watcher_.adopt(frame);
    watcher_.keep(*history_, slots_, bank_);
    ++frames_;
  }

  std::unique_ptr<FrameHistory> history_ = std::make_unique<FrameHistory>(kWatchedLayout);
  std::vector<FeatureSlot> slots_ = std::vector<FeatureSlot>(14);
  std::vector<StateVector> coefficients_;
  MapBank bank_{{.layout = kWatchedLayout, .features = 14}, Precision::kDouble};
  std::mt19937 random_{7};
  int next_beat_ms_ = 1000;
  int frames_ = 0;
  std::thread thread_;
};

TEST_F(Watched, IsAskedOnceThereIsEnoughAndConsistentWhereItIsRight) {
  seconds(4.0);
  EXPECT_EQ(watcher_.belief().judged(), 0U) << "80 frames whose cycles have ended are not there yet";
  EXPECT_LT(doubts().converged_within_mm, 0.0);
  seconds(8.0);
  EXPECT_GT(watcher_.belief().judged(), 1U);
  EXPECT_EQ(watcher_.belief().told().state, SetupState::kConsistent);
  EXPECT_FALSE(doubts().setup_doubted);
  EXPECT_GT(doubts().converged_within_mm, 0.9 * kWithin_mm);
  EXPECT_TRUE(watcher_.status_belief().asked());
}

TEST_F(Watched, IsDoubtedWhereTheHandEyeIsTurned) {
  hand_eye_error_.R = so3_exp(Vector3d(0.05, 0.0, 0.0));
  seconds(14.0);
  EXPECT_TRUE(doubts().setup_doubted);
  EXPECT_TRUE(watcher_.belief().told().blamed[index_of(SetupPart::kHandEyeTurn)]);
  EXPECT_EQ(watcher_.status_belief().told().state, SetupState::kDoubted);
}

// However long nothing tells.
TEST_F(Watched, IsNotAskedByAScopeThatRests) {
  sway_ = 0.0;
  seconds(40.0);
  EXPECT_GT(watcher_.belief().judged(), 0U);
  EXPECT_EQ(watcher_.belief().told().state, SetupState::kUndetermined);
  EXPECT_LT(doubts().converged_within_mm, 0.0);
  sway_ = 1.0;
  seconds(20.0);
  EXPECT_TRUE(watcher_.belief().asked()) << "it has moved";
  EXPECT_GT(doubts().converged_within_mm, 0.0);
}

TEST_F(Watched, IsNotAskedByWhatNoSetUpExplains) {
  scatter_px_ = 15.0;
  seconds(40.0);
  EXPECT_GT(watcher_.belief().judged(), 0U);
  EXPECT_FALSE(watcher_.belief().asked());
  EXPECT_LT(doubts().converged_within_mm, 0.0);
}

TEST_F(Watched, IsNotAskedByFewFeatures) {
  only(5);
  seconds(40.0);
  EXPECT_EQ(watcher_.belief().judged(), 0U);
  EXPECT_LT(doubts().converged_within_mm, 0.0);
}

TEST_F(Watched, ARoundCountsForNothingWhosePhasesAreToldAnew) {
  for (int i = 0; i < 30; ++i) {
    seconds(0.5);
    watcher_.retell_phases(clock_.clock());
  }
  EXPECT_EQ(watcher_.belief().judged(), 0U) << "in 15 s";
  seconds(8.0);
  EXPECT_GT(watcher_.belief().judged(), 0U);
}

// 0.7 s after they have been told, not after the time between two rounds.
TEST_F(Watched, WhatWasToldAnewIsJudgedAtOnce) {
  while (watcher_.belief().judged() == 0) seconds(0.05);
  seconds(0.9);  // the next one is under way
  watcher_.retell_phases(clock_.clock());
  const std::uint64_t judged = watcher_.belief().judged();
  seconds(0.8);
  EXPECT_EQ(watcher_.belief().judged(), judged + 1);
}

TEST_F(Watched, GoesOnAsAnEarlierRunBelieved) {
  SetupMemory memory;
  memory.asked = true;
  memory.widening_mm = 0.8;
  memory.told.state = SetupState::kConsistent;
  watcher_.recall(memory);
  EXPECT_NEAR(doubts().converged_within_mm, 0.6, 1e-12);
  EXPECT_EQ(doubts().setup_widening_mm, 0.8);
  EXPECT_EQ(watcher_.status_belief().told().state, SetupState::kConsistent);
}

TEST_F(Watched, WhatIsBelievedStaysForAnotherPatient) {
  seconds(12.0);
  const std::uint64_t judged = watcher_.belief().judged();
  ASSERT_TRUE(watcher_.belief().asked());
  watcher_.begin_window_anew();
  seconds(3.0);
  EXPECT_EQ(watcher_.belief().judged(), judged) << "its window is not long enough yet";
  EXPECT_TRUE(watcher_.belief().asked());
}

}  // namespace
}  // namespace perimap

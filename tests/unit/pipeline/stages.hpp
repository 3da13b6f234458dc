// A group of features with its history, frames and housekeeping, taken through
// the stages by hand.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/feature_life.hpp"
#include "core/pipeline/match_covariance.hpp"
#include "core/pipeline/start_progress.hpp"

namespace perimap {

using std::chrono::milliseconds;

// A camera at the origin looking along z, which keeps still or sways, beats every 800 ms, frames every 33 ms from 5 s
// on, or as a test says. Beats are known ahead, so that every frame's phase is exact at once, but where a test says
// otherwise. Tests that need one feature use the first slot. A match is learnt a frame after it was found, because the
// sweep comes before the search.
struct Stages : ::testing::Test {
  PipelineSettings settings;
  PixelModel model;
  CardiacClockTracker clock{{}};
  RespiratoryClock respiration;
  std::unique_ptr<FrameHistory> history;
  std::vector<FeatureSlot> slots{2};
  FeatureSlot* slot = slots.data();
  std::unique_ptr<MapBank> bank;
  std::unique_ptr<FeatureGroup> group;
  FrameJob job;
  int frame_ms = 33;
  int next_beat_ms = 1000;
  int beats_known_ahead_ms = 2000;
  milliseconds beat_deviation{1};
  double pose_variance_mm2 = 0.0;
  double sway_mm = 0.0;
  FrameRecord* current = nullptr;

  Stages() {
    settings.camera = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0};
    settings.estimator.layout.cardiac_harmonics = 2;
    model.camera = settings.camera;
    history = std::make_unique<FrameHistory>(settings.estimator.layout);
    bank =
        std::make_unique<MapBank>(BankSettings{.layout = settings.estimator.layout, .features = 2}, Precision::kDouble);
    group = std::make_unique<FeatureGroup>(*bank, 0, slots);
    beat_until(5000);
    slots[0].id = 1;
    slots[1].id = 2;
  }

  void beat_until(int ms) {
    for (; next_beat_ms <= ms; next_beat_ms += 800) {
      const Instant t(milliseconds{next_beat_ms});
      clock.on_r_peak({t, t + milliseconds(60), 1.0, beat_deviation});
    }
  }

  void next_frame() {
    const auto n = static_cast<int>(history->count());
    const Instant capture(milliseconds(5000 + frame_ms * n));
    beat_until(5000 + frame_ms * n + beats_known_ahead_ms);
    FrameRecord& frame = history->append({static_cast<std::uint64_t>(n), capture, capture + milliseconds(12)});
    CameraPose pose;
    pose.state = CameraPose::State::kInterpolated;
    pose.position_variance_mm2 = pose_variance_mm2;
    pose.X_WC.t.x() = sway_mm * std::sin(0.1 * n);
    FrameHistory::set_pose(frame, pose);
    history->set_phase(frame, clock.clock(), respiration);
    history->refresh_phases(clock.clock(), respiration);
    job.frame = current = &frame;
    job.about_capture = bases_about(settings.estimator.layout, frame.phase, frame.respiration);
    job.history = history.get();
    job.evaluated_b.fill(basis_at(settings.estimator.layout, 1.0));
    job.plan.end = kCovariances;
    for (FeatureSlot& s : slots) s.match = PatchMatch{};
    group->sweep(job);
  }

  void found_at(const Vector2d& px, int lane = 0) {
    FeatureSlot& found = slots[static_cast<std::size_t>(lane)];
    found.match.state = MatchState::kFound;
    found.match.px = px;
    found.match.covariance_px2 = 0.05 * Matrix2d::Identity();
    found.match_agrees = (px - Vector2d(320, 240)).norm() < 20.0;
    found.last_found_frame = found.last_told_frame = job.frame->index;
    hold_match(found, job);
  }

  LifeEvent learn_frame() {
    group->learn(model, settings.estimator);
    return advance(*slot, *bank, 0, job, model, settings);
  }

  // A mapped feature at (0, 0, 100) mm, seen at the image centre, with little deviation.
  FeatureEstimate still_feature() const {
    FeatureEstimate estimate = prior_estimate(settings.estimator.layout, settings.estimator.prior, Vector3d(0, 0, 100));
    estimate.P *= 1e-4;
    return estimate;
  }
  void map_feature(int lane = 0) {
    slots[static_cast<std::size_t>(lane)].state = SlotState::kMapped;
    bank->set(lane, still_feature());
  }

  std::vector<FeatureSnapshot> shown() {
    ShardSnapshot publisher;
    ShardSnapshot model_view;
    group->evaluate(job, publisher, model_view);
    EXPECT_EQ(publisher.features.size(), model_view.features.size());
    return publisher.features;
  }
};

}  // namespace perimap

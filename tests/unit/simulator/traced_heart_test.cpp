// A heart that moves as a recorded trace does.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "core/angle/angle.hpp"
#include "drivers/standins/simulator/made_ecg.hpp"
#include "drivers/standins/simulator/played_trace.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "drivers/standins/trace/hindsight.hpp"
#include "drivers/standins/truth/truth_messages.hpp"

namespace perimap {
namespace {

// Two points, cycles of 0.9 s with a fast part at a sixth of each, breaths of 4 s.
MotionTrace beating(double length_s) {
  MotionTrace trace{{"A", "B"}, 0.0, 0.04, {}};
  const auto samples = static_cast<Eigen::Index>(length_s / trace.period_s);
  trace.positions.resize(samples, 6);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double t = static_cast<double>(i) * trace.period_s;
    const double phase = kTwoPi * t / 0.9;
    for (Eigen::Index k = 0; k < 6; ++k) {
      const double size = 1.0 + 0.1 * static_cast<double>(k);
      trace.positions(i, k) = static_cast<double>(3 * k) + size * std::tanh(3.0 * std::sin(phase - kTwoPi / 6.0)) +
                              0.8 * std::sin(kTwoPi * t / 4.0);
    }
  }
  return trace;
}

std::shared_ptr<const HeartTrace> heart(double length_s = 18.0) {
  MotionTrace motion = beating(length_s);
  Hindsight hindsight = *in_hindsight(motion);
  return std::make_shared<const HeartTrace>(HeartTrace{std::move(motion), std::move(hindsight)});
}

SurfaceTrace two_points() {
  SurfaceTrace trace{from_ns(1'000'000'000), std::chrono::milliseconds(100), 10.0, {}, {}};
  trace.places_W = {Vector3d(0.0, 0.0, 0.0), Vector3d(40.0, 0.0, 0.0)};
  for (int i = 0; i < 6; ++i) {
    trace.displacements_W.emplace_back(i, 0.0, 0.0);
    trace.displacements_W.emplace_back(0.0, -2.0 * i, 0.0);
  }
  return trace;
}

TEST(SurfaceTrace, APlaceMovesAsThePointThatIsNearAndBetweenThemAsTheMean) {
  const SurfaceTrace trace = two_points();
  const TracedPlace at(trace, from_ns(1'250'000'000));
  EXPECT_LT((at.displacement(Vector3d(-5.0, 0.0, 0.0)) - Vector3d(2.5, 0.0, 0.0)).norm(), 0.01);
  EXPECT_LT((at.displacement(Vector3d(20.0, 3.0, 0.0)) - Vector3d(1.25, -2.5, 0.0)).norm(), 1e-9);
  EXPECT_LT((at.displacement(Vector3d(5000.0, 0.0, 0.0)) - Vector3d(0.0, -5.0, 0.0)).norm(), 1e-9);
}

TEST(SurfaceTrace, BeforeAndAfterItsSamplesThePlaceStays) {
  const SurfaceTrace trace = two_points();
  const Vector3d here(0.0, 0.0, 0.0);
  EXPECT_NEAR(TracedPlace(trace, from_ns(0)).displacement(here).x(), 0.0, 1e-2);
  EXPECT_NEAR(TracedPlace(trace, from_ns(9'000'000'000)).displacement(here).x(), 5.0, 1e-2);
}

TEST(SurfaceTrace, WhatIsNoneIsRefused) {
  EXPECT_TRUE(check(SurfaceTrace{}));
  EXPECT_TRUE(check(two_points()));
  SurfaceTrace odd = two_points();
  odd.displacements_W.pop_back();
  EXPECT_FALSE(check(odd));
  SurfaceTrace still = two_points();
  still.period = Duration(0);
  EXPECT_FALSE(check(still));
  SurfaceTrace flat = two_points();
  flat.reach_mm = 0.0;
  EXPECT_FALSE(check(flat));
  SurfaceTrace infinite = two_points();
  infinite.displacements_W[3].x() = std::nan("");
  EXPECT_FALSE(check(infinite));
}

TEST(SurfaceTrace, IsTheSameAsAMessage) {
  const SurfaceTrace trace = two_points();
  TraceBuffers buffers;
  const auto back = surface_trace(borrow_truth_trace(trace, buffers));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->first, trace.first);
  EXPECT_EQ(back->period, trace.period);
  EXPECT_EQ(back->places_W, trace.places_W);
  EXPECT_EQ(back->displacements_W, trace.displacements_W);
  buffers.places.pop_back();
  EXPECT_FALSE(surface_trace(perimap_TruthTrace{}));
}

TEST(Hindsight, FindsTheBeatsATenthOfASecondBeforeTheFastestPartOfEachCycle) {
  const auto found = in_hindsight(beating(18.0));
  ASSERT_TRUE(found);
  ASSERT_GE(found->beats_s.size(), 18U);
  for (std::size_t i = 1; i < found->beats_s.size(); ++i) {
    EXPECT_NEAR(found->beats_s[i] - found->beats_s[i - 1], 0.9, 0.03);
  }
  // It moves fastest at a sixth and at two thirds of each cycle, alike.
  const double within = std::fmod(found->beats_s[5] + 0.1 + 9.0, 0.45);
  EXPECT_NEAR(within, 0.15, 0.04);
  // Of 0.8 sqrt(3 / 2) mm.
  EXPECT_NEAR(found->breath_mm, 0.98, 0.1);
}

TEST(Hindsight, OfAFewSecondsIsRefused) { EXPECT_FALSE(in_hindsight(beating(4.0))); }

TEST(PlayedTrace, BeginsAnewWithoutAJumpAndWithoutALostBeat) {
  const auto played = PlayedTrace::create(heart(), 7);
  ASSERT_TRUE(played);
  const SurfaceTrace surface = played->surface(Pose{}, from_ns(0), 1.0, 60.0);
  EXPECT_TRUE(check(surface));
  double fastest = 0.0, fastest_of_trace = 0.0;
  for (std::size_t i = 2; i < surface.displacements_W.size(); i += 2) {
    fastest = std::max(fastest, (surface.displacements_W[i] - surface.displacements_W[i - 2]).norm());
  }
  const MotionTrace motion = beating(18.0);
  for (Eigen::Index i = 1; i < motion.samples(); ++i) {
    fastest_of_trace =
        std::max(fastest_of_trace, (motion.positions.row(i).head<3>() - motion.positions.row(i - 1).head<3>()).norm());
  }
  EXPECT_LT(fastest, 1.1 * fastest_of_trace);
  const auto beats = played->beats_s(20.0, 70.0);
  ASSERT_GE(beats.size(), 95U);
  for (std::size_t i = 1; i < beats.size(); ++i) EXPECT_NEAR(beats[i] - beats[i - 1], 0.9, 0.12);
}

TEST(PlayedTrace, EachSeedBeginsElsewhere) {
  const auto trace = heart();
  EXPECT_NE(PlayedTrace::create(trace, 1)->beats_s(0.0, 3.0), PlayedTrace::create(trace, 2)->beats_s(0.0, 3.0));
  EXPECT_EQ(PlayedTrace::create(trace, 1)->beats_s(0.0, 3.0), PlayedTrace::create(trace, 1)->beats_s(0.0, 3.0));
}

TEST(MadeEcg, HasItsHighestPeakAtEachBeat) {
  const EcgRecord record = made_ecg({1.0, 1.9, 2.6, 3.7}, 3);
  for (const std::uint32_t beat : record.beat_samples) {
    const auto around = record.samples.begin() + beat;
    EXPECT_LE(std::abs(std::max_element(around - 150, around + 150) - around), 2);
    EXPECT_GT(record.mV(beat), 1.0F);
  }
}

TEST(Simulation, MovesTheSurfaceAsTheTraceDoesAndBeatsWithIt) {
  SimulationSettings settings;
  settings.width = 64;
  settings.height = 64;
  settings.duration = std::chrono::seconds(4);
  settings.trace = heart();
  const auto simulation = Simulation::create(settings);
  ASSERT_TRUE(simulation) << simulation.error().message;
  const GroundTruth& truth = simulation->truth();
  EXPECT_EQ(truth.mesh().harmonics, 0U);
  const auto hit = truth.first_hit(simulation->frames()[0].X_WC, Vector3d(0.0, 0.0, 1.0), simulation->start());
  ASSERT_TRUE(hit);
  const SurfaceTrace& trace = truth.trace();
  const Instant t = simulation->start() + std::chrono::milliseconds(1700);
  const Vector3d moved = truth.position(*hit, t) - truth.position(*hit, simulation->start());
  const TracedPlace now(trace, t), before(trace, simulation->start());
  const Vector3d middle = 0.5 * (trace.places_W[0] + trace.places_W[1]);
  EXPECT_GT(moved.norm(), 0.2);
  EXPECT_LT((moved - now.displacement(middle) + before.displacement(middle)).norm(), 0.3 * moved.norm());
  std::vector<Vector3d> vertices(truth.mesh().vertex_count);
  truth.vertices_at(t, vertices);
  Vector3d p = Vector3d::Zero();
  for (std::size_t c = 0; c < 3; ++c)
    p += hit->barycentric[c] * vertices[truth.mesh().triangles[3 * hit->triangle + c]];
  EXPECT_LT((p - truth.position(*hit, t)).norm(), 1e-9);
  const auto& peaks = truth.motion().r_peaks;
  for (std::size_t i = 1; i < peaks.size(); ++i) EXPECT_NEAR(to_seconds(peaks[i] - peaks[i - 1]), 0.9, 0.12);
}

TEST(Simulation, OfATraceHasNoBreathingBesideIt) {
  SimulationSettings settings;
  settings.trace = heart();
  settings.respiration_mm = 5.0;
  EXPECT_FALSE(Simulation::create(settings));
}

}  // namespace
}  // namespace perimap

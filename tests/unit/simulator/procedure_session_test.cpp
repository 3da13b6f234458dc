// What the events of a procedure do to a simulated session.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "drivers/standins/simulator/ecg_script.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

SimulationSettings settings_with(std::vector<ProcedureEvent> events, Duration duration = seconds(20)) {
  SimulationSettings settings;
  settings.width = 96;
  settings.height = 72;
  settings.duration = duration;
  settings.frames_per_s = 10.0;
  settings.tracker_dropouts_per_min = 0.0;
  settings.procedure.events = std::move(events);
  return settings;
}

Simulation simulate(const SimulationSettings& settings) {
  auto simulation = Simulation::create(settings);
  EXPECT_TRUE(simulation.has_value()) << (simulation ? "" : simulation.error().message);
  return *std::move(simulation);
}

std::vector<std::uint8_t> picture(const Simulation& simulation, std::size_t frame) {
  RenderWorkspace workspace;
  std::vector<std::uint8_t> image(static_cast<std::size_t>(simulation.settings().width) * simulation.settings().height);
  simulation.render(frame, workspace, image);
  return image;
}

double difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

double deviation(const std::vector<std::uint8_t>& image) {
  double sum = 0.0, squares = 0.0;
  for (const std::uint8_t level : image) sum += level, squares += static_cast<double>(level) * level;
  const auto n = static_cast<double>(image.size());
  return std::sqrt(squares / n - sum / n * sum / n);
}

constexpr std::size_t kBefore = 40, kWithin = 80, kAfter = 160;  // frames; events last from 5 to 12 s

TEST(ProcedureSession, WhatHidesTheOrganChangesItsPicturesMeanwhileAndNoOthers) {
  const Simulation plain = simulate(settings_with({}));
  for (const Happening& what :
       {Happening(Withdrawn{}), Happening(Wiped{}), Happening(Fogged{3.0}), Happening(Smoke{3.0}),
        Happening(Blood{0.6}), Happening(InstrumentSeen{}), Happening(Electrosurgery{})}) {
    const Simulation session = simulate(settings_with({{seconds(5), seconds(7), what}}));
    EXPECT_EQ(picture(session, kBefore), picture(plain, kBefore)) << kind_of(what);
    EXPECT_GT(difference(picture(session, kWithin), picture(plain, kWithin)), 1.0) << kind_of(what);
    EXPECT_EQ(picture(session, kAfter), picture(plain, kAfter)) << kind_of(what);
  }
}

TEST(ProcedureSession, FogAndSmokeTakeContrast) {
  const double clear = deviation(picture(simulate(settings_with({})), kWithin));
  for (const Happening& what : {Happening(Fogged{2.0}), Happening(Smoke{3.0})}) {
    EXPECT_LT(deviation(picture(simulate(settings_with({{seconds(5), seconds(7), what}})), kWithin)), 0.75 * clear)
        << kind_of(what);
  }
}

TEST(ProcedureSession, AMovedOrganIsMovedInItsPicturesAndInTheTruth) {
  const Simulation plain = simulate(settings_with({}));
  Retraction to;
  to.shift_mm = {8.0, 0.0, 0.0};
  const Simulation session = simulate(settings_with({{seconds(5), seconds(1), to}}));
  const auto place = [&](const Simulation& s, std::size_t frame) {
    std::vector<Vector3d> vertices(s.truth().mesh().vertex_count);
    s.truth().vertices_at(s.frames()[frame].stamp.capture, vertices);
    return vertices;
  };
  EXPECT_EQ(place(session, kBefore), place(plain, kBefore));
  const auto moved = place(session, kAfter), old = place(plain, kAfter);
  for (std::size_t v = 0; v < moved.size(); v += 100) EXPECT_NEAR((moved[v] - old[v]).norm(), 8.0, 1e-9);
  EXPECT_EQ(picture(session, kBefore), picture(plain, kBefore));
  EXPECT_GT(difference(picture(session, kAfter), picture(plain, kAfter)), 3.0);
  // To the right in the resting view.
  const Vector3d right_W = session.frames()[kAfter].X_WC.R.col(0);
  EXPECT_GT((moved[0] - old[0]).dot(right_W), 7.0);
}

TEST(ProcedureSession, APointOfTheSurfaceIsWhereTheMovedVerticesHaveIt) {
  Dent dent;
  dent.depth_mm = 8.0;
  dent.radius_mm = 25.0;
  Insufflation gas;
  gas.rise_mm = 5.0;
  gas.stretch_percent = 4.0;
  const Simulation session = simulate(settings_with(
      {{seconds(5), seconds(2), gas}, {seconds(7), seconds(5), dent}, {seconds(8), seconds(1), TableTilt{4.0, -2.0}}}));
  const Simulation::Frame& frame = session.frames()[kWithin];
  const SurfaceView view = session.truth().view(frame.X_WC, frame.stamp.capture);
  std::vector<Vector3d> vertices(session.truth().mesh().vertex_count);
  session.truth().vertices_at(frame.stamp.capture, vertices);
  for (const double x : {-0.2, 0.0, 0.2}) {
    const auto point = view.first_hit({x, 0.05, 1.0});
    ASSERT_TRUE(point);
    Vector3d p = Vector3d::Zero();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      p += point->barycentric[corner] * vertices[session.truth().mesh().triangles[3 * point->triangle + corner]];
    }
    EXPECT_NEAR((p - session.truth().position(*point, frame.stamp.capture)).norm(), 0.0, 1e-9);
    // And that is where the ray meets it.
    const Vector3d p_C = frame.X_WC.inverse() * p;
    EXPECT_NEAR(p_C.x() / p_C.z(), x, 1e-9);
  }
}

TEST(ProcedureSession, AWithdrawnScopeIsWhereItsTrackerSaysItIs) {
  const Simulation plain = simulate(settings_with({}));
  const Simulation session = simulate(settings_with({{seconds(5), seconds(7), Withdrawn{}}}));
  EXPECT_NEAR((session.frames()[kWithin].X_WC.t - plain.frames()[kWithin].X_WC.t).norm(), 160.0, 1e-6);
  const auto reading = static_cast<std::size_t>(8.05 * session.settings().tracker_rate_hz);
  const TrackerSample sample = session.tracker_sample(reading, {});
  const Pose X_WC = sample.X_WS * session.hand_eye_X_SC();
  EXPECT_NEAR((X_WC.t - session.frames()[kWithin].X_WC.t).norm(), 0.0, 1.0);
}

TEST(ProcedureSession, TheTrackerLosesItsToolAndIsBentByMetal) {
  const Simulation plain = simulate(settings_with({}));
  const Simulation session = simulate(
      settings_with({{seconds(5), seconds(2), ToolHidden{}}, {seconds(10), seconds(6), Metal{{5.0, 0.0, 0.0}, 2.0}}}));
  EXPECT_EQ(session.tracker_sample(400, {}).state, ToolState::kOk);
  EXPECT_EQ(session.tracker_sample(600, {}).state, ToolState::kMissing);
  EXPECT_EQ(session.tracker_sample(800, {}).state, ToolState::kOk);
  const Pose bent = session.tracker_sample(1300, {}).X_WS, straight = plain.tracker_sample(1300, {}).X_WS;
  EXPECT_NEAR((bent.t - straight.t - Vector3d(5.0, 0.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(so3_log(bent.R * straight.R.transpose()).norm(), 0.0349, 1e-3);
}

TEST(ProcedureSession, ElectrosurgeryReachesEcgAndTrackerAtOnce) {
  const Simulation plain = simulate(settings_with({}));
  Electrosurgery arcs;
  arcs.tracker_mm = 3.0;
  const Simulation session = simulate(settings_with({{seconds(5), seconds(3), arcs}}));
  double tracker2 = 0.0, ecg2 = 0.0;
  for (std::size_t k = 510; k < 790; ++k) {
    tracker2 += (session.tracker_sample(k, {}).X_WS.t - plain.tracker_sample(k, {}).X_WS.t).squaredNorm() / 280.0;
  }
  EXPECT_NEAR(std::sqrt(tracker2), 3.0 * std::sqrt(3.0), 0.6);
  for (std::size_t i = 0; i < session.ecg().size(); ++i) {
    const Duration since = session.ecg()[i].first_sample_time - session.start();
    for (std::uint32_t k = 0; k < session.ecg()[i].count; ++k) {
      const double more = session.ecg()[i].mV[k] - plain.ecg()[i].mV[k];
      if (since < milliseconds(4950) || since > seconds(8)) {
        EXPECT_EQ(more, 0.0);
      }
      ecg2 += more * more / (3.0 * 360.0);
    }
  }
  EXPECT_GT(std::sqrt(ecg2), 0.3);
}

TEST(ProcedureSession, LeadsAreOffMeanwhile) {
  const Simulation session = simulate(settings_with({{seconds(5), seconds(3), LeadsOff{}}}));
  for (const EcgBlock& block : session.ecg()) {
    const Duration since = block.first_sample_time - session.start();
    EXPECT_EQ(block.lead_off, since >= seconds(5) && since < seconds(8));
  }
}

TEST(ProcedureSession, AnEctopicRunHasManyEarlyBeatsAndTheRecordGoesOnAfterIt) {
  const Simulation plain = simulate(settings_with({}, seconds(40)));
  const Simulation session = simulate(settings_with({{seconds(10), seconds(10), EctopicRun{}}}, seconds(40)));
  const auto& r_peaks = session.truth().motion().r_peaks;
  int early_within = 0, early_outside = 0;
  for (std::size_t i = 2; i < r_peaks.size(); ++i) {
    EXPECT_GT(r_peaks[i], r_peaks[i - 1] + milliseconds(200));
    EXPECT_LT(r_peaks[i], r_peaks[i - 1] + milliseconds(2000));
    const bool early = to_seconds(r_peaks[i] - r_peaks[i - 1]) < 0.8 * to_seconds(r_peaks[i - 1] - r_peaks[i - 2]);
    const Duration since = r_peaks[i] - session.start();
    if (early) ++(since > seconds(10) && since < seconds(23) ? early_within : early_outside);
  }
  EXPECT_GE(early_within, 3);
  EXPECT_LE(early_outside, 1);
  // No step where one stretch follows another.
  for (std::size_t i = 1; i < session.ecg().size(); ++i) {
    EXPECT_LT(std::abs(session.ecg()[i].mV[0] - session.ecg()[i - 1].mV[3]), 1.0F) << i;
  }
  EXPECT_EQ(session.ecg()[800].mV, plain.ecg()[800].mV) << "before the run it is the record";
}

TEST(ProcedureSession, ARecordBeginsAnewWhereTheSessionIsLonger) {
  SimulationSettings settings = settings_with({{seconds(5), seconds(1), LeadsOff{}}}, std::chrono::minutes(40));
  settings.frames_per_s = 1.0;
  settings.tracker_rate_hz = 1.0;
  const Simulation session = simulate(settings);
  const auto& r_peaks = session.truth().motion().r_peaks;
  EXPECT_GT(r_peaks.back(), session.start() + std::chrono::minutes(40));
  for (std::size_t i = 1; i < r_peaks.size(); ++i) {
    EXPECT_GT(r_peaks[i], r_peaks[i - 1] + milliseconds(300));
    EXPECT_LT(r_peaks[i], r_peaks[i - 1] + milliseconds(2000));
  }
}

TEST(ProcedureSession, ACameraWhoseDelayGrewShowsWhatWasBeforeItsStamp) {
  const Simulation plain = simulate(settings_with({}));
  const Simulation session = simulate(settings_with({{seconds(5), seconds(2), CameraDelay{100.0}}}));
  EXPECT_EQ(picture(session, kBefore), picture(plain, kBefore));
  // A tenth of a second is one frame here: the same scene, with this frame's noise.
  EXPECT_LT(difference(picture(session, kWithin), picture(plain, kWithin - 1)), 2.0);
  EXPECT_GT(difference(picture(session, kWithin), picture(plain, kWithin)),
            1.5 * difference(picture(session, kWithin), picture(plain, kWithin - 1)));
  EXPECT_NEAR((session.frames()[kWithin].X_WC.t - plain.frames()[kWithin - 1].X_WC.t).norm(), 0.0, 1e-6);
  EXPECT_EQ(session.frames()[kWithin].stamp.capture, plain.frames()[kWithin].stamp.capture);
}

TEST(ProcedureSession, ATrackerWhoseDelayGrewStampsItsPosesLate) {
  const Simulation plain = simulate(settings_with({}));
  const Simulation session = simulate(settings_with({{seconds(5), seconds(2), TrackerDelay{30.0}}}));
  EXPECT_EQ(session.tracker_sample(400, {}).source_time, plain.tracker_sample(400, {}).source_time);
  const TrackerSample late = session.tracker_sample(1000, {}), usual = plain.tracker_sample(1000, {});
  EXPECT_NEAR(to_seconds(late.source_time - usual.source_time), 0.030, 1e-9);
  EXPECT_EQ(late.X_WS.t, usual.X_WS.t);
  EXPECT_GT(late.arrival, late.source_time);
}

TEST(ProcedureSession, AScopeThatIsTurnedTwiceIsSeenSo) {
  SimulationSettings settings = settings_with({{seconds(5), seconds(1), ScopeTurnedInHead{60.0, 1.0}},
                                               {seconds(12), seconds(1), ScopeTurnedInHead{90.0, 1.0}}});
  settings.held = ScopeHeld{90.0 * 3.14159265358979 / 180.0, 1.0};
  const Simulation session = simulate(settings);
  EXPECT_NEAR(session.camera_truth(session.frames()[kWithin]).scope_rotation_rad, 1.0472, 1e-3);
  EXPECT_NEAR(session.camera_truth(session.frames()[kAfter]).scope_rotation_rad, 1.5708, 1e-3);
  SimulationSettings still = settings;
  still.procedure.events.clear();
  const Simulation unturned = simulate(still);
  EXPECT_GT(difference(picture(session, kWithin), picture(unturned, kWithin)), 1.0);
  EXPECT_EQ(picture(session, kAfter), picture(unturned, kAfter));
}

TEST(ProcedureSession, RefusesWhatCanNotBe) {
  const auto error_of = [](const SimulationSettings& settings) {
    const auto simulation = Simulation::create(settings);
    return simulation ? std::string("accepted") : simulation.error().message;
  };
  EXPECT_EQ(error_of(settings_with({{seconds(5), seconds(1), ScopeTurnedInHead{}}})),
            "scope-turn: expected a field stop, whose notch tells of it");
  EXPECT_EQ(error_of(settings_with({{seconds(30), seconds(1), LeadsOff{}}})),
            "procedure: leads-off begins at 30 s, expected before the end at 20 s");
  EXPECT_EQ(error_of(settings_with({{seconds(5), milliseconds(50), TrackerDelay{-90.0}}})),
            "tracker-delay at 5 s: expected at most 500 ms a second, got -90 ms in 0.05 s");
  SimulationSettings other_rate = settings_with({{seconds(5), seconds(3), EctopicRun{}}});
  other_rate.ecg_record = "03700181";
  EXPECT_EQ(error_of(other_rate), "ectopic-run: expected an ECG record of 360 Hz, as 119 is, got 03700181 of 500 Hz");
}

}  // namespace
}  // namespace perimap

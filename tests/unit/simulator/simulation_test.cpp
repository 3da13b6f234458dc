#include "drivers/standins/simulator/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/standins/simulator/ecg_record.hpp"

namespace perimap {
namespace {

SimulationSettings small() {
  SimulationSettings settings;
  settings.width = 64;
  settings.height = 64;
  settings.duration = std::chrono::seconds(30);
  return settings;
}

Simulation simulate(const SimulationSettings& settings) {
  auto simulation = Simulation::create(settings);
  EXPECT_TRUE(simulation.has_value()) << (simulation ? "" : simulation.error().message);
  return *std::move(simulation);
}

TEST(Simulation, EverythingArrivesAfterItsOwnStampAndInOrder) {
  const Simulation simulation = simulate(small());
  Instant before{};
  std::size_t next[3] = {0, 0, 0};
  for (const Simulation::Arrival& arrival : simulation.arrivals()) {
    EXPECT_LE(before, arrival.arrival);
    before = arrival.arrival;
    EXPECT_EQ(arrival.index, next[static_cast<std::size_t>(arrival.source)]++) << "a source's data overtook its own";
    switch (arrival.source) {
      case Simulation::Source::kCamera:
        EXPECT_GT(arrival.arrival, simulation.frames()[arrival.index].stamp.capture);
        break;
      case Simulation::Source::kTracker:
        EXPECT_GT(arrival.arrival, simulation.tracker_sample(arrival.index, {}).source_time);
        break;
      case Simulation::Source::kEcg: {
        const EcgBlock& block = simulation.ecg()[arrival.index];
        EXPECT_GT(arrival.arrival, block.last_sample_time());
        break;
      }
      case Simulation::Source::kRespiration:
        ADD_FAILURE() << "nobody asked for a respiration channel";
        break;
    }
  }
  EXPECT_EQ(next[0], 900U);
  EXPECT_EQ(next[1], 3000U);
  EXPECT_EQ(next[2], 2700U);
}

TEST(Simulation, StampsRiseWithinEachSource) {
  const Simulation simulation = simulate(small());
  for (std::size_t i = 1; i < simulation.frames().size(); ++i) {
    EXPECT_GT(simulation.frames()[i].stamp.capture, simulation.frames()[i - 1].stamp.capture);
    EXPECT_GT(simulation.frames()[i].stamp.arrival, simulation.frames()[i - 1].stamp.arrival);
    EXPECT_EQ(simulation.frames()[i].stamp.sequence, simulation.frames()[i - 1].stamp.sequence + 1);
  }
  for (std::size_t i = 1; i < simulation.tracker_sample_count(); ++i)
    EXPECT_GT(simulation.tracker_sample(i, {}).source_time, simulation.tracker_sample(i - 1, {}).source_time);
  for (std::size_t i = 1; i < simulation.ecg().size(); ++i) {
    const auto gap = simulation.ecg()[i].first_sample_time - simulation.ecg()[i - 1].first_sample_time;
    EXPECT_NEAR(to_seconds(gap), 4.0 / 360.0, 2e-9);
    EXPECT_EQ(simulation.ecg()[i].device_sequence, simulation.ecg()[i - 1].device_sequence + 4);
  }
}

TEST(Simulation, TrackerNoiseHasTheStatedNormInThreeDimensions) {
  SimulationSettings settings = small();
  settings.duration = std::chrono::seconds(60);
  const Simulation simulation = simulate(settings);
  const TrackerNoise noise{1.4, 0.5 * std::numbers::pi / 180.0};
  double position2 = 0.0;
  double rotation2 = 0.0;
  double lag_product = 0.0;
  Vector3d previous = Vector3d::Zero();
  int count = 0;
  for (std::size_t i = 0; i < simulation.tracker_sample_count(); ++i) {
    const TrackerSample exact = simulation.tracker_sample(i, {});
    if (exact.state != ToolState::kOk) continue;
    const TrackerSample noisy = simulation.tracker_sample(i, noise);
    const Vector3d error = noisy.X_WS.t - exact.X_WS.t;
    position2 += error.squaredNorm();
    rotation2 += so3_log(exact.X_WS.R.transpose() * noisy.X_WS.R).squaredNorm();
    lag_product += error.dot(previous);
    previous = error;
    ++count;
  }
  // 5900 readings of three axes: the RMS is known to about 0.4 %.
  EXPECT_NEAR(std::sqrt(position2 / count), 1.4, 0.03);
  EXPECT_NEAR(std::sqrt(rotation2 / count), noise.rotation_rms_rad, 0.02 * noise.rotation_rms_rad);
  EXPECT_LT(std::abs(lag_product / position2), 0.03) << "the noise is not white";
}

TEST(Simulation, ASlowTrackerErrorKeepsItsNormAndFallsToOneEthInItsTime) {
  SimulationSettings settings = small();
  settings.duration = std::chrono::seconds(600);
  settings.tracker_dropouts_per_min = 0.0;
  settings.tracker_correlation = std::chrono::milliseconds(500);
  const Simulation simulation = simulate(settings);
  std::vector<Vector3d> errors;
  double square = 0.0;
  for (std::size_t i = 0; i < simulation.tracker_sample_count(); ++i) {
    errors.push_back(simulation.tracker_sample(i, {1.4, 0.0}).X_WS.t - simulation.tracker_sample(i, {}).X_WS.t);
    square += errors.back().squaredNorm();
  }
  const auto count = static_cast<double>(errors.size());
  const std::size_t lag = 50;  // 0.5 s
  double product = 0.0;
  for (std::size_t i = lag; i < errors.size(); ++i) product += errors[i].dot(errors[i - lag]);
  // 600 s hold about 600 independent errors of three axes.
  EXPECT_NEAR(std::sqrt(square / count), 1.4, 0.12);
  EXPECT_NEAR(product / square, std::exp(-1.0), 0.12);
}

TEST(Simulation, ExactTrackerAndHandEyeGiveTheCamera) {
  SimulationSettings settings = small();
  settings.tracker_dropouts_per_min = 0.0;
  const Simulation simulation = simulate(settings);
  const Simulation::Frame& frame = simulation.frames()[400];
  std::size_t i = 0;
  while (simulation.tracker_sample(i + 1, {}).source_time <= frame.stamp.capture) ++i;
  const TrackerSample a = simulation.tracker_sample(i, {});
  const TrackerSample b = simulation.tracker_sample(i + 1, {});
  const double s = to_seconds(frame.stamp.capture - a.source_time) / to_seconds(b.source_time - a.source_time);
  const Pose X_WC = interpolate(a.X_WS, b.X_WS, s) * simulation.hand_eye_X_SC();
  // What remains is the hand's tremor between two readings.
  EXPECT_LT((X_WC.t - frame.X_WC.t).norm(), 0.05);
  EXPECT_LT(so3_log(X_WC.R.transpose() * frame.X_WC.R).norm(), 5e-4);
}

TEST(Simulation, AStuckTrackerGivesOneReadingWhileItsStampsGoOn) {
  SimulationSettings settings = small();
  settings.tracker_dropouts_per_min = 0.0;
  settings.tracker_stuck = {{std::chrono::milliseconds(500), std::chrono::milliseconds(200)}};
  const Simulation simulation = simulate(settings);
  int same = 0;
  for (std::size_t i = 1; i < simulation.tracker_sample_count(); ++i) {
    const TrackerSample before = simulation.tracker_sample(i - 1, {1.0, 0.01});
    const TrackerSample sample = simulation.tracker_sample(i, {1.0, 0.01});
    same += sample.X_WS.t == before.X_WS.t && sample.X_WS.R == before.X_WS.R ? 1 : 0;
    EXPECT_EQ(sample.device_frame, before.device_frame + 1);
    EXPECT_GT(sample.source_time, before.source_time);
  }
  EXPECT_NEAR(same, 0.2 * settings.tracker_rate_hz, 1.0);
}

// Which of the first pictures are the ones before, bit for bit.
std::vector<std::size_t> repeated_pictures(const SimulationSettings& settings) {
  const Simulation simulation = simulate(settings);
  RenderWorkspace workspace;
  std::vector<std::uint8_t> before, image(static_cast<std::size_t>(settings.width) * settings.height);
  std::vector<std::size_t> repeated;
  for (std::size_t i = 0; i < 24; ++i) {
    before = image;
    simulation.render(i, workspace, image);
    if (image == before) repeated.push_back(i);
  }
  return repeated;
}

TEST(Simulation, AStuckCameraGivesItsLastPictureAgain) {
  SimulationSettings settings = small();
  // At 30 frames/s.
  settings.camera_stuck = {{std::chrono::milliseconds(500), std::chrono::milliseconds(200)}};
  EXPECT_EQ(repeated_pictures(settings), (std::vector<std::size_t>{15, 16, 17, 18, 19, 20}));
}

TEST(Simulation, ACameraThatRepeatsGivesEachPictureSoOften) {
  SimulationSettings settings = small();
  settings.camera_repeats = 3;
  EXPECT_EQ(repeated_pictures(settings),
            (std::vector<std::size_t>{1, 2, 4, 5, 7, 8, 10, 11, 13, 14, 16, 17, 19, 20, 22, 23}));
}

TEST(Simulation, TrackerLosesTheToolAsOftenAsAskedAndSaysSo) {
  SimulationSettings settings = small();
  settings.duration = std::chrono::seconds(60);
  settings.tracker_dropouts_per_min = 5.0;
  const Simulation simulation = simulate(settings);
  int dropouts = 0;
  bool missing_before = false;
  Instant begin{};
  for (std::size_t i = 0; i < simulation.tracker_sample_count(); ++i) {
    const TrackerSample sample = simulation.tracker_sample(i, {1.0, 0.01});
    const bool missing = sample.state == ToolState::kMissing;
    if (missing && !missing_before) {
      ++dropouts;
      begin = sample.source_time;
    }
    if (!missing && missing_before) {
      EXPECT_GE(sample.source_time - begin, std::chrono::milliseconds(40));
      EXPECT_LE(sample.source_time - begin, std::chrono::milliseconds(320));
    }
    EXPECT_EQ(missing, !sample.X_WS.t.allFinite()) << "a missing tool's pose must not look like one";
    missing_before = missing;
  }
  EXPECT_EQ(dropouts, 5);

  settings.tracker_dropouts_per_min = 0.0;
  const Simulation steady = simulate(settings);
  for (std::size_t i = 0; i < steady.tracker_sample_count(); ++i)
    ASSERT_EQ(steady.tracker_sample(i, {}).state, ToolState::kOk);
}

TEST(Simulation, TheHeartBeatsToTheEcgItSends) {
  const Simulation simulation = simulate(small());
  // At each R peak of the motion the ECG stream stands higher than most of it (record 100: upright QRS).
  constexpr double kSampleRate_hz = 360.0;
  std::vector<float> all;
  for (const EcgBlock& block : simulation.ecg())
    for (const float mV : block.samples()) all.push_back(mV);
  std::vector<float> sorted = all;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 95 / 100),
                   sorted.end());
  const float high = sorted[sorted.size() * 95 / 100];
  int beats = 0;
  for (const Instant r_peak : simulation.truth().motion().r_peaks) {
    const auto sample = std::llround(to_seconds(r_peak - simulation.start()) * kSampleRate_hz);
    if (sample < 0 || sample >= static_cast<long long>(all.size())) continue;
    EXPECT_GT(all[static_cast<std::size_t>(sample)], high);
    ++beats;
  }
  EXPECT_GT(beats, 25);
}

TEST(Simulation, BeatsCoverTheSessionWithAMargin) {
  const Simulation simulation = simulate(small());
  const auto& r_peaks = simulation.truth().motion().r_peaks;
  const Instant end = simulation.start() + simulation.settings().duration;
  EXPECT_GE(std::count_if(r_peaks.begin(), r_peaks.end(), [&](Instant r) { return r < simulation.start(); }), 8);
  EXPECT_GE(std::count_if(r_peaks.begin(), r_peaks.end(), [&](Instant r) { return r > end; }), 3);
}

TEST(Simulation, TheScopeSweepsWideAndKeepsItsDistance) {
  SimulationSettings settings = small();
  const Simulation simulation = simulate(settings);
  std::vector<Vector3d> heart(simulation.truth().mesh().vertex_count);
  Vector3d low = Vector3d::Constant(1e9);
  Vector3d high = Vector3d::Constant(-1e9);
  for (std::size_t i = 0; i < simulation.frames().size(); i += 10) {
    const Simulation::Frame& frame = simulation.frames()[i];
    low = low.cwiseMin(frame.X_WC.t);
    high = high.cwiseMax(frame.X_WC.t);
    simulation.truth().vertices_at(frame.stamp.capture, heart);
    double nearest = 1e9;
    for (const Vector3d& p : heart) nearest = std::min(nearest, (p - frame.X_WC.t).norm());
    EXPECT_GT(nearest, 80.0);
    EXPECT_LT(nearest, 145.0);
  }
  EXPECT_GT((high - low).norm(), 50.0);
}

TEST(Simulation, SaysWhichSettingIsOutOfRange) {
  const auto error = [](auto change) {
    SimulationSettings settings = small();
    change(settings);
    const auto simulation = Simulation::create(settings);
    return simulation ? std::string("no error") : simulation.error().message;
  };
  EXPECT_EQ(error([](auto& s) { s.width = 641; }), "size: 641x64 is not even in both directions");
  EXPECT_EQ(error([](auto& s) { s.frames_per_s = 0.0; }), "fps: 0 is outside 1 to 1000 Hz");
  EXPECT_EQ(error([](auto& s) { s.ecg_record = "99"; }),
            "there is no ECG record '99'; choose one of 100, 105, 106, 119, 123, 03700181");
  EXPECT_EQ(error([](auto& s) { s.frames_per_s = std::nan(""); }), "fps: nan is outside 1 to 1000 Hz");
  EXPECT_NE(error([](auto& s) { s.ecg_start = std::chrono::seconds(1); }).find("ECG start: 1 s is outside"),
            std::string::npos);
}

TEST(EcgRecord, EveryRecordIsWhole) {
  for (const char* name : {"100", "105", "106", "119", "123"}) {
    const auto record = load_ecg_record(name);
    ASSERT_TRUE(record.has_value()) << record.error().message;
    EXPECT_EQ(record->samples.size(), 650000U) << name;
    EXPECT_GT(record->beat_samples.size(), 1400U) << name;
    EXPECT_LT(record->beat_samples.size(), 2700U) << name;
  }
}

}  // namespace
}  // namespace perimap

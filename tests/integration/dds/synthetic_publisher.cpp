// Publishes surfaces of a made-up heart at a fixed rate, as a stand-in for perimapd: what is under test is the way from
// a writer to readers in other processes.
//
//   synthetic_publisher DOMAIN READERS SAMPLES [RATE_HZ [FEATURES]]
//
// Waits until READERS readers of `surface` are connected, then publishes SAMPLES surfaces with sequence numbers from 0,
// with the other topics beside them.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <thread>
#include <vector>

#include "daemon/dds/bounded_string.hpp"
#include "daemon/dds/writer.hpp"

namespace perimap {
namespace {

constexpr Duration kLatency = std::chrono::milliseconds(50);
constexpr double kCardiacRate = 2.0 * std::numbers::pi * 1.2;  // rad/s
constexpr int kHarmonics = 8;

void sleep_until(Instant deadline) {
  const std::int64_t ns = to_ns(deadline);
  const std::timespec when{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) != 0) {
  }
}

template <class T>
void name_stream(T& sample) {
  dds::assign(sample.source, "synthetic");
  dds::assign(sample.stream, "frame");
}

class Heart {
 public:
  explicit Heart(std::size_t features)
      : surface_features_(features), model_features_(features), coefficients_(features * kCoefficients) {
    name_stream(surface_);
    dds::assign(surface_.frame_id, "tracker");
    surface_.state = perimap_SURFACE_GOOD;
    surface_.features._buffer = surface_features_.data();
    surface_.features._length = surface_.features._maximum = static_cast<std::uint32_t>(features);
    for (std::size_t i = 0; i < features; ++i) {
      surface_features_[i].id = static_cast<std::uint32_t>(i);
      surface_features_[i].state = perimap_FEATURE_CONVERGED;
      for (const int diagonal : {0, 3, 5}) {
        surface_features_[i].covariance_W_mm2[diagonal] = 0.01 * static_cast<double>(1 + i % 4);
      }
      model_features_[i].id = static_cast<std::uint32_t>(i);
      model_features_[i].state = perimap_FEATURE_CONVERGED;
      model_features_[i].coefficients_W_mm._buffer = coefficients_.data() + i * kCoefficients;
      model_features_[i].coefficients_W_mm._length = model_features_[i].coefficients_W_mm._maximum = kCoefficients;
    }
    name_stream(model_);
    dds::assign(model_.frame_id, "tracker");
    model_.cardiac_harmonics = kHarmonics;
    model_.features._buffer = model_features_.data();
    model_.features._length = model_.features._maximum = static_cast<std::uint32_t>(features);
  }

  const perimap_Surface& surface_at(Instant release, std::uint64_t sequence) {
    const double phase = phase_at(release);
    surface_.sample_sequence = sequence;
    surface_.frame_sequence = sequence;
    surface_.capture_time_ns = to_ns(release - kLatency);
    surface_.release_time_ns = to_ns(release);
    surface_.valid_time_ns = to_ns(release);
    surface_.valid_until_ns = to_ns(release + kLatency);
    surface_.cardiac_phase_rad = phase;
    surface_.cardiac_phase_rate_rad_per_s = kCardiacRate;
    for (std::size_t i = 0; i < surface_features_.size(); ++i) {
      surface_features_[i].position_W_mm[0] = static_cast<double>(i) + std::cos(phase);
      surface_features_[i].velocity_W_mm_per_s[0] = -kCardiacRate * std::sin(phase);
      surface_features_[i].last_observed_time_ns = surface_.capture_time_ns;
    }
    return surface_;
  }

  const perimap_SurfaceModel& model_at(Instant now, std::uint64_t sequence) {
    model_.sample_sequence = sequence;
    model_.time_ns = to_ns(now);
    return model_;
  }

  static perimap_Phase phase_sample_at(Instant now, std::uint64_t sequence) {
    perimap_Phase phase{};
    name_stream(phase);
    phase.sample_sequence = sequence;
    phase.time_ns = to_ns(now);
    phase.state = perimap_PHASE_LOCKED;
    phase.cardiac_phase_rad = phase_at(now);
    phase.cardiac_phase_rate_rad_per_s = kCardiacRate;
    return phase;
  }

 private:
  static constexpr std::uint32_t kCoefficients = 3 * (1 + 2 * kHarmonics);

  static double phase_at(Instant t) {
    return std::fmod(to_seconds(t.time_since_epoch()) * kCardiacRate, 2.0 * std::numbers::pi);
  }

  std::vector<perimap_SurfaceFeature> surface_features_;
  std::vector<perimap_ModelFeature> model_features_;
  std::vector<double> coefficients_;
  perimap_Surface surface_{};
  perimap_SurfaceModel model_{};
};

int publish(int domain, int readers, std::uint64_t samples, int rate, std::size_t features) {
  auto participant = dds::Participant::create(domain);
  auto surfaces = participant.and_then([](const auto& p) {
    return dds::Writer<perimap_Surface>::create(p, {std::chrono::seconds(2), std::chrono::seconds(2)});
  });
  auto models = participant.and_then([](const auto& p) { return dds::Writer<perimap_SurfaceModel>::create(p); });
  auto phases = participant.and_then([](const auto& p) { return dds::Writer<perimap_Phase>::create(p); });
  auto statuses = participant.and_then([](const auto& p) { return dds::Writer<perimap_Status>::create(p); });
  if (!surfaces || !models || !phases || !statuses) {
    std::fprintf(stderr, "synthetic_publisher: cannot open the topics\n");
    return 1;
  }
  const Instant give_up = MonotonicClock::now() + std::chrono::seconds(60);
  while (surfaces->matched_readers() < readers) {
    if (MonotonicClock::now() > give_up) {
      std::fprintf(stderr, "synthetic_publisher: only %d of %d readers came\n", surfaces->matched_readers(), readers);
      return 1;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  // A writer learns of a reader a moment before the reader learns of the writer.
  std::this_thread::sleep_for(std::chrono::milliseconds(300));

  Heart heart(features);
  const Instant start = MonotonicClock::now();
  for (std::uint64_t i = 0; i < samples; ++i) {
    const Instant release = start + Duration(static_cast<std::int64_t>(i) * 1'000'000'000 / rate);
    const perimap_Surface& surface = heart.surface_at(release, i);
    sleep_until(release);
    bool good = surfaces->write(surface) >= 0 && phases->write(Heart::phase_sample_at(release, i)) >= 0;
    if (i % 30 == 0) {
      perimap_Status status{};
      name_stream(status);
      dds::assign(status.version, "test");
      status.sample_sequence = i / 30;
      status.time_ns = to_ns(release);
      status.samples = i;
      good = good && models->write(heart.model_at(release, i / 30)) >= 0 && statuses->write(status) >= 0;
    }
    if (!good) {
      std::fprintf(stderr, "synthetic_publisher: a write failed\n");
      return 1;
    }
  }
  // Leaves the readers time to take the last samples before the writer goes.
  std::this_thread::sleep_for(std::chrono::seconds(1));
  return 0;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc < 4 || argc > 6) {
    std::fprintf(stderr, "synthetic_publisher DOMAIN READERS SAMPLES [RATE_HZ [FEATURES]]\n");
    return 2;
  }
  return perimap::publish(std::atoi(argv[1]), std::atoi(argv[2]), std::strtoull(argv[3], nullptr, 10),
                          argc > 4 ? std::atoi(argv[4]) : 60, argc > 5 ? std::strtoull(argv[5], nullptr, 10) : 200);
}

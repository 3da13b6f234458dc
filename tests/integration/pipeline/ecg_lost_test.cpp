// The ECG's electrode comes off for 3, 10 and 60 s: what is said of the phase meanwhile, how soon it is found again,
// and whether anything wrong was learnt. And a monitor's R trigger in place of the ECG. All sessions see one heart.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

constexpr double kOff_s = 30;  // when the electrode comes off
constexpr Duration kTriggerDelay = std::chrono::milliseconds(40);

SimulationSettings scene(MotionLaw law) {
  SimulationSettings settings;
  settings.law = law;
  settings.seed = 5;
  settings.width = 400;
  settings.height = 300;
  settings.duration = std::chrono::seconds(115);
  return settings;
}

// What a surface said of itself.
struct Said {
  double released_s = 0.0;  // since the session's start
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  double deviation_s = 0.0;  // of the phase
};

class Notes final : public Publication {
 public:
  Notes(const Simulation& simulation, const CameraModel& camera)
      : accuracy(simulation.truth(), camera, simulation.frames().front().stamp.capture), start_(simulation.start()) {}

  void surface(const perimap_Surface& sample) override {
    accuracy.add(sample);
    said.push_back({to_seconds(from_ns(sample.release_time_ns) - start_), sample.state, sample.reason,
                    sample.cardiac_phase_rate_rad_per_s > 0.0
                        ? sample.cardiac_phase_deviation_rad / sample.cardiac_phase_rate_rad_per_s
                        : INFINITY});
  }
  void surface_model(const perimap_SurfaceModel& model) override { accuracy.add(model); }
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  Accuracy accuracy;
  std::vector<Said> said;

 private:
  Instant start_;
};

struct Window {
  double rms_mm = 0.0;
  double nees = 0.0;
};

class Session {
 public:
  // Without the ECG for `off_s` from kOff_s on.
  Session(const Simulation& simulation, const PipelineSettings& settings, std::string name, double off_s)
      : simulation_(simulation),
        name_(std::move(name)),
        off_s_(off_s),
        pipeline_(std::make_unique<Pipeline>(settings)),
        notes_(simulation, settings.camera),
        runtime_(*pipeline_, Identity{}, Duration(0), notes_) {}

  void deliver(const Simulation::Arrival& arrival, const FrameEvent& frame) {
    if (arrival.source == Simulation::Source::kEcg) {
      EcgBlock block = simulation_.ecg()[arrival.index];
      const double since_s = to_seconds(block.first_sample_time - simulation_.start());
      block.lead_off = since_s >= kOff_s && since_s < back_s();
      runtime_.deliver(block);
    } else {
      test::deliver(runtime_, simulation_, arrival, frame, {});
    }
    if (pipeline_->settings().r_trigger) deliver_triggers(arrival.arrival);
  }

  void finish() {
    runtime_.finish();
    report_ = notes_.accuracy.report(Duration(0));
  }

  [[nodiscard]] Window window(double begin_s, double end_s) const {
    Window window;
    double count = 0.0;
    for (const ErrorSpan& second : report_.seconds) {
      if (second.begin_s < begin_s || second.end_s > end_s || second.error.count == 0) continue;
      const auto n = static_cast<double>(second.error.count);
      window.rms_mm += n * second.error.rms_mm * second.error.rms_mm;
      window.nees += n * second.mean_nees;
      count += n;
    }
    if (count == 0.0) return {INFINITY, INFINITY};
    return {std::sqrt(window.rms_mm / count), window.nees / count};
  }

  // R peaks from the electrode's return to the first surface whose phase is the ECG's again.
  [[nodiscard]] int beats_to_recover() const {
    for (const Said& said : notes_.said) {
      if (said.released_s <= back_s() || without_ecg(said)) continue;
      return static_cast<int>(std::count_if(simulation_.truth().motion().r_peaks.begin(),
                                            simulation_.truth().motion().r_peaks.end(), [&](Instant r) {
                                              const double r_s = to_seconds(r - simulation_.start());
                                              return r_s > back_s() && r_s <= said.released_s;
                                            }));
    }
    return 1000;
  }
  // From the electrode's coming off to the first surface that says so.
  [[nodiscard]] double seconds_until_said() const {
    for (const Said& said : notes_.said) {
      if (said.released_s >= kOff_s && without_ecg(said)) return said.released_s - kOff_s;
    }
    return INFINITY;
  }
  [[nodiscard]] int count(double begin_s, double end_s, perimap_SurfaceReason reason) const {
    return static_cast<int>(std::count_if(notes_.said.begin(), notes_.said.end(), [&](const Said& said) {
      return said.released_s > begin_s && said.released_s <= end_s && said.reason == reason;
    }));
  }
  [[nodiscard]] int good(double begin_s, double end_s) const {
    return static_cast<int>(std::count_if(notes_.said.begin(), notes_.said.end(), [&](const Said& said) {
      return said.released_s > begin_s && said.released_s <= end_s && said.state == perimap_SURFACE_GOOD;
    }));
  }
  [[nodiscard]] double largest_deviation_s(double begin_s, double end_s) const {
    double largest = 0.0;
    for (const Said& said : notes_.said) {
      if (said.released_s > begin_s && said.released_s <= end_s && said.state != perimap_SURFACE_INVALID)
        largest = std::max(largest, said.deviation_s);
    }
    return largest;
  }
  [[nodiscard]] double back_s() const { return kOff_s + off_s_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  static bool without_ecg(const Said& said) {
    return said.reason == perimap_SURFACE_REASON_PHASE_FROM_IMAGE ||
           said.reason == perimap_SURFACE_REASON_PHASE_FREE_RUNNING ||
           said.reason == perimap_SURFACE_REASON_PHASE_LOST || said.reason == perimap_SURFACE_REASON_PHASE_UNKNOWN;
  }

  void deliver_triggers(Instant now) {
    const std::vector<Instant>& r_peaks = simulation_.truth().motion().r_peaks;
    constexpr Duration kTransport = std::chrono::milliseconds(2);
    for (; next_peak_ < r_peaks.size() && r_peaks[next_peak_] + kTriggerDelay + kTransport <= now; ++next_peak_) {
      const Instant pulse = r_peaks[next_peak_] + kTriggerDelay;
      pipeline_->entrance().push_r_trigger({pulse, pulse + kTransport, static_cast<std::uint32_t>(next_peak_)});
    }
  }

  const Simulation& simulation_;
  std::string name_;
  double off_s_;
  std::unique_ptr<Pipeline> pipeline_;
  Notes notes_;
  LockstepRuntime runtime_;
  AccuracyReport report_;
  std::size_t next_peak_ = 0;
};

class EcgLost : public testing::TestWithParam<MotionLaw> {};

TEST_P(EcgLost, IsSaidAtOnceIsCarriedByTheImagesAndLeavesNothingWrongBehind) {
  const Simulation simulation = test::simulation_of(scene(GetParam()));
  PipelineSettings usual = test::settings_for(simulation, {});
  usual.features.maximum = 60;
  PipelineSettings blind = usual;
  blind.phase_from_image = false;
  PipelineSettings triggered = usual;
  triggered.r_trigger = RTriggerSettings{};
  triggered.r_trigger->delay = kTriggerDelay;

  std::vector<std::unique_ptr<Session>> sessions;
  const auto add = [&](const PipelineSettings& with, const std::string& name, double off_s) {
    sessions.push_back(std::make_unique<Session>(simulation, with, name, off_s));
  };
  add(usual, "never off", 0);
  add(usual, "off 3 s", 3);
  add(usual, "off 10 s", 10);
  add(usual, "off 60 s", 60);
  add(blind, "off 3 s, no image", 3);
  add(triggered, "R trigger", 0);

  test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    for (const auto& session : sessions) session->deliver(arrival, frame);
  });
  for (const auto& session : sessions) session->finish();

  const Session& never = *sessions[0];
  for (const auto& session : sessions) {
    const double back_s = session->back_s();
    const double settled_s = std::ceil(back_s) + 4;
    const Window before = session->window(kOff_s - 15, kOff_s);
    const Window during = session->window(kOff_s, std::min(back_s, kOff_s + 10));
    const Window after = session->window(settled_s, settled_s + 15);
    const Window undisturbed = never.window(settled_s, settled_s + 15);
    std::printf(
        "%-18s RMS before %.3f mm, while off (10 s at most) %.3f mm (NEES/3 %.2f), after %.3f mm (never off: %.3f mm); "
        "said after %.0f ms; %d surfaces carried by the images, %d free-running, %d lost, %d good; deviation up to "
        "%.0f ms; recovered with beat %d\n",
        session->name().c_str(), before.rms_mm, during.rms_mm, during.nees, after.rms_mm, undisturbed.rms_mm,
        1e3 * session->seconds_until_said(), session->count(kOff_s, back_s, perimap_SURFACE_REASON_PHASE_FROM_IMAGE),
        session->count(kOff_s, back_s, perimap_SURFACE_REASON_PHASE_FREE_RUNNING),
        session->count(kOff_s, back_s, perimap_SURFACE_REASON_PHASE_LOST), session->good(kOff_s + 0.1, back_s),
        1e3 * session->largest_deviation_s(kOff_s, back_s), session->beats_to_recover());
    EXPECT_LE(after.rms_mm, 1.1 * before.rms_mm) << session->name();
    if (back_s == kOff_s) continue;
    EXPECT_LE(session->seconds_until_said(), 0.1) << session->name();
    EXPECT_EQ(session->good(kOff_s + 0.1, back_s), 0) << session->name();
    EXPECT_LE(session->beats_to_recover(), 3) << session->name();
  }
  EXPECT_GE(sessions[1]->count(kOff_s, kOff_s + 3, perimap_SURFACE_REASON_PHASE_FROM_IMAGE), 80);
  EXPECT_GE(sessions[2]->count(kOff_s, kOff_s + 10, perimap_SURFACE_REASON_PHASE_FROM_IMAGE), 270);
  EXPECT_GE(sessions[3]->count(kOff_s + 12, kOff_s + 60, perimap_SURFACE_REASON_PHASE_LOST), 1400);
  EXPECT_LE(sessions[5]->window(kOff_s, kOff_s + 30).rms_mm, 1.1 * never.window(kOff_s, kOff_s + 30).rms_mm);
}

INSTANTIATE_TEST_SUITE_P(Laws, EcgLost, testing::Values(MotionLaw::kLinear, MotionLaw::kWarped),
                         [](const auto& test) { return test.param == MotionLaw::kLinear ? "Linear" : "Warped"; });

}  // namespace
}  // namespace perimap

#include "daemon/checkpoint/warm_restart.hpp"

#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <utility>

#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

// What may lie between the readings of two clocks, at either end. No machine sleeps for so short.
constexpr Duration kReadApart = std::chrono::milliseconds(100);

std::string pose_text(const double (&t)[3], const double (&q)[4]) {
  return fmt::format("{} {} {} mm, {} {} {} {}", t[0], t[1], t[2], q[0], q[1], q[2], q[3]);
}

}  // namespace

Now this_boot_now() {
  Now now;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), now.boot);
  now.monotonic = MonotonicClock::now();
  std::timespec utc{};
  clock_gettime(CLOCK_REALTIME, &utc);
  now.utc_ns = std::int64_t{utc.tv_sec} * 1'000'000'000 + utc.tv_nsec;
  std::timespec with_sleep{};
  clock_gettime(CLOCK_BOOTTIME, &with_sleep);
  now.suspended =
      std::chrono::seconds(with_sleep.tv_sec) + Duration(with_sleep.tv_nsec) - MonotonicClock::now().time_since_epoch();
  return now;
}

SetUp set_up_of(const Configuration& configuration, const PipelineSettings& pipeline) {
  const CameraModel& c = pipeline.camera;
  const TrackerConfiguration& tracker = configuration.tracker;
  SetUp set_up;
  set_up.camera =
      fmt::format("{}x{}, {} {} {} {}, {} {} {} {} {} {}, {}", c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k1, c.k2,
                  c.p1, c.p2, c.k3, c.k4, c.lens == Lens::kBrownConrady ? "Brown-Conrady" : "Kannala-Brandt");
  set_up.hand_eye = fmt::format("{}, sensor {}", pose_text(tracker.translation_SC_mm, tracker.rotation_SC_wxyz),
                                tracker.sensor.value_or("any"));
  set_up.times = fmt::format("offset {} ms, the picture's delay {} ms", to_seconds(tracker.time_offset) * 1e3,
                             to_seconds(configuration.camera.delay) * 1e3);
  set_up.patient_frame =
      fmt::format("{}, reference {}, registered {}", configuration.source.world_frame,
                  tracker.reference.value_or("none"), pose_text(tracker.translation_IW_mm, tracker.rotation_IW_wxyz));
  const BasisLayout& layout = pipeline.estimator.layout;
  set_up.estimator = fmt::format("{} cardiac, {} respiratory harmonics, phase law {}{}", layout.cardiac_harmonics,
                                 layout.respiratory_harmonics, static_cast<int>(pipeline.clock.law.law),
                                 pipeline.law_from_image ? " or as found" : "");
  return set_up;
}

Expected<MapMemory> usable_memory(Checkpoint checkpoint, const SetUp& set_up, const Now& now, Duration maximum_age) {
  const auto other = [](std::string_view what, const std::string& then, const std::string& here) {
    return fail(fmt::format("it is of another {}: {}; here {}", what, then, here));
  };
  const SetUp& then = checkpoint.set_up;
  if (then.camera != set_up.camera) return other("camera", then.camera, set_up.camera);
  if (then.hand_eye != set_up.hand_eye) return other("hand-eye transform", then.hand_eye, set_up.hand_eye);
  if (then.times != set_up.times) return other("time offset", then.times, set_up.times);
  if (then.patient_frame != set_up.patient_frame) {
    return other("patient's frame", then.patient_frame, set_up.patient_frame);
  }
  if (then.estimator != set_up.estimator) return other("estimator", then.estimator, set_up.estimator);
  const bool same_boot = !now.boot.empty() && checkpoint.boot == now.boot;
  const Duration slept = now.suspended - checkpoint.suspended;
  const Duration age = same_boot ? now.monotonic - checkpoint.saved + slept : Duration(now.utc_ns - checkpoint.utc_ns);
  if (age < Duration(0) || age > maximum_age) {
    return fail(fmt::format("it is {:.0f} s old; at most {:.0f} s are allowed (checkpoint.maximum_age_s)",
                            to_seconds(age), to_seconds(maximum_age)));
  }
  if (!same_boot || std::chrono::abs(slept) > kReadApart) {
    // The monotonic clock began anew, or stood still: what was observed then, was so long before now.
    const Duration shift = now.monotonic - age - checkpoint.saved;
    checkpoint.memory.last_capture += shift;
    for (FeatureMemory& feature : checkpoint.memory.features) {
      feature.first_observed += shift;
      feature.last_observed += shift;
    }
    // What the coefficients count from still holds; where breathing is now is found again.
    RespiratoryClock& breath = checkpoint.memory.respiration.clock;
    if (breath.state == RespirationState::kLocked) breath.state = RespirationState::kSearching;
    checkpoint.memory.ecg.clear();
    checkpoint.memory.frame_period = Duration(0);
  }
  return std::move(checkpoint.memory);
}

Expected<MapMemory> load_memory(const std::filesystem::path& file, const SetUp& set_up, Duration maximum_age) {
  constexpr std::size_t kLargest = std::size_t{256} << 20;
  const Expected<std::string> bytes = read_text_file(file, kLargest, "checkpoint");
  if (!bytes) return tl::unexpected(bytes.error());
  Expected<Checkpoint> checkpoint = parse_checkpoint(*bytes);
  if (!checkpoint) return fail(fmt::format("{}: {}", file.string(), checkpoint.error().message));
  auto memory = usable_memory(std::move(*checkpoint), set_up, this_boot_now(), maximum_age);
  if (!memory) return fail(fmt::format("{}: {}", file.string(), memory.error().message));
  return memory;
}

}  // namespace perimap

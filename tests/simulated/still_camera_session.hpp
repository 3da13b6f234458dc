// Real or generated pictures of a still camera in the pipeline, with a tracker that says so and a real ECG, in
// lockstep.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/image/colour_reducer.hpp"
#include "drivers/standins/simulator/ecg_record.hpp"

namespace perimap::test {

struct StillCameraSettings {
  int width = 0;
  int height = 0;
  double frames_per_s = 25;
  int features = 131;
  int workers = 1;
  double tracker_noise_mm = 0.3;
};

class StillCameraSession {
 public:
  explicit StillCameraSession(const StillCameraSettings& settings);
  StillCameraSession(const StillCameraSession&) = delete;
  StillCameraSession& operator=(const StillCameraSession&) = delete;
  ~StillCameraSession();

  // The next frame of the camera, which is mapped then; without colour where `colour` has no pixels.
  void deliver(const GreyImage& grey, const ColourImage& colour);

  // Between frames.
  [[nodiscard]] std::span<const FeatureSlot> slots() const noexcept { return pipeline_.slots(); }
  // By the feature's number, where it was found in the last frame.
  [[nodiscard]] std::map<std::uint32_t, Vector2d> found() const;
  [[nodiscard]] PipelineCounters& counters() noexcept { return pipeline_.counters(); }

  // What has been published.
  struct Told {
    SurfaceState state = SurfaceState::kInvalid;
    SurfaceReason reason = SurfaceReason::kNone;
    std::size_t features = 0;
    double x_sum_mm = 0;  // of the features' places: what differs when anything does
  };
  [[nodiscard]] const std::vector<Told>& told() const noexcept { return told_; }

 private:
  void deliver_pose(Instant time);
  void deliver_ecg();
  [[nodiscard]] Instant next_ecg() const;
  [[nodiscard]] Instant next_pose() const;
  void deliver_next();
  void release_until(Instant now);

  StillCameraSettings settings_;
  EcgRecord ecg_;
  std::mt19937_64 random_{11};
  Pipeline pipeline_;
  std::vector<std::thread> threads_;
  ColourReducer colour_;
  std::vector<Told> told_;
  std::uint64_t frames_ = 0;
  std::uint32_t poses_ = 0, ecg_samples_ = 0;
};

}  // namespace perimap::test

// The mapper's part of the surface: gathers what it is made of, a few features a frame, asks for it, and adopts it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/surface_maker.hpp"

namespace perimap {

// Nothing is allocated after construction. All members are called by the mapper thread while the workers are at rest.
class SurfaceKeeper {
 public:
  // All must outlive it. `adopted_after`: from the request to the frame that adopts it, counted in frames then.
  SurfaceKeeper(std::span<FeatureSlot> slots, MapBank& bank, SurfaceMaker& maker, Duration adopted_after,
                PipelineCounters& counters);

  // Once a frame, after its matches are settled. A surface is made of what is called converged with these doubts.
  void on_frame(const FrameRecord& frame, PhaseLaw law, const FrameDoubts& doubts) noexcept;

  // A surface was adopted, and was not refused or withdrawn since.
  [[nodiscard]] bool there() const noexcept { return there_; }

  // So many more features have begun on it, and have contradicted it.
  void count_starts(std::uint64_t begun, std::uint64_t contradicting) noexcept {
    maker_.starts().begun.add(begun);
    maker_.starts().contradicting.add(contradicting);
  }

  // What the features are known to do has changed: what was made of it, and is being made, is void.
  void begin_again() noexcept;
  // Likewise, and the camera may be elsewhere: another patient.
  void forget() noexcept;

 private:
  // Of one feature.
  struct Gathered {
    bool usable = false;
    Instant last_observed;
    SurfaceEvidence evidence;
  };
  // Where the features were seen from.
  struct MeanCamera {
    Vector3d W_mm = Vector3d::Zero();
    std::uint64_t frames = 0;  // that it is the mean of, up to its memory

    void add(const Vector3d& centre_W_mm, std::uint64_t memory_frames) noexcept {
      frames = std::min(frames + 1, memory_frames);
      W_mm += (centre_W_mm - W_mm) / static_cast<double>(frames);
    }
  };

  void gather(const FrameRecord& frame, const FrameDoubts& doubts) noexcept;
  void request(const FrameRecord& frame, PhaseLaw law, double setup_variance_mm2) noexcept;

  std::span<FeatureSlot> slots_;
  MapBank& bank_;
  SurfaceMaker& maker_;
  Duration adopted_after_;
  PipelineCounters& counters_;

  std::vector<Gathered> gathered_;  // by slot
  FeatureEstimate estimate_;
  std::size_t next_slot_ = 0;
  std::size_t fresh_ = 0;  // slots that were gathered since the last request
  MeanCamera camera_;
  std::uint64_t next_request_at_ = 0;
  std::uint64_t adopt_at_ = 0;
  bool asked_ = false;
  bool there_ = false;
  bool anew_ = false;  // since the last request
  bool setup_doubted_ = false;
};

}  // namespace perimap

// How far the tips of tracked tools are from the moving surface, now and soon.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "core/tool/moved_surface.hpp"
#include "core/tool/tip_track.hpp"

namespace perimap {

struct MadeSurface;

// After the surface's valid time.
inline constexpr std::array<Duration, 3> kToolHorizons = {Duration(0), std::chrono::milliseconds(100),
                                                          std::chrono::milliseconds(300)};

// The meaning of each value is written in idl/perimap_tool.idl.
enum class ToolDistanceReason : std::uint8_t {
  kNone,
  kNotCalibrated,
  kNotSeen,
  kTooOld,
  kSurface,
  kNoSurface,
  kBeyondEdge
};

// At one instant.
struct DistanceAhead {
  SurfaceState state = SurfaceState::kInvalid;
  ToolDistanceReason reason = ToolDistanceReason::kNone;
  // Not a number while invalid, so that what nobody knows is never taken for a touch.
  double distance_mm = 0.0;                // signed: positive in front of the surface
  double deviation_mm = 0.0;               // of the tip and of the surface, along its normal
  double rate_mm_per_s = 0.0;              // of the distance: negative while they approach
  Vector3d point_W_mm = Vector3d::Zero();  // of the surface, the nearest
  Vector3d normal_W = Vector3d::Zero();    // unit, towards where the camera was; zero while invalid
};

struct ToolDistance {
  bool tip_known = false;  // false: the tip means nothing
  TipPrediction tip;       // at the surface's valid time
  std::optional<Instant> last_seen;
  bool touches = false;  // now: as far as anybody knows more likely than not
  std::array<DistanceAhead, kToolHorizons.size()> ahead;
};

// What a surface was released with.
struct SurfaceRelease {
  std::uint64_t sample_sequence = 0;
  Instant release_time;
  Instant valid_time;
  Instant valid_until;
  SurfaceState state = SurfaceState::kInvalid;
  SurfaceReason reason = SurfaceReason::kNone;
  CardiacClock heart;
  RespiratoryClock breath;
};

// The publisher hands it over, and a copy takes no memory.
static_assert(std::is_trivially_copyable_v<SurfaceRelease>);

struct WatchedTool {
  std::string name;              // "pointer", "instrument/NAME"
  std::size_t tool = 0;          // as ToolSample::tool
  std::optional<TipInTool> tip;  // none: it is not calibrated
};

// The tip's distance is that from the nearest place of the mesh that was made last, moved to the phases of the instant.
// A pure function of the readings, the releases and the surfaces, in their order. Nothing is allocated but once for
// each surface. Used by one thread, and none of the real-time path.
class ToolDistances {
 public:
  // `tracker`: the noise of readings. `vertices`: that a mesh has, about.
  ToolDistances(std::vector<WatchedTool> tools, const PoseHistorySettings& tracker, std::size_t vertices);

  // Of a tool that is not watched, it is passed over.
  void add(const ToolSample& sample) noexcept;

  // In the order of the tools; valid until the next call. `made`: what was adopted last; null where there is nothing.
  [[nodiscard]] std::span<const ToolDistance> at(const SurfaceRelease& release,
                                                 const std::shared_ptr<const MadeSurface>& made);

 private:
  void take(const std::shared_ptr<const MadeSurface>& made);
  [[nodiscard]] bool there(const SurfaceRelease& release) const noexcept;
  void tell_tip(std::size_t i, Instant valid, ToolDistance& told) const noexcept;
  [[nodiscard]] DistanceAhead distance_of(std::size_t i, std::size_t horizon, Instant valid) const noexcept;

  std::vector<WatchedTool> tools_;
  std::vector<TipTrack> tracks_;  // by tools_; of one without a tip that of its origin
  std::vector<ToolDistance> told_;
  std::shared_ptr<const MadeSurface> made_;
  MeshBorder border_;
  std::vector<MovedSurface> moved_;  // by horizon
};

}  // namespace perimap

// What leaves by OpenIGTLink, as bytes: version 1 messages by libopenigtlink (docs/decisions/0114).
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/time/instant.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

// The device names that a client sees.
namespace igtl_names {
inline constexpr const char* kSurface = "PerimapSurface";  // POLYDATA and its STATUS
inline constexpr const char* kCamera = "PerimapCamera";    // TRANSFORM and its STATUS
inline constexpr const char* kTools = "PerimapTools";      // POLYDATA and STRING
}  // namespace igtl_names

// One whole message. Those of one subject are in its order; of a stream the newest alone is of interest.
struct IgtlOutgoing {
  enum class Subject : std::uint8_t { kSurface, kCamera, kTools, kToolWords, kSurfaceStatus, kCameraStatus };
  static constexpr std::size_t kSubjects = 6;

  Subject subject = Subject::kSurface;
  std::shared_ptr<const std::string> bytes;

  [[nodiscard]] bool stream() const noexcept { return subject < Subject::kSurfaceStatus; }
};

// STATUS of a subject, by the code numbers of the protocol.
struct IgtlState {
  enum class Code : std::uint16_t {
    kOk = 1,
    kNotFound = 4,
    kTimeOut = 7,
    kNotReady = 13,
    kDisabled = 15,
    kNotPresent = 16,
    kShutDown = 19
  };

  Code code = Code::kNotPresent;
  std::int64_t reason = 0;  // perimap::SurfaceReason, as the sub code
  std::string name;         // "good", "degraded", "invalid"; at most 19 bytes
  std::string words;        // for people

  bool operator==(const IgtlState&) const = default;
};

// What the surface is worth: kOk where it is good, kNotReady degraded, kDisabled invalid. Words say what may be done
// with it, why not more, and of which source it is.
[[nodiscard]] IgtlState surface_state_of(const ShownSurface& surface);
// kOk where its pose is known, else kNotFound.
[[nodiscard]] IgtlState camera_state_of(const ShownSurface& surface);

// POLYDATA, in mm of the frame W, stamped with the UTC of its valid_time: the mesh's vertices and triangles, or where
// there is none each converged feature as a vertex. The points' scalars "deviation_mm" are the largest of the position.
// Empty where nothing may be shown.
[[nodiscard]] IgtlOutgoing pack_surface(const ShownSurface& surface);
// The same without anything in it, for when no surface is there.
[[nodiscard]] IgtlOutgoing pack_no_surface();
// TRANSFORM X_WC, mm, stamped with the UTC of the capture. The surface's X_WC must be there.
[[nodiscard]] IgtlOutgoing pack_camera(const ShownSurface& surface);
// POLYDATA: the tip of each tracked tool that is known as a vertex, in mm of W, stamped as the surface. The points'
// scalars: "line", that of the tool in pack_tool_words(), from 0 on; and, not a number where nobody knows, "distance_mm"
// from the surface, "deviation_mm" and "touches", 0 or 1. Empty where nothing may be shown: an empty POINT is none to
// libopenigtlink, and would clear nothing.
[[nodiscard]] IgtlOutgoing pack_tools(const ShownSurface& surface);
// STRING: a line for each tool, how far it is from the surface, or why nobody knows.
[[nodiscard]] IgtlOutgoing pack_tool_words(const ShownSurface& surface);
// `subject`: kSurfaceStatus or kCameraStatus.
[[nodiscard]] IgtlOutgoing pack_state(IgtlOutgoing::Subject subject, const IgtlState& state);

}  // namespace perimap

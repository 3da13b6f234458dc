// A surface as the messages that viewers get of a running perimapd.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/bridge/foxglove_protocol/foxglove_protocol.hpp"
#include "daemon/bridge/messages/view_scene.hpp"
#include "daemon/bridge/messages/view_worth.hpp"
#include "daemon/subscribing/shown_surface.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap {

// Their channels have the numbers of their places.
enum class SurfaceChannel : std::uint8_t { kScene, kWorth, kTransforms };
inline constexpr std::size_t kSurfaceChannels = 3;
[[nodiscard]] std::span<const FoxgloveChannel, kSurfaceChannels> surface_channels() noexcept;

struct SurfaceMessage {
  Instant utc;      // the instant that it speaks of
  std::string cdr;  // empty: there is none
};
using SurfaceMessages = std::array<SurfaceMessage, kSurfaceChannels>;

// Keeps its memory from one surface to the next. One thread.
class SurfaceMessageMaker {
 public:
  // Of one that may not be shown: a scene that takes away what was shown before, why, and where no camera is. `now_utc`
  // stands for UTC where the surface does not tell it.
  [[nodiscard]] Expected<SurfaceMessages> of(const ShownSurface& surface, Instant now_utc);

 private:
  ViewScene scene_;
  ViewWorth worth_;
  CdrSerializer serializer_;
};

}  // namespace perimap

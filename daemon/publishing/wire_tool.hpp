// Distances of tools as the wire type of idl/perimap_tool.idl.
#pragma once

#include <perimap_tool.h>

#include <cstdint>
#include <string>

#include "core/time/instant.hpp"
#include "daemon/publishing/identity.hpp"

namespace perimap {

struct SurfaceRelease;
struct ToolDistance;

// Of one tool.
class WireTool {
 public:
  WireTool(const Identity& identity, const std::string& tool);

  // No allocation. Valid until the next call.
  [[nodiscard]] const perimap_ToolDistance& fill(const ToolDistance& told, const SurfaceRelease& release,
                                                 Duration utc_minus_monotonic) noexcept;

 private:
  perimap_ToolDistance wire_{};
};

}  // namespace perimap

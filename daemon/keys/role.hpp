// What a program may do in a secured domain.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace perimap {

enum class KeyRole { kPublisher, kDisplay, kControlLoop, kRecorder, kBridge };

inline constexpr std::size_t kMostRoleTopics = 7;

// Topics as DDS Security matches them: a name, or a pattern with `*`.
struct RoleRights {
  KeyRole role;
  std::string_view name;  // as on the command line and in the certificate
  std::string_view meaning;
  std::array<std::string_view, kMostRoleTopics> publishes;   // empty ones are none
  std::array<std::string_view, kMostRoleTopics> subscribes;  // likewise
};

// perimapd reads what it publishes, too: that another writes under its name shows there.
inline constexpr std::array<RoleRights, 5> kRoles = {
    {{KeyRole::kPublisher,
      "publisher",
      "perimapd, and calibrations from its devices: publishes every topic",
      {"perimap/surface", "perimap/surface_model", "perimap/surface_mesh", "perimap/tool", "perimap/phase",
       "perimap/status", "perimap/guidance"},
      {"perimap/*"}},
     {KeyRole::kDisplay,
      "display",
      "navigation software, perimap watch, a page: reads every topic that is published today",
      {},
      {"perimap/surface", "perimap/surface_model", "perimap/surface_mesh", "perimap/tool", "perimap/phase",
       "perimap/status", "perimap/guidance"}},
     {KeyRole::kControlLoop,
      "control-loop",
      "an instrument's control: reads what it steers by, and not the mesh",
      {},
      {"perimap/surface", "perimap/surface_model", "perimap/tool", "perimap/phase", "perimap/status"}},
     {KeyRole::kRecorder, "recorder", "perimap watch --record: reads all of perimap's topics", {}, {"perimap/*"}},
     {KeyRole::kBridge,
      "bridge",
      "carries perimap's topics to another protocol: reads all of them",
      {},
      {"perimap/*"}}}};

[[nodiscard]] constexpr const RoleRights& rights_of(KeyRole role) noexcept {
  return kRoles[static_cast<std::size_t>(role)];
}

[[nodiscard]] constexpr std::optional<KeyRole> role_of_name(std::string_view name) noexcept {
  for (const RoleRights& rights : kRoles) {
    if (rights.name == name) return rights.role;
  }
  return std::nullopt;
}

}  // namespace perimap

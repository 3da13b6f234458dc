// Names of the enumerations of perimap.idl, for people.
#pragma once

#include <string_view>

#include "perimap.h"

namespace perimap {

// As in perimap.idl without the prefix, in small letters; "unknown" for a value that perimap.idl does not have.
[[nodiscard]] std::string_view name_of(perimap_SurfaceState state) noexcept;
[[nodiscard]] std::string_view name_of(perimap_SurfaceReason reason) noexcept;
[[nodiscard]] std::string_view name_of(perimap_FeatureState state) noexcept;
[[nodiscard]] std::string_view name_of(perimap_FeatureReason reason) noexcept;
[[nodiscard]] std::string_view name_of(perimap_StageKind kind) noexcept;
[[nodiscard]] std::string_view name_of(perimap_PhaseState state) noexcept;
[[nodiscard]] std::string_view name_of(perimap_Rhythm rhythm) noexcept;
[[nodiscard]] std::string_view name_of(perimap_RespirationState state) noexcept;
[[nodiscard]] std::string_view name_of(perimap_RespirationSource source) noexcept;
[[nodiscard]] std::string_view name_of(perimap_Privilege privilege) noexcept;
[[nodiscard]] std::string_view name_of(perimap_RecordingState state) noexcept;
[[nodiscard]] std::string_view name_of(perimap_ScopeTurn turn) noexcept;
[[nodiscard]] std::string_view name_of(perimap_EcgLead lead) noexcept;
[[nodiscard]] std::string_view name_of(perimap_DisplacedCause cause) noexcept;
[[nodiscard]] std::string_view name_of(perimap_SourceKind kind) noexcept;
[[nodiscard]] std::string_view name_of(perimap_SourceState state) noexcept;

[[nodiscard]] std::string_view name_of(perimap_SetupState state) noexcept;

}  // namespace perimap

// The pipeline's enumerations as those of idl/perimap.idl.
#pragma once

#include <perimap.h>

#include <cstdint>

namespace perimap {

enum class FeatureReason : std::uint8_t;
enum class FeatureState : std::uint8_t;
enum class DisplacedCause : std::uint8_t;
enum class EcgSignal : std::uint8_t;
enum class PhaseLaw : std::uint8_t;
enum class PhaseState : std::uint8_t;
enum class RespirationSource : std::uint8_t;
enum class RespirationState : std::uint8_t;
enum class Rhythm : std::uint8_t;
enum class SetupState : std::uint8_t;
enum class SurfaceReason : std::uint8_t;
enum class SurfaceState : std::uint8_t;

[[nodiscard]] perimap_FeatureReason to_wire(FeatureReason reason) noexcept;
[[nodiscard]] perimap_FeatureState to_wire(FeatureState state) noexcept;
[[nodiscard]] perimap_DisplacedCause to_wire(DisplacedCause cause) noexcept;
[[nodiscard]] perimap_EcgLead to_wire(EcgSignal signal) noexcept;
[[nodiscard]] perimap_PhaseLaw to_wire(PhaseLaw law) noexcept;
[[nodiscard]] perimap_PhaseState to_wire(PhaseState state) noexcept;
[[nodiscard]] perimap_RespirationSource to_wire(RespirationSource source) noexcept;
[[nodiscard]] perimap_RespirationState to_wire(RespirationState state) noexcept;
[[nodiscard]] perimap_Rhythm to_wire(Rhythm rhythm) noexcept;
[[nodiscard]] perimap_SetupState to_wire(SetupState state) noexcept;
[[nodiscard]] perimap_SurfaceReason to_wire(SurfaceReason reason) noexcept;
[[nodiscard]] perimap_SurfaceState to_wire(SurfaceState state) noexcept;

}  // namespace perimap

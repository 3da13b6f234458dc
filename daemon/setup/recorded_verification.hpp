// A set-up held against a recording of a board that the scope was swung about.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "daemon/config/setup_error.hpp"
#include "daemon/setup/recorded_motion.hpp"
#include "daemon/setup/verification.hpp"

namespace perimap {

struct VerificationSource {
  std::string configuration;  // the file on trial
  MotionSource motion;
  std::string tip;                        // file of a pointer's tip that touched the board; empty: none did
  std::string tool;                       // the tracked tool that is the pointer
  Vector3d touched_B = Vector3d::Zero();  // the point that it touched, mm
  double bound_mm = 2.0;
};

// By the hand-eye and the time offset of the configuration, as its scope was turned and zoomed while that was recorded.
// `progress` hears of the frames that were looked at. Fails as verify_setup() does, and where configuration and
// recording do not belong together.
[[nodiscard]] SetupExpected<Verification> verify_recording(
    const VerificationSource& source, const std::function<void(std::uint64_t done, std::uint64_t all)>& progress);

}  // namespace perimap

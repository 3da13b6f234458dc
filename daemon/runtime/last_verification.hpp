// Whether the set-up of a configuration was verified, and what that said.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/config/configuration.hpp"
#include "drivers/calibration/verification_record.hpp"

namespace perimap {

// `camera`: what perimapd would see through; none: no lens is known.
[[nodiscard]] VerifiedSetUp verified_set_up_of(const Configuration& configuration,
                                               const std::optional<CameraModel>& camera);

struct LastVerification {
  std::optional<std::string> text;  // the record as recordings have it attached
  std::string line;                 // for people; empty: there is no tracker, and nothing to be verified
  bool doubtful = false;            // it failed, is of another set-up, or can not be read
};

// Of the record beside the configuration's file.
[[nodiscard]] LastVerification last_verification(const std::filesystem::path& configuration_file,
                                                 const Configuration& configuration,
                                                 const std::optional<CameraModel>& camera);
// With the lens that the configuration names.
[[nodiscard]] LastVerification last_verification(const std::filesystem::path& configuration_file,
                                                 const Configuration& configuration);

}  // namespace perimap

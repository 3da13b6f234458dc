// Which inputs of the ECG device carry what, as far as one key tells what another may say.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/configuration.hpp"

namespace perimap {

// A key that the others contradict.
struct WrongInput {
  std::string_view section;
  std::string_view key;
  std::string expected;
  std::string got;
};

// None when the device that the configuration names has these inputs.
[[nodiscard]] std::vector<WrongInput> wrong_inputs(const Configuration& configuration);

// The input with the ECG: the configured one, or the protocol's usual one; 0 where the protocol leaves no choice.
[[nodiscard]] int ecg_input(const EcgConfiguration& ecg) noexcept;

}  // namespace perimap

// An angled scope: how far it is turned in its camera head, and the set-up as a function of that.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/turned_scope.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/recorded_turns.hpp"
#include "daemon/setup/scope_rotation.hpp"

namespace perimap {

// Files of one turn of the scope: a picture or a recording, and what was calibrated then.
struct ScopeAtTurn {
  std::string seen;
  std::string hand_eye;
  std::string camera;
};

// Of another zoom or focus.
struct ScopeAtZoom {
  std::string seen;
  std::string camera;
};

struct ScopeCalibrationSource {
  std::vector<std::string> pictures;  // with the field stop
  std::string recording;              // or this
  // With a board's squares: the recording is of a scope that is swung about it and turned in between, and takes the
  // place of `setups`.
  BoardWish board{};
  std::vector<ScopeAtTurn> setups;
  std::vector<ScopeAtZoom> zooms;
  bool by_second_sensor = false;  // a second tracked sensor tells the turn
  std::string configuration;      // whose sensors it must be of; empty: nobody says
};

struct ScopeCalibration {
  std::optional<TurnedScope> scope;          // of the set-ups, where there are any
  std::vector<SetupAtRotation> setups;       // that it was made from
  std::optional<RecordedTurns> turns;        // of one recording
  std::optional<std::string> sensor;         // of which it is, where someone says so
  std::optional<std::string> second_sensor;  // likewise
  std::optional<ScopeRotation> rotation;     // in the pictures or the recording, where there are any
};

// Fails where files are of several cameras or sensors, and where there is nothing to measure by.
// `progress`: as turns_in_recording() has it.
[[nodiscard]] SetupExpected<ScopeCalibration> calibrate_scope(
    const ScopeCalibrationSource& source, const std::function<void(std::uint64_t done, std::uint64_t all)>& progress);

}  // namespace perimap

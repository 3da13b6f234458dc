// What a user is told while an angled scope is measured at several turns and zooms.
#pragma once

#include <cstddef>
#include <memory>

#include "daemon/setup/board.hpp"
#include "daemon/setup/live_guide.hpp"

namespace perimap {

struct ScopeGuideSettings {
  BoardWish board;
  std::size_t turns = 3;
  std::size_t zooms = 0;          // others than that of the turns, which the field stop tells apart
  double least_s = 25.0;          // at each
  bool by_second_sensor = false;  // else the field stop in the pictures tells the turn
};

// The board from all sides at each of so many turns, twenty degrees apart and more, and at each of so many other zooms:
// how the scope is held, what is missing there, and when to turn or zoom on.
[[nodiscard]] std::unique_ptr<LiveGuide> scope_guide(const ScopeGuideSettings& settings);
// How far the scope is turned now, by the field stop: enough when it was held for five seconds.
[[nodiscard]] std::unique_ptr<LiveGuide> notch_guide();

}  // namespace perimap

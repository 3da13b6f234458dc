// How far an angled scope is turned in its camera head, as it was read once.
#pragma once

namespace perimap {

struct TurnReading {
  double rotation_rad = 0.0;
  double deviation_rad = 0.0;
};

}  // namespace perimap

#include "drivers/device/reopening.hpp"

#include <algorithm>

namespace perimap {

Duration ReopenDelay::next() noexcept { return std::exchange(delay_, std::min(2 * delay_, Duration(kLongest))); }

}  // namespace perimap

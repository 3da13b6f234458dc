// What `perimap watch` shows on a terminal: one screen, drawn anew each second.
#pragma once

#include <span>
#include <string>

#include "daemon/evaluation/watch/watch_statistics.hpp"

namespace perimap {

struct WatchScreenStyle {
  std::string title;     // "perimap watch, DDS domain 0"
  bool colours = false;  // by ANSI escapes; the words say the same
};

// Lines without any movement of the cursor. What may be trusted, and why not, comes first; then sources, features,
// phase, times. Of the streams of a source one below the other.
[[nodiscard]] std::string watch_screen(std::span<const StreamReport> reports, const WatchScreenStyle& style);

}  // namespace perimap

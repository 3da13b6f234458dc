// What is sent to pages.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace perimap {

// One made for all pages that get it.
struct PageMessage {
  // A newer message takes the place of one of the same lane that waits still: a page that reads slowly gets what is
  // new, not what is old. Which lanes there are is the sender's; what is of none waits until it is sent.
  static constexpr std::uint8_t kNoLane = 0;
  static constexpr std::uint8_t kSignOfLife = 255;

  std::shared_ptr<const std::string> bytes;
  bool binary = false;
  std::uint8_t lane = kNoLane;
};

// A page that is open in a browser; no two of a server have the same.
using PageId = std::uint64_t;

}  // namespace perimap

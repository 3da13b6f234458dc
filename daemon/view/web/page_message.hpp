// What is sent to pages.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace perimap {

// One made for all pages that get it.
struct PageMessage {
  // What a newer message may take the place of while it waits: a page that reads slowly gets what is new, not what is
  // old.
  enum class Replaces : std::uint8_t { kNothing, kSurface, kTick };

  std::shared_ptr<const std::string> bytes;
  bool binary = false;
  Replaces replaces = Replaces::kNothing;
};

// A page that is open in a browser; no two of a server have the same.
using PageId = std::uint64_t;

}  // namespace perimap

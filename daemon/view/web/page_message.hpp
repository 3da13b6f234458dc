// What is sent to pages.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace perimap {

// One made for all pages that get it.
struct PageMessage {
  std::shared_ptr<const std::string> bytes;
  bool binary = false;
  // A newer one of its kind takes its place while it waits: a page that reads slowly gets what is new, not what is old.
  bool replaceable = false;
};

// A page that is open in a browser; no two of a server have the same.
using PageId = std::uint64_t;

}  // namespace perimap

// Under which names samples are published.
#pragma once

#include <string>

namespace perimap {

struct Identity {
  std::string source;            // which perimapd, at most 63 bytes
  std::string stream = "frame";  // which release mode, at most 31 bytes
  std::string frame_id;          // the world frame's name, at most 63 bytes
};

}  // namespace perimap

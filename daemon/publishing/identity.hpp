// Under which names samples are published.
#pragma once

#include <string>

#include "core/pipeline/release_stream.hpp"
#include "daemon/publishing/run_id.hpp"

namespace perimap {

struct Identity {
  std::string source;                            // which perimapd, at most 63 bytes
  ReleaseStream stream = ReleaseStream::kFrame;  // of what is not of one stream alone: the first that is published
  std::string frame_id;                          // the world frame's name, at most 63 bytes
  RunId run_id{};                                // all zero in virtual time, where every run is the same

  [[nodiscard]] Identity of(ReleaseStream other) const { return {source, other, frame_id, run_id}; }
};

}  // namespace perimap

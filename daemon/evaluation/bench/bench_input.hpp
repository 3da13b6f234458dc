// What all runs of a benchmark have in common, and how a run begins.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/replay_setup.hpp"

namespace perimap::bench {

struct BenchInput {
  std::string recording;
  std::optional<std::filesystem::path> configuration;  // over the recording's own
  int domain = 0;
  Duration settle{0};   // from the first release to the first that counts
  Duration measure{0};  // from there to the last; both are shortened for a recording that ends sooner
  std::optional<std::filesystem::path> publisher_keys;   // of secured runs
  std::optional<std::filesystem::path> subscriber_keys;  // likewise
  std::filesystem::path scratch;                         // a folder for what is recorded, and for the disk's load
};

// The recording at its first event, with so many features at most and so many workers. More features than the
// configuration's stand closer together: so that twice as many would find room in the image.
[[nodiscard]] SetupExpected<ReplaySetup> prepare_run(const BenchInput& input, int features, int workers);

// Plays every n-th frame alone and all clocks `speed` times as fast; ends when `length` is played.
[[nodiscard]] ReplayEdit paced(int every_frame, double speed, Duration length);

// Bytes of a surface with so many features on the wire.
[[nodiscard]] Expected<std::size_t> surface_bytes(std::size_t features);

}  // namespace perimap::bench

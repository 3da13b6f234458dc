// What perimapd keeps for the case that it crashes, as a file.
//
// "PERIMAPC", format (u32), CRC-32 of all that follows (u32), then little-endian: version of perimapd, set-up (texts as
// length and bytes), boot, instants, frame times, ECG blocks, breathing, the belief in the set-up, features. A template
// is kept as it lies in memory, so a checkpoint is for the same build alone: another version or another size of a
// template is refused.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What must be the same for a map to mean the same, as text: it is compared and told, never computed with.
struct SetUp {
  std::string camera;
  std::string hand_eye;
  std::string times;
  std::string patient_frame;
  std::string estimator;

  bool operator==(const SetUp&) const = default;
};

struct Checkpoint {
  SetUp set_up;
  std::string boot;         // /proc/sys/kernel/random/boot_id: monotonic instants mean nothing in another boot
  Instant saved;            // monotonic
  std::int64_t utc_ns = 0;  // the same instant
  Duration suspended{0};    // of this boot until then: while the machine slept the monotonic clock stood still
  MapMemory memory;
};

// One feature, to be handed to serialize(): made when it comes, so that not all of them are copied at once.
[[nodiscard]] std::string serialize_feature(const FeatureMemory& feature);

// `checkpoint.memory.features` is not looked at; `features` holds what serialize_feature() made, all of one layout.
[[nodiscard]] std::string serialize(const Checkpoint& checkpoint, std::span<const std::string> features);

// Any bytes are safe. Errors say at which byte what was expected.
[[nodiscard]] Expected<Checkpoint> parse_checkpoint(std::string_view bytes);
// What follows the CRC; for fuzzing.
[[nodiscard]] Expected<Checkpoint> parse_checkpoint_body(std::string_view body);

// Replaces the file as a whole or not at all, also when the machine stops meanwhile. Its owner alone may read it. Error
// names the path.
[[nodiscard]] Expected<void> replace_file(const std::filesystem::path& file, std::string_view bytes);

// Takes away the file and what an interrupted replace_file() may have left beside it; gone also when the machine stops
// right after. No error where there is none. Error names the path.
[[nodiscard]] Expected<void> remove_file(const std::filesystem::path& file);

}  // namespace perimap

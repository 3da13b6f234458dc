// Which of what is published is an event, for which the black box keeps what lies around it.
#pragma once

#include <perimap.h>

#include <array>
#include <map>
#include <optional>
#include <string>

namespace perimap::black_box {

// What has changed since the sample before of the same topic and stream, in words; nothing where all is as it was. Used
// by one thread.
class EventWatch {
 public:
  // State or reason.
  [[nodiscard]] std::optional<std::string> see(const perimap_Surface& surface);
  [[nodiscard]] std::optional<std::string> see(const perimap_Phase& phase);
  // A source's state, the belief in the set-up, releases that were late or left out.
  [[nodiscard]] std::optional<std::string> see(const perimap_Status& status);

 private:
  struct Surface {
    perimap_SurfaceState state;
    perimap_SurfaceReason reason;
    bool operator==(const Surface&) const = default;
  };
  struct Late {
    std::uint64_t late = 0;
    std::uint64_t missed = 0;
    bool operator==(const Late&) const = default;
  };

  std::map<std::string, Surface> surfaces_;  // by stream
  std::optional<perimap_PhaseState> phase_;
  std::map<perimap_SourceKind, perimap_SourceState> sources_;
  std::optional<perimap_SetupState> setup_;
  std::map<std::string, Late> late_;  // by stream
};

}  // namespace perimap::black_box

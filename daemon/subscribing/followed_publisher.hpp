// Which perimapd and which of its streams is shown, where there are several.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/time/instant.hpp"

namespace perimap {

// The first one heard, for as long as it publishes: two are never mixed. Of the streams of one perimapd the frames', if
// there is one. One thread.
class FollowedPublisher {
 public:
  // So long must it have been silent before another is followed.
  static constexpr Duration kSilence = std::chrono::seconds(1);

  enum class Verdict : std::uint8_t { kOther, kSame, kNew };  // kNew: shown from now on; what was shown is another's

  // A surface came. `publisher` tells perimapds of one domain apart.
  [[nodiscard]] Verdict surface(std::uint64_t publisher, std::string_view stream, Instant receipt);
  // Whether what else came is of the one that is followed; of a stream, where it has one of its own.
  [[nodiscard]] bool follows(std::uint64_t publisher) const noexcept { return followed_ == publisher; }
  [[nodiscard]] bool follows(std::uint64_t publisher, std::string_view stream) const noexcept {
    return follows(publisher) && stream == stream_;
  }

 private:
  std::optional<std::uint64_t> followed_;
  std::string stream_;
  Instant last_;
};

}  // namespace perimap

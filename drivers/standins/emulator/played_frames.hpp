// The frames that an emulated camera shows, in the time of the session that they are of.
#pragma once

#include <cstdint>
#include <optional>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct PlayedFrame {
  Instant capture;
  Instant arrival;
  GreyImage image;  // until the next is asked for
};

// Used by one thread.
class PlayedFrames {
 public:
  virtual ~PlayedFrames() = default;

  // When the session's first message arrives, of whichever source.
  [[nodiscard]] virtual Instant first_arrival() const noexcept = 0;
  // The next frame in order of arrival; none at the end. `now` is the session's own: what could not be there in time is
  // left out where frames are made as they are asked for.
  [[nodiscard]] virtual Expected<std::optional<PlayedFrame>> next(Instant now) = 0;
  // How many were left out so.
  [[nodiscard]] virtual std::uint64_t left_out() const noexcept { return 0; }
};

}  // namespace perimap

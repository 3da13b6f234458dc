// Camera frames as foxglove::RawImage, and back.
#pragma once

#include <foxglove.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The schema's time; `time` must not lie before the clock's epoch.
[[nodiscard]] foxglove_Time to_foxglove_time(Instant time) noexcept;

// A "mono8" message that borrows the frame id and the pixels: it must not outlive them, and must not be freed.
// Rows with gaps between them are packed into `packed`, which the message then borrows instead.
[[nodiscard]] foxglove_RawImage borrow_raw_image(const GreyImage& image, Instant time, const std::string& frame_id,
                                                 std::vector<std::uint8_t>& packed);

// The pixels of a "mono8" message, borrowed from it. Fails when it is not "mono8" or its sizes do not fit together.
[[nodiscard]] Expected<GreyImage> borrow_grey_image(const foxglove_RawImage& message);

}  // namespace perimap

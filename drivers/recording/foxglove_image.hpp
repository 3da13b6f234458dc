// Camera frames as foxglove::RawImage or CompressedImage, and back.
#pragma once

#include <foxglove.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"
#include "drivers/image/camera_frame.hpp"

namespace perimap {

// The schema's time; `time` must not lie before the clock's epoch.
[[nodiscard]] foxglove_Time to_foxglove_time(Instant time) noexcept;

// A "mono8" message that borrows the frame id and the pixels: it must not outlive them, and must not be freed.
// Rows with gaps between them are packed into `packed`, which the message then borrows instead.
[[nodiscard]] foxglove_RawImage borrow_raw_image(const GreyImage& image, Instant time, const std::string& frame_id,
                                                 std::vector<std::uint8_t>& packed);

// A frame as the camera gave it: rows as far apart as they were, bytes behind the picture left out. The first takes all
// formats but kMjpg, the second kMjpg alone. The messages borrow as above.
[[nodiscard]] foxglove_RawImage borrow_raw_image(const CameraFrame& frame, const std::string& frame_id);
[[nodiscard]] foxglove_CompressedImage borrow_compressed_image(const CameraFrame& frame, const std::string& frame_id);

// The frame in a message, borrowed from it and without its stamp. Fails when the encoding is none that a camera of ours
// gives, or the sizes do not fit together; whether a JPEG is one, and whole, shows when it is decoded.
[[nodiscard]] Expected<CameraFrame> borrow_camera_frame(const foxglove_RawImage& message);
[[nodiscard]] Expected<CameraFrame> borrow_camera_frame(const foxglove_CompressedImage& message);

}  // namespace perimap

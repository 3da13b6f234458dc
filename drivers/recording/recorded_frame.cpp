#include "drivers/recording/recorded_frame.hpp"

#include <utility>

#include "drivers/recording/foxglove_image.hpp"

namespace perimap {
namespace {

// Keeps the message in `kept`, since the frame borrows from it.
template <class Message>
Expected<CameraFrame> decode(const RecordingReader& reader, const RecordedMessage& message,
                             std::optional<Sample<Message>>& kept) {
  auto decoded = reader.decode<Message>(message);
  if (!decoded) return tl::unexpected(std::move(decoded.error()));
  kept.emplace(*std::move(decoded));
  auto frame = borrow_camera_frame(**kept);
  if (!frame) return reader.wrong(message, frame.error().message);
  return frame;
}

}  // namespace

Expected<void> RecordedFrame::read(const RecordingReader& reader, const RecordedMessage& message) {
  const bool compressed = message.type == topic_type<foxglove_CompressedImage>().schema_name();
  const auto frame = compressed ? decode(reader, message, compressed_) : decode(reader, message, raw_);
  if (!frame) return tl::unexpected(frame.error());
  frame_ = *frame;
  return {};
}

const ColourImage& RecordedFrame::colour() {
  colour_.reduce_colour(frame_);
  return colour_.picture();
}

}  // namespace perimap

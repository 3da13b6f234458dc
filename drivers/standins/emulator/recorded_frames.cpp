#include "drivers/standins/emulator/recorded_frames.hpp"

#include <array>
#include <string_view>
#include <variant>

#include "drivers/recording/channels.hpp"

namespace perimap {

Expected<RecordedFrames> RecordedFrames::open(const std::string& recording) {
  auto all = ReplayReader::open(recording, ReadMode::kStrict);
  if (!all) return tl::unexpected(std::move(all.error()));
  const auto first = all->next();
  if (!first) return tl::unexpected(first.error());
  if (!*first) return fail(recording + ": the recording is empty");
  constexpr std::array<std::string_view, 1> kFrames{channels::kCameraImage};
  auto frames = ReplayReader::open(recording, ReadMode::kStrict, kFrames);
  if (!frames) return tl::unexpected(std::move(frames.error()));
  return RecordedFrames(std::move(*frames), arrival_of(**first));
}

Expected<std::optional<PlayedFrame>> RecordedFrames::next(Instant /*now*/) {
  auto event = reader_.next();
  if (!event) return tl::unexpected(std::move(event.error()));
  if (!*event) return std::optional<PlayedFrame>();
  frame_ = std::get<FrameEvent>(std::move(**event));
  return PlayedFrame{frame_.stamp.capture, frame_.stamp.arrival, frame_.image()};
}

}  // namespace perimap

#include "daemon/bridge/foxglove/surface_messages.hpp"

#include <utility>

#include "daemon/bridge/live/shown_time.hpp"
#include "daemon/bridge/messages/view_camera.hpp"
#include "daemon/bridge/messages/view_names.hpp"
#include "daemon/bridge/messages/view_topics.hpp"

namespace perimap {
namespace {

// What a viewer's stamp can tell.
constexpr Instant kLast = from_ns(4'000'000'000'000'000'000);

template <class T>
Expected<std::string> bytes_of(CdrSerializer& serializer, const T& message) {
  return serializer.serialize(message).map([](std::span<const std::byte> bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  });
}

}  // namespace

std::span<const FoxgloveChannel, kSurfaceChannels> surface_channels() noexcept {
  static const std::array<FoxgloveChannel, kSurfaceChannels> channels = {
      {{0, view_names::kScene, topic_type<foxglove_SceneUpdate>()},
       {1, view_names::kWorth, topic_type<perimap_view_SurfaceWorth>()},
       {2, view_names::kTransforms, topic_type<foxglove_FrameTransform>()}}};
  return channels;
}

Expected<SurfaceMessages> SurfaceMessageMaker::of(const ShownSurface& surface, Instant now_utc) {
  SurfaceMessages messages;
  const auto put = [&](SurfaceChannel channel, Instant utc, const auto& message) {
    SurfaceMessage& made = messages[static_cast<std::size_t>(channel)];
    made.utc = utc;
    return bytes_of(serializer_, message).map([&made](std::string bytes) { made.cdr = std::move(bytes); });
  };
  const Instant valid = utc_of(surface, surface.valid, now_utc, kLast);
  auto done = put(SurfaceChannel::kScene, valid, scene_.of(surface, valid, surface.frame_id, std::nullopt));
  if (done) done = put(SurfaceChannel::kWorth, valid, worth_.of(surface, valid));
  if (done && surface.X_WC) {
    const Instant capture = utc_of(surface, surface.capture, now_utc, kLast);
    done = put(SurfaceChannel::kTransforms, capture,
               borrow_frame_transform(*surface.X_WC, capture, surface.frame_id, view_names::kCameraFrame));
  }
  if (!done) return tl::unexpected(done.error());
  return messages;
}

}  // namespace perimap

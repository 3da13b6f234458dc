#include "daemon/bridge/igtl/igtl_bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/bridge/live/shown_time.hpp"

namespace perimap {
namespace {

using Subject = IgtlOutgoing::Subject;
using Code = IgtlState::Code;

}  // namespace

Expected<std::unique_ptr<IgtlBridge>> IgtlBridge::create(const dds::Membership& membership, IgtlServer& server,
                                                         Say say) {
  std::unique_ptr<IgtlBridge> bridge(new IgtlBridge(membership.domain, server, std::move(say)));
  bridge->clear({Code::kNotPresent, 0, "invalid", "no surface has come yet"});
  server.at(MonotonicClock::now() + kNobodyAfter, [self = bridge.get()] { self->nobody(); });
  auto subscriber = SurfaceSubscriber::create(
      membership, {[self = bridge.get()](const ShownSurface& surface) {
                     self->server_.post([self, told = told_of(surface)] { self->tell(told); });
                   },
                   bridge->say_,
                   [self = bridge.get()] {
                     self->server_.post([self] {
                       self->failed_ = true;
                       self->server_.end();
                     });
                   }});
  if (!subscriber) return tl::unexpected(subscriber.error());
  bridge->subscriber_ = std::move(*subscriber);
  return bridge;
}

Expected<void> IgtlBridge::run(int stop_descriptor) {
  auto ran = server_.run(stop_descriptor, [this] {
    clear({Code::kShutDown, 0, "invalid", "perimap bridge igtl has ended"});
  });
  subscriber_.reset();
  if (!ran) return ran;
  if (failed_) return fail("DDS can not be waited for any more");
  return {};
}

IgtlBridge::Told IgtlBridge::told_of(const ShownSurface& surface) {
  Told told;
  told.surface = pack_surface(surface);
  told.tools = pack_tools(surface);
  told.tool_words = pack_tool_words(surface);
  told.has_tools = !surface.tools.empty();
  told.surface_state = surface_state_of(surface);
  told.camera_state = camera_state_of(surface);
  if (surface.X_WC) told.camera = pack_camera(surface);
  told.until = shown_until(surface, MonotonicClock::now());
  return told;
}

void IgtlBridge::tell(const Told& told) {
  heard_ = true;
  // It has waited for this thread until it may not be shown any more.
  if (MonotonicClock::now() > told.until) return silent();
  if (std::exchange(silent_, false)) say_("surfaces come again");
  server_.send(told.surface);
  if (told.camera) {
    server_.send(*told.camera);
  } else {
    server_.forget(Subject::kCamera);
  }
  tell_tools(told.tools, told.tool_words, told.has_tools);
  tell_states(told.surface_state, told.camera_state);
  server_.at(told.until, [this] { silent(); });
}

void IgtlBridge::tell_tools(const IgtlOutgoing& tips, const IgtlOutgoing& words, bool any) {
  had_tools_ = had_tools_ || any;
  if (!had_tools_) return;
  server_.send(tips);
  server_.send(words);
}

void IgtlBridge::tell_states(const IgtlState& surface, const IgtlState& camera) {
  if (surface_state_ != surface) server_.send(pack_state(Subject::kSurfaceStatus, surface));
  if (camera_state_ != camera) server_.send(pack_state(Subject::kCameraStatus, camera));
  surface_state_ = surface;
  camera_state_ = camera;
}

void IgtlBridge::clear(const IgtlState& why) {
  server_.send(pack_no_surface());
  server_.forget(Subject::kCamera);
  tell_tools(pack_tools({}), pack_tool_words({}), false);
  tell_states(why, {why.code == Code::kShutDown ? why.code : Code::kNotFound, 0, "unknown", why.words});
}

void IgtlBridge::nobody() {
  if (heard_) return;
  const std::string words = fmt::format("nobody publishes in DDS domain {}", domain_);
  say_(words + ": start perimapd, or name its domain by --domain");
  clear({Code::kNotPresent, 0, "invalid", words});
}

void IgtlBridge::silent() {
  if (!std::exchange(silent_, true))
    say_("nothing has come from perimapd for so long that what came last holds no more");
  clear({Code::kTimeOut, 0, "invalid", "use no position; nothing comes from perimapd"});
}

}  // namespace perimap

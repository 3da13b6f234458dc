#include "daemon/bridge/foxglove/foxglove_bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "daemon/web/access.hpp"

namespace perimap {
namespace {

// Those that are there are found within a second or two.
constexpr Duration kNobody = std::chrono::seconds(2);
// Each channel once, and again by a viewer that takes them before it gives others back.
constexpr std::size_t kMostSubscriptions = 16;

Instant now_utc() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return Instant(std::chrono::duration_cast<Duration>(since_1970));
}

PageMessage text_message(std::string text) {
  return {std::make_shared<const std::string>(std::move(text)), false, PageMessage::kNoLane};
}

}  // namespace

WebService FoxgloveBridge::service(std::vector<std::string> origins) {
  WebService service;
  service.command = "perimap bridge foxglove";
  service.scheme = "ws";
  service.subprotocols.assign(std::begin(kFoxgloveSubprotocols), std::end(kFoxgloveSubprotocols));
  service.origins = std::move(origins);
  return service;
}

Expected<std::unique_ptr<FoxgloveBridge>> FoxgloveBridge::create(const dds::Membership& membership, WebServer& server,
                                                                 std::string name, Say say) {
  auto session = make_token();
  if (!session) return tl::unexpected(session.error());
  std::unique_ptr<FoxgloveBridge> bridge(
      new FoxgloveBridge(membership.domain, server, std::move(name), std::move(*session), std::move(say)));
  FoxgloveBridge* self = bridge.get();
  auto subscriber =
      SurfaceSubscriber::create(membership, {[self](const ShownSurface& surface) { self->hear(surface); }, bridge->say_,
                                             [self] {
                                               self->server_.post([self] {
                                                 self->failed_ = true;
                                                 self->server_.end();
                                               });
                                             }});
  if (!subscriber) return tl::unexpected(subscriber.error());
  bridge->subscriber_ = std::move(*subscriber);
  return bridge;
}

FoxgloveBridge::FoxgloveBridge(int domain, WebServer& server, std::string name, std::string session, Say say)
    : domain_(domain), server_(server), name_(std::move(name)), session_(std::move(session)), say_(std::move(say)) {
  clear();
}

// The subscriber's thread.
void FoxgloveBridge::hear(const ShownSurface& surface) {
  auto messages = maker_.of(surface, now_utc());
  if (!messages) return say_(messages.error().message);
  Instant until = MonotonicClock::now() + kSilence;
  if (surface.usable()) until = std::min(until, surface.valid_until);
  server_.post([this, told = std::move(*messages), until, frame_id = surface.frame_id] {
    frame_id_ = frame_id;
    tell(told, until);
  });
}

void FoxgloveBridge::tell(const SurfaceMessages& messages, Instant until) {
  until_ = until;
  // It has waited for this thread until it may not be shown any more.
  if (MonotonicClock::now() > until) return tick();
  if (std::exchange(silent_, false)) say_status(FoxgloveLevel::kInfo, "surfaces come again");
  newest_ = messages;
  send_all();
}

// Sending may drop a viewer.
void FoxgloveBridge::send_all() {
  for (const auto& [viewer, subscriptions] : std::map(viewers_)) {
    for (const auto& [subscription, channel] : subscriptions) send(viewer, subscription, channel);
  }
}

// A message of a channel takes the place of an older one that waits still.
void FoxgloveBridge::send(PageId viewer, std::uint32_t subscription, SurfaceChannel channel) {
  const auto index = static_cast<std::size_t>(channel);
  const SurfaceMessage& message = newest_[index];
  if (message.cdr.empty()) return;
  const auto lane = static_cast<std::uint8_t>(1 + index);
  server_.send(viewer, {std::make_shared<const std::string>(foxglove_message(subscription, message.utc, message.cdr)),
                        true, lane});
}

void FoxgloveBridge::clear() {
  ShownSurface nothing;
  nothing.frame_id = frame_id_;
  auto messages = clearing_maker_.of(nothing, now_utc());
  if (!messages) return say_(messages.error().message);
  newest_ = std::move(*messages);
  send_all();
}

void FoxgloveBridge::say_status(FoxgloveLevel level, const std::string& what) {
  say_(what);
  server_.send_to_all(text_message(foxglove_status(level, what)));
}

void FoxgloveBridge::opened(PageId viewer) {
  viewers_[viewer];
  server_.send(viewer, text_message(foxglove_server_info(name_, session_)));
  server_.send(viewer, text_message(foxglove_advertise(surface_channels())));
}

Expected<void> FoxgloveBridge::said(PageId viewer, std::string_view text) {
  const auto request = parse_foxglove_request(text);
  if (!request) return tl::unexpected(request.error());
  Subscriptions& subscriptions = viewers_[viewer];
  for (const std::uint32_t id : request->unsubscribe) subscriptions.erase(id);
  for (const auto& [id, channel] : request->subscribe) {
    if (channel >= kSurfaceChannels) return fail("there is no such channel");
    subscriptions[id] = static_cast<SurfaceChannel>(channel);
  }
  if (subscriptions.size() > kMostSubscriptions) return fail("a viewer has 16 subscriptions at most");
  // What holds now is there at once. Sending may drop the viewer.
  for (const auto& [id, channel] : request->subscribe) send(viewer, id, static_cast<SurfaceChannel>(channel));
  return {};
}

void FoxgloveBridge::tick() {
  const Instant now = MonotonicClock::now();
  if (until_ == Instant()) {
    if (nobody_ || now - begun_ < kNobody) return;
    nobody_ = true;
    return say_status(
        FoxgloveLevel::kWarning,
        fmt::format("nobody publishes in DDS domain {}: start perimapd, or name its domain by --domain", domain_));
  }
  if (now <= until_ || std::exchange(silent_, true)) return;
  clear();
  say_status(FoxgloveLevel::kWarning,
             "use no position: nothing has come from perimapd for so long that what came last "
             "holds no more");
}

Expected<void> FoxgloveBridge::result() const {
  if (failed_) return fail("DDS can not be waited for any more");
  return {};
}

}  // namespace perimap

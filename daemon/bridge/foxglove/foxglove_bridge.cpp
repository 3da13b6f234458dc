#include "daemon/bridge/foxglove/foxglove_bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "daemon/bridge/live/shown_time.hpp"
#include "daemon/publishing/advice.hpp"
#include "daemon/web/access.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostToldOrigins = 16;

// RFC 6454 section 6.2, as browsers write it; "null" is anyone's.
bool is_origin(std::string_view text) {
  const std::size_t end = text.find("://");
  if (end == std::string_view::npos || end == 0 || text.size() > 256) return false;
  const auto small = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.'; };
  const std::string_view scheme = text.substr(0, end), rest = text.substr(end + 3);
  return std::all_of(scheme.begin(), scheme.end(), small) &&
         std::all_of(rest.begin(), rest.end(), [&](char c) { return small(c) || c == ':' || c == '[' || c == ']'; });
}

PageMessage text_message(std::string text) {
  return {std::make_shared<const std::string>(std::move(text)), false, PageMessage::kNoLane};
}

}  // namespace

Expected<WebService> FoxgloveBridge::service(std::vector<std::string> origins, Say say) {
  for (const std::string& origin : origins) {
    if (!is_origin(origin)) {
      return fail(
          fmt::format("expected an origin as browsers tell it, such as https://app.foxglove.dev or file://, in small "
                      "letters and without a path, got {:?}",
                      origin));
    }
  }
  WebService service;
  service.command = "perimap bridge foxglove";
  service.scheme = "ws";
  service.subprotocols.assign(std::begin(kFoxgloveSubprotocols), std::end(kFoxgloveSubprotocols));
  service.origins = std::move(origins);
  service.origin_refused = [say = std::move(say), told = std::set<std::string>()](std::string_view origin) mutable {
    if (!is_origin(origin) || told.size() >= kMostToldOrigins || !told.emplace(origin).second) return;
    say(fmt::format("a page of {} was refused; --allow-origin {} lets it in", origin, origin));
  };
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
  words_ = {FoxgloveLevel::kWarning, "use no position: no surface has come yet"};
}

// The subscriber's thread.
void FoxgloveBridge::hear(const ShownSurface& surface) {
  auto messages = maker_.of(surface, utc_now());
  if (!messages) return say_(messages.error().message);
  const Instant until = shown_until(surface, MonotonicClock::now());
  Words words{surface.usable() ? FoxgloveLevel::kInfo : FoxgloveLevel::kWarning,
              std::string(permission_of(surface.state))};
  if (!surface.why.empty()) words.text += ": " + surface.why;
  if (!surface.remedy.empty()) words.text += "; " + surface.remedy;
  server_.post([this, told = std::move(*messages), words = std::move(words), until, frame_id = surface.frame_id] {
    frame_id_ = frame_id;
    tell(told, words, until);
  });
}

void FoxgloveBridge::tell(const SurfaceMessages& messages, const Words& words, Instant until) {
  until_ = until;
  // It has waited for this thread until it may not be shown any more.
  if (MonotonicClock::now() > until) return tick();
  if (std::exchange(silent_, false)) say_("surfaces come again");
  newest_ = messages;
  send_all();
  say(words);
}

// Sending may drop a viewer.
void FoxgloveBridge::send_all() {
  for (const auto& [viewer, subscriptions] : std::map(viewers_)) {
    for (std::size_t channel = 0; channel < subscriptions.size(); ++channel) {
      if (subscriptions[channel]) send(viewer, *subscriptions[channel], channel);
    }
  }
}

// A message of a channel takes the place of an older one that waits still.
void FoxgloveBridge::send(PageId viewer, std::uint32_t subscription, std::size_t channel) {
  const SurfaceMessage& message = newest_[channel];
  if (message.cdr.empty()) return;
  const auto lane = static_cast<std::uint8_t>(1 + channel);
  server_.send(viewer, {std::make_shared<const std::string>(foxglove_message(subscription, message.utc, message.cdr)),
                        true, lane});
}

void FoxgloveBridge::clear() {
  ShownSurface nothing;
  nothing.frame_id = frame_id_;
  auto messages = clearing_maker_.of(nothing, utc_now());
  if (!messages) return say_(messages.error().message);
  newest_ = std::move(*messages);
  send_all();
}

// Viewers are told what is new; those that come later hear the last.
void FoxgloveBridge::say(const Words& words) {
  if (words == words_) return;
  words_ = words;
  server_.send_to_all(text_message(foxglove_status(words.level, words.text)));
}

void FoxgloveBridge::opened(PageId viewer) {
  viewers_[viewer];
  server_.send(viewer, text_message(foxglove_server_info(name_, session_)));
  server_.send(viewer, text_message(foxglove_advertise(surface_channels())));
  server_.send(viewer, text_message(foxglove_status(words_.level, words_.text)));
}

Expected<void> FoxgloveBridge::said(PageId viewer, std::string_view text) {
  const auto known = viewers_.find(viewer);
  if (known == viewers_.end()) return {};
  const auto request = parse_foxglove_request(text);
  if (!request) return tl::unexpected(request.error());
  Subscriptions& subscriptions = known->second;
  for (const std::uint32_t id : request->unsubscribe) {
    std::replace(subscriptions.begin(), subscriptions.end(), std::optional(id), std::optional<std::uint32_t>());
  }
  for (const auto& [id, channel] : request->subscribe) {
    if (channel >= kSurfaceChannels) return fail("there is no such channel");
    subscriptions[channel] = id;
  }
  tick();  // what is shown may hold no more
  // What holds now is there at once. Sending may drop the viewer.
  for (const auto& [id, channel] : request->subscribe) send(viewer, id, channel);
  return {};
}

void FoxgloveBridge::tick() {
  const Instant now = MonotonicClock::now();
  if (until_ == Instant()) {
    if (nobody_ || now - begun_ < kNobodyAfter) return;
    nobody_ = true;
    const std::string what = fmt::format("nobody publishes in DDS domain {}", domain_);
    say_(what + ": start perimapd, or name its domain by --domain");
    return say({FoxgloveLevel::kWarning, "use no position: " + what});
  }
  if (now <= until_ || std::exchange(silent_, true)) return;
  clear();
  say_("nothing has come from perimapd for so long that what came last holds no more");
  say({FoxgloveLevel::kWarning, "use no position: nothing comes from perimapd"});
}

void FoxgloveBridge::ending() {
  clear();
  say({FoxgloveLevel::kWarning, "use no position: perimap bridge foxglove has ended"});
}

Expected<void> FoxgloveBridge::result() const {
  if (failed_) return fail("DDS can not be waited for any more");
  return {};
}

}  // namespace perimap

#include "daemon/view/live/live_view.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <set>
#include <utility>

#include "daemon/subscribing/any_time.hpp"
#include "daemon/view/messages/messages.hpp"
#include "daemon/view/messages/milliseconds.hpp"
#include "drivers/recording/owned_copy.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

// A page draws no faster; of a stream of hundreds a second it gets every so manieth.
constexpr Duration kShortestPause = std::chrono::milliseconds(24);
constexpr std::uint8_t kSurfaceLane = 1;
constexpr std::uint8_t kGuidanceLane = 2;
constexpr std::uint8_t kGuidancePictureLane = 3;
constexpr Duration kSilence = std::chrono::milliseconds(500);
constexpr Duration kPublishes = std::chrono::seconds(2);  // who was heard so lately
constexpr Duration kForgotten = std::chrono::minutes(1);
constexpr Duration kStatusIsNew = std::chrono::seconds(2);
constexpr Duration kAfterAnError = std::chrono::milliseconds(100);

// Of those that have come together, the next one of the same writer; null: sample i was its last.
template <class T>
const T* next_of_writer(const dds::Loan<T>& loan, std::size_t i) {
  for (std::size_t k = i + 1; k < loan.size(); ++k) {
    if (loan.sample(k) != nullptr && loan.info(k).publication_handle == loan.info(i).publication_handle) {
      return loan.sample(k);
    }
  }
  return nullptr;
}

}  // namespace

Expected<std::unique_ptr<LiveView>> LiveView::create(const dds::Membership& membership, WebServer& server, Say say) {
  auto readers = SampleReaders::create(membership, true, true);
  if (!readers) return tl::unexpected(readers.error());
  std::optional<GuidanceReader> guidance;
  if (auto reader = GuidanceReader::create(readers->participant)) {
    if (auto attached = readers->wait_set.attach(reader->condition()); !attached) {
      return tl::unexpected(attached.error());
    }
    guidance.emplace(std::move(*reader));
  } else {
    // Keys of before there was such a topic.
    say("calibrations are not shown: " + reader.error().message);
  }
  return std::unique_ptr<LiveView>(
      new LiveView(membership.domain, std::move(*readers), std::move(guidance), server, std::move(say)));
}

LiveView::LiveView(int domain, SampleReaders readers, std::optional<GuidanceReader> guidance, WebServer& server,
                   Say say)
    : domain_(domain),
      readers_(std::move(readers)),
      guidance_(std::move(guidance)),
      server_(server),
      say_(std::move(say)) {
  thread_ = std::thread([this] { receive(); });
}

LiveView::~LiveView() {
  stopping_.store(true, std::memory_order_relaxed);
  readers_.wait_set.stop();
  thread_.join();
}

template <class T, class Use>
void LiveView::hear(dds::Reader<T>& reader, Use use) {
  const Expected<dds::Loan<T>> loan = reader.take();
  if (!loan) {
    if (!std::exchange(failing_, true)) say_(loan.error().message);
    std::this_thread::sleep_for(kAfterAnError);  // what is there to take stays there
    return;
  }
  for (std::size_t i = 0; i < loan->size(); ++i) {
    const T* sample = loan->sample(i);
    if (sample == nullptr) continue;
    const dds_instance_handle_t writer = loan->info(i).publication_handle;
    auto known = writers_.find(writer);
    if (known == writers_.end()) {
      const auto publisher = reader.participant_of(writer);
      if (!publisher) continue;  // it has gone
      known = writers_.emplace(writer, *publisher).first;
    }
    use(*sample, known->second, next_of_writer(*loan, i));
  }
}

void LiveView::receive() {
  pthread_setname_np(pthread_self(), "view");
  while (readers_.wait_set.wait()) {
    // Models, meshes and tools first: a surface is told with the newest.
    hear(readers_.models, [this](const perimap_SurfaceModel& model, std::uint64_t publisher, const auto*) {
      if (auto copy = owned_copy_of(model)) publishers_[publisher].teller.hear(std::move(*copy));
    });
    hear(readers_.meshes, [this](const perimap_SurfaceMesh& mesh, std::uint64_t publisher, const auto*) {
      if (auto copy = owned_copy_of(mesh)) publishers_[publisher].teller.hear(std::move(*copy));
    });
    if (readers_.tools) {
      hear(*readers_.tools, [this](const perimap_ToolDistance& tool, std::uint64_t publisher, const auto*) {
        publishers_[publisher].teller.hear(tool);
      });
    }
    const Instant receipt = MonotonicClock::now();
    hear(readers_.surfaces, [&](const perimap_Surface& surface, std::uint64_t publisher, const perimap_Surface* next) {
      publishers_[publisher].heard = receipt;
      const auto verdict = followed_.surface(publisher, surface.stream, receipt);
      {
        const std::lock_guard lock(mutex_);
        heard_[publisher] = {receipt, surface.source};
      }
      if (verdict == FollowedPublisher::Verdict::kOther) return;
      if (verdict == FollowedPublisher::Verdict::kNew) follow_anew(surface);
      count(surface, publisher, receipt);
      // Of several that have come together the last of each state is told, not the first.
      const bool same_next = next != nullptr && next->state == surface.state && next->reason == surface.reason &&
                             std::string_view(next->stream) == surface.stream;
      if (!same_next) tell(surface, publisher, receipt);
    });
    hear(readers_.phases, [this](const perimap_Phase& phase, std::uint64_t publisher, const auto*) {
      if (followed_.follows(publisher) && server_.pages() > 0) send(text_message(phase_json(phase)));
    });
    hear(readers_.statuses, [this](const perimap_Status& status, std::uint64_t publisher, const auto*) {
      if (!followed_.follows(publisher, status.stream)) return;
      server_.post([this, message = text_message(status_message_json(status))] {
        status_ = message;
        status_came_ = MonotonicClock::now();
        server_.send_to_all(message);
      });
    });
    hear_guidance();
    forget_old(receipt);
  }
  if (stopping_.load(std::memory_order_relaxed)) return;
  failed_.store(true, std::memory_order_relaxed);
  server_.post([this] { server_.end(); });
}

Expected<void> LiveView::result() const {
  if (failed_.load(std::memory_order_relaxed)) return fail("DDS can not be waited for any more");
  return {};
}

// Another perimapd, another run of it, or another stream: nothing of what was shown is of this one.
void LiveView::follow_anew(const perimap_Surface& surface) {
  last_sequence_.reset();
  since_ = {};
  state_.reset();
  const PageMessage message =
      text_message(Json{{"kind", "following"}, {"source", surface.source}, {"stream", surface.stream}});
  server_.post([this, message] {
    status_.reset();
    following_ = message;
    server_.send_to_all(message);
  });
}

void LiveView::count(const perimap_Surface& surface, std::uint64_t /*publisher*/, Instant receipt) {
  if (last_sequence_ && surface.sample_sequence > *last_sequence_) {
    since_.lost += surface.sample_sequence - *last_sequence_ - 1;
  }
  last_sequence_ = surface.sample_sequence;
  since_.late_ms.push_back(page_ms(wrapped_difference(to_ns(receipt), surface.release_time_ns)));
  if (server_.pages() == 0) since_ = {};
}

void LiveView::tell(const perimap_Surface& surface, std::uint64_t publisher, Instant receipt) {
  const bool changed = state_ != surface.state || reason_ != surface.reason;
  if (server_.pages() == 0 || (!changed && receipt - sent_ < kShortestPause)) return;
  Json json = publishers_[publisher].teller.tell(surface, receipt);
  if (of_another_clock(surface.release_time_ns, receipt)) {
    json.update({{"state", "invalid"},
                 {"why", "perimapd runs on another host, whose clock is not this one's"},
                 {"remedy", "run perimap view on perimapd's host, and open its page from here (--bind, or ssh -L)"}});
    since_.late_ms.clear();
  }
  const Instant now = MonotonicClock::now();
  json["late_ms"] = std::move(since_.late_ms);
  json["lost"] = since_.lost;
  json["valid_for_ms"] = page_ms(wrapped_difference(surface.valid_until_ns, to_ns(now)));
  json["sent_ms"] = page_ms(to_ns(now));
  since_ = {};
  sent_ = receipt;
  state_ = surface.state;
  reason_ = surface.reason;
  // A change of the state is told, however slowly a page reads.
  send(text_message(json, changed ? PageMessage::kNoLane : kSurfaceLane));
}

void LiveView::hear_guidance() {
  if (!guidance_) return;
  hear(*guidance_, [this](const perimap_Guidance& guidance, std::uint64_t /*publisher*/, const auto*) {
    if (server_.pages() == 0) return;
    // Its last is told, however slowly a page reads.
    const bool last = guidance.stage == perimap_GUIDANCE_RECORDED;
    send(text_message(guidance_json(guidance), last ? PageMessage::kNoLane : kGuidanceLane));
    const auto& picture = guidance.picture;
    if (picture._length == 0) return;
    auto bytes = std::make_shared<const std::string>(picture._buffer, picture._buffer + picture._length);
    send({std::move(bytes), true, kGuidancePictureLane});
  });
}

// So that perimapds that come and go leave nothing.
void LiveView::forget_old(Instant now) {
  const auto old = [now](Instant heard) { return heard != Instant() && now - heard > kForgotten; };
  if (std::erase_if(publishers_, [&](const auto& entry) { return old(entry.second.heard); }) == 0) return;
  std::erase_if(writers_, [this](const auto& entry) { return !publishers_.contains(entry.second); });
}

void LiveView::send(const PageMessage& message) {
  server_.post([this, message] { server_.send_to_all(message); });
}

PageMessage LiveView::publishers_message() const {
  return text_message(Json{{"kind", "publishers"},
                           {"domain", domain_},
                           {"count", count_ ? Json(*count_) : Json(nullptr)},
                           {"same_source", same_source_}});
}

void LiveView::opened(PageId page) {
  server_.send(page, text_message(Json{{"kind", "hello"}, {"mode", "live"}, {"domain", domain_}}));
  server_.send(page, publishers_message());
  if (following_) server_.send(page, *following_);
  if (status_ && MonotonicClock::now() - status_came_ < kStatusIsNew) server_.send(page, *status_);
}

Expected<void> LiveView::said(PageId /*page*/, std::string_view /*text*/) {
  return fail("nothing can be asked of what is live");
}

void LiveView::tick() {
  const Instant now = MonotonicClock::now();
  std::size_t count = 0;
  bool same_source = false;
  std::optional<Instant> last;
  {
    const std::lock_guard lock(mutex_);
    std::set<std::string> sources;
    for (const auto& [publisher, heard] : heard_) {
      if (!last || heard.at > *last) last = heard.at;
      if (now - heard.at >= kPublishes) continue;
      ++count;
      same_source = same_source || !sources.insert(heard.source).second;
    }
    std::erase_if(heard_, [now](const auto& entry) { return now - entry.second.at > kForgotten; });
  }
  // Those that are there are found within a second or two.
  const bool changed = count != count_ || same_source != same_source_;
  if (changed && (count > 0 || now - begun_ > kPublishes)) {
    count_ = count;
    same_source_ = same_source;
    server_.send_to_all(publishers_message());
    if (count == 0) {
      say_(fmt::format("nobody publishes in DDS domain {}: start perimapd, or name its domain by --domain", domain_));
    } else if (count == 1) {
      say_(fmt::format("a perimapd publishes in DDS domain {}", domain_));
    } else {
      say_(fmt::format("{} perimapds publish in DDS domain {}: the page shows one of them; end the others", count,
                       domain_));
    }
  }
  const bool silent = last && now - *last > kSilence;
  if (std::exchange(silent_, silent) != silent) {
    say_(silent ? "nothing has come from perimapd for half a second" : "surfaces come again");
  }
}

}  // namespace perimap

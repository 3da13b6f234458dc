#include "daemon/view/live/live_view.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <utility>

#include "daemon/view/messages/messages.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

// A page draws no faster; of a stream of hundreds a second it gets every so manieth.
constexpr Duration kShortestPause = std::chrono::milliseconds(24);
constexpr Duration kSilence = std::chrono::milliseconds(500);

double ms(Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

// A copy that owns its sequences; none when it is not valid.
template <class T>
std::optional<Sample<T>> copy_of(const T& sample) {
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(sample);
  if (!bytes) return std::nullopt;
  auto copy = deserialize<T>(*bytes);
  if (!copy) return std::nullopt;
  return std::move(*copy);
}

}  // namespace

Expected<LiveView::Readers> LiveView::subscribe(const dds::Membership& membership) {
  auto participant = dds::Participant::create(membership);
  if (!participant) return tl::unexpected(participant.error());
  auto surfaces = dds::Reader<perimap_Surface>::create(*participant);
  auto models = dds::Reader<perimap_SurfaceModel>::create(*participant);
  auto meshes = dds::Reader<perimap_SurfaceMesh>::create(*participant);
  auto phases = dds::Reader<perimap_Phase>::create(*participant);
  auto statuses = dds::Reader<perimap_Status>::create(*participant);
  auto wait_set = dds::WaitSet::create(*participant);
  const auto error_of = [](const auto& result) { return result ? Error{} : result.error(); };
  for (const Error& error : {error_of(surfaces), error_of(models), error_of(meshes), error_of(phases),
                             error_of(statuses), error_of(wait_set)}) {
    if (!error.message.empty()) return tl::unexpected(error);
  }
  for (const dds_entity_t condition :
       {surfaces->condition(), models->condition(), meshes->condition(), phases->condition(), statuses->condition()}) {
    if (auto attached = wait_set->attach(condition); !attached) return tl::unexpected(attached.error());
  }
  return Readers{std::move(*participant), std::move(*surfaces), std::move(*models),  std::move(*meshes),
                 std::move(*phases),      std::move(*statuses), std::move(*wait_set)};
}

Expected<std::unique_ptr<LiveView>> LiveView::create(const dds::Membership& membership, WebServer& server, Say say) {
  auto readers = subscribe(membership);
  if (!readers) return tl::unexpected(readers.error());
  return std::unique_ptr<LiveView>(new LiveView(membership.domain, std::move(*readers), server, std::move(say)));
}

LiveView::LiveView(int domain, Readers readers, WebServer& server, Say say)
    : domain_(domain), readers_(std::move(readers)), server_(server), say_(std::move(say)) {
  thread_ = std::thread([this] { receive(); });
}

LiveView::~LiveView() {
  readers_.wait_set.stop();
  thread_.join();
}

template <class T, class Use>
void LiveView::take(dds::Reader<T>& reader, Use use) {
  const Expected<dds::Loan<T>> loan = reader.take();
  if (!loan) {
    if (!std::exchange(failing_, true)) say_(loan.error().message);
    return;
  }
  for (std::size_t i = 0; i < loan->size(); ++i) {
    const T* sample = loan->sample(i);
    if (sample == nullptr) continue;
    const dds_instance_handle_t publication = loan->info(i).publication_handle;
    auto known = publishers_.find(publication);
    if (known == publishers_.end()) {
      const auto publisher = reader.participant_of(publication);
      if (!publisher) continue;  // its writer has gone
      known = publishers_.emplace(publication, *publisher).first;
    }
    use(*sample, known->second);
  }
}

void LiveView::receive() {
  pthread_setname_np(pthread_self(), "view");
  while (readers_.wait_set.wait()) {
    const Instant receipt = MonotonicClock::now();
    // Models and meshes first: a surface is told with the newest.
    take(readers_.models, [this](const perimap_SurfaceModel& model, std::uint64_t publisher) {
      if (auto copy = copy_of(model)) tellers_[publisher].take(std::move(*copy));
    });
    take(readers_.meshes, [this](const perimap_SurfaceMesh& mesh, std::uint64_t publisher) {
      if (auto copy = copy_of(mesh)) tellers_[publisher].take(std::move(*copy));
    });
    take(readers_.surfaces, [this, receipt](const perimap_Surface& sample, std::uint64_t publisher) {
      surface(sample, publisher, receipt);
    });
    take(readers_.phases, [this](const perimap_Phase& phase, std::uint64_t publisher) {
      if (followed_.follows(publisher) && server_.pages() > 0) send(text_message(phase_json(phase)));
    });
    take(readers_.statuses, [this](const perimap_Status& status, std::uint64_t publisher) {
      if (followed_.follows(publisher, status.stream)) send_status(text_message(status_message_json(status)));
    });
  }
}

void LiveView::surface(const perimap_Surface& surface, std::uint64_t publisher, Instant receipt) {
  if (!followed_.surface(publisher, surface.stream, receipt)) return;
  last_surface_ns_.store(to_ns(receipt), std::memory_order_relaxed);
  if (last_sequence_ && surface.sample_sequence > *last_sequence_) {
    since_.lost += surface.sample_sequence - *last_sequence_ - 1;
  }
  last_sequence_ = surface.sample_sequence;
  if (server_.pages() == 0) {
    since_ = {};
    return;
  }
  since_.delays_ms.push_back(ms(receipt - from_ns(surface.capture_time_ns)));
  since_.late_ms.push_back(ms(receipt - from_ns(surface.release_time_ns)));
  const std::string state = fmt::format("{} {}", static_cast<int>(surface.state), static_cast<int>(surface.reason));
  if (receipt - sent_ < kShortestPause && state == last_state_) return;
  Json json = tellers_[publisher].tell(surface, receipt);
  json["delays_ms"] = std::move(since_.delays_ms);
  json["late_ms"] = std::move(since_.late_ms);
  json["lost"] = since_.lost;
  since_ = {};
  sent_ = receipt;
  last_state_ = state;
  json["sent_ms"] = ms(MonotonicClock::now().time_since_epoch());
  send(text_message(json, true));
}

void LiveView::send(const PageMessage& message) {
  server_.post([this, message] { server_.send_to_all(message); });
}

void LiveView::send_status(const PageMessage& message) {
  server_.post([this, message] {
    status_ = message;
    server_.send_to_all(message);
  });
}

PageMessage LiveView::publishers_message() const {
  return text_message(Json{{"kind", "publishers"}, {"domain", domain_}, {"count", std::max(count_, 0)}});
}

void LiveView::opened(PageId page) {
  server_.send(page, text_message(Json{{"kind", "hello"}, {"mode", "live"}, {"domain", domain_}}));
  server_.send(page, publishers_message());
  if (status_) server_.send(page, *status_);
}

Expected<void> LiveView::said(PageId /*page*/, std::string_view /*text*/) {
  return fail("nothing can be asked of what is live");
}

void LiveView::tick() {
  const int count = readers_.surfaces.matched_writers();
  if (std::exchange(count_, count) != count) {
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
  const std::int64_t last_ns = last_surface_ns_.load(std::memory_order_relaxed);
  const bool silent = last_ns != 0 && MonotonicClock::now() - from_ns(last_ns) > kSilence;
  if (std::exchange(silent_, silent) != silent) {
    say_(silent ? "nothing has come from perimapd for half a second" : "surfaces come again");
  }
}

}  // namespace perimap

#include "daemon/bridge/live/surface_subscriber.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <utility>

#include "daemon/subscribing/any_time.hpp"
#include "drivers/recording/owned_copy.hpp"

namespace perimap {
namespace {

using client::Hearing;

constexpr Duration kAfterAnError = std::chrono::milliseconds(100);
// Sources are remembered by name, for a minute: whoever publishes under ever new names keeps others out for no longer.
constexpr std::size_t kMostSources = 64;
constexpr Duration kForgotten = std::chrono::minutes(1);

}  // namespace

Expected<std::unique_ptr<SurfaceSubscriber>> SurfaceSubscriber::create(const dds::Membership& membership, Calls calls) {
  auto readers = SampleReaders::create(membership, true, true);
  if (!readers) return tl::unexpected(readers.error());
  return std::unique_ptr<SurfaceSubscriber>(new SurfaceSubscriber(std::move(*readers), std::move(calls)));
}

SurfaceSubscriber::SurfaceSubscriber(SampleReaders readers, Calls calls)
    : readers_(std::move(readers)), calls_(std::move(calls)) {
  thread_ = std::thread([this] { receive(); });
}

SurfaceSubscriber::~SurfaceSubscriber() {
  stopping_.store(true, std::memory_order_relaxed);
  readers_.wait_set.stop();
  thread_.join();
}

template <class T, class Use>
void SurfaceSubscriber::take(dds::Reader<T>& reader, Use use) {
  const Expected<dds::Loan<T>> loan = reader.take();
  if (!loan) {
    if (!std::exchange(failing_, true)) calls_.say(loan.error().message);
    std::this_thread::sleep_for(kAfterAnError);  // what is there to take stays there
    return;
  }
  const Instant receipt = MonotonicClock::now();
  for (std::size_t i = 0; i < loan->size(); ++i) {
    const T* sample = loan->sample(i);
    if (sample == nullptr) continue;
    use(*sample, loan->info(i).publication_handle, receipt, i + 1 < loan->size() ? loan->sample(i + 1) : nullptr);
  }
}

void SurfaceSubscriber::receive() {
  pthread_setname_np(pthread_self(), "bridge");
  const auto use = [this](const auto& sample, dds_instance_handle_t writer, Instant receipt, const auto*) {
    keep(sample, writer, receipt);
  };
  while (readers_.wait_set.wait()) {
    // Models, meshes and tools first: a surface is shown with the newest.
    take(readers_.models, use);
    take(readers_.meshes, use);
    if (readers_.tools) take(*readers_.tools, use);
    take(readers_.phases, use);
    take(readers_.statuses, use);
    take(readers_.surfaces, [this](const perimap_Surface& surface, dds_instance_handle_t writer, Instant receipt,
                                   const perimap_Surface* next) { hear(surface, writer, receipt, next); });
  }
  if (!stopping_.load(std::memory_order_relaxed)) calls_.failed();
}

std::optional<std::uint64_t> SurfaceSubscriber::number_of(std::string_view source, Instant receipt) {
  const auto known = sources_.find(source);
  if (known != sources_.end()) {
    known->second.heard = receipt;
    return known->second.number;
  }
  if (sources_.size() >= kMostSources) {
    std::erase_if(sources_, [receipt](const auto& entry) { return receipt - entry.second.heard > kForgotten; });
  }
  if (sources_.size() >= kMostSources) return std::nullopt;
  if (!sources_.empty()) {
    calls_.say(fmt::format("another source, {:?}, publishes too: one at a time is followed", source));
  }
  const std::uint64_t number = ++last_number_;
  sources_.emplace(source, Source{number, receipt});
  return number;
}

// What the watch has to hear, and of it what a mesh is moved by.
template <class T>
void SurfaceSubscriber::keep(const T& sample, dds_instance_handle_t writer, Instant receipt) {
  const auto known = sources_.find(std::string_view(sample.source));
  if (known == sources_.end() || !followed_.follows(known->second.number)) return;
  if (watch_.hear(sample, writer, to_ns(receipt)) != Hearing::kUse) return;
  if constexpr (std::is_same_v<T, perimap_SurfaceModel> || std::is_same_v<T, perimap_SurfaceMesh>) {
    if (auto copy = owned_copy_of(sample)) gate_.take(std::move(*copy));
  } else if constexpr (std::is_same_v<T, perimap_ToolDistance>) {
    gate_.take(sample);
  }
}

void SurfaceSubscriber::hear(const perimap_Surface& surface, dds_instance_handle_t writer, Instant receipt,
                             const perimap_Surface* next) {
  const auto source = number_of(surface.source, receipt);
  if (!source) return;
  const auto verdict = followed_.surface(*source, surface.stream, receipt);
  if (verdict == FollowedPublisher::Verdict::kNew) follow_anew(surface);
  // A publisher of the other stream, or of another name, is none of this one's; but the watch knows streams by itself.
  if (!followed_.follows(*source)) return;
  const Hearing hearing = watch_.hear(surface, writer, to_ns(receipt));
  if (!followed_.follows(*source, surface.stream)) return;
  const bool changed = hearing != hearing_ || surface.state != state_ || surface.reason != reason_;
  // Of several that have come together the last of each state is told, not the first.
  const bool same_next = next != nullptr && next->state == surface.state && next->reason == surface.reason &&
                         std::string_view(next->source) == surface.source &&
                         std::string_view(next->stream) == surface.stream;
  if (same_next || (!changed && receipt - told_ < kShortestPause)) return;
  hearing_ = hearing;
  state_ = surface.state;
  reason_ = surface.reason;
  told_ = receipt;
  if (hearing != Hearing::kUse) {
    calls_.surface(show_nothing(surface, client::describe(hearing), ""));
  } else if (of_another_clock(surface.release_time_ns, receipt)) {
    calls_.surface(show_nothing(surface, "perimapd runs on another host, whose clock is not this one's",
                                "run the bridge on perimapd's host, and let others connect to it there"));
  } else {
    calls_.surface(gate_.show(surface, receipt));
  }
}

// Another perimapd, or another stream of it: nothing of what is kept is of this one.
void SurfaceSubscriber::follow_anew(const perimap_Surface& surface) {
  watch_ = client::PublisherWatch();
  gate_.forget();
  hearing_.reset();
  calls_.say(fmt::format("{:?} is followed, its stream {:?}", std::string_view(surface.source),
                         std::string_view(surface.stream)));
}

}  // namespace perimap

// What a running perimapd publishes, as far as it may be shown: for the programs of others.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <perimap_publisher_watch.hpp>
#include <string>
#include <string_view>
#include <thread>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/dds/sample_readers.hpp"
#include "daemon/subscribing/followed_publisher.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

// Follows one source: the first one heard, until it is silent for a second. Of two publishers under its name, and in
// the first second of one, nothing is shown. A thread of its own, on which all calls are made.
class SurfaceSubscriber {
 public:
  // A stream that is faster is thinned out to this; a change of the state comes at once.
  static constexpr Duration kShortestPause = std::chrono::milliseconds(12);

  struct Calls {
    // In the order of receipt.
    std::function<void(ShownSurface)> surface;
    // For a person at the terminal: that a source is followed, and that there are others.
    std::function<void(const std::string&)> say;
    // DDS cannot be waited for any more: nothing comes after this.
    std::function<void()> failed;
  };

  [[nodiscard]] static Expected<std::unique_ptr<SurfaceSubscriber>> create(const dds::Membership& membership,
                                                                           Calls calls);
  SurfaceSubscriber(const SurfaceSubscriber&) = delete;
  SurfaceSubscriber& operator=(const SurfaceSubscriber&) = delete;
  // Waits for a call that is being made.
  ~SurfaceSubscriber();

 private:
  struct Source {
    std::uint64_t number = 0;
    Instant heard;
  };

  SurfaceSubscriber(SampleReaders readers, Calls calls);

  void receive();
  // Gives each sample with its writer, when it came, and the next one of those that have come together (or null).
  template <class T, class Use>
  void take(dds::Reader<T>& reader, Use use);
  template <class T>
  void keep(const T& sample, dds_instance_handle_t writer, Instant receipt);
  void hear(const perimap_Surface& surface, dds_instance_handle_t writer, Instant receipt, const perimap_Surface* next);
  // By which FollowedPublisher tells sources apart; none: there are too many.
  [[nodiscard]] std::optional<std::uint64_t> number_of(std::string_view source, Instant receipt);
  void follow_anew(const perimap_Surface& surface);

  SampleReaders readers_;
  const Calls calls_;
  std::map<std::string, Source, std::less<>> sources_;  // that were heard lately, by name
  std::uint64_t last_number_ = 0;
  FollowedPublisher followed_;
  client::PublisherWatch watch_;  // of the followed one
  SurfaceGate gate_;
  std::optional<client::Hearing> hearing_;  // that the last surface was told with
  perimap_SurfaceState state_ = perimap_SURFACE_INVALID;
  perimap_SurfaceReason reason_ = perimap_SURFACE_REASON_NONE;
  Instant told_;
  bool failing_ = false;
  std::atomic<bool> stopping_{false};  // relaxed: a message by itself
  std::thread thread_;
};

}  // namespace perimap

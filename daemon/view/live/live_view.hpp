// What a running perimapd publishes, and how a calibration goes, for the pages: a subscriber like any other.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/dds/sample_readers.hpp"
#include "daemon/subscribing/followed_publisher.hpp"
#include "daemon/view/messages/surface_teller.hpp"
#include "daemon/web/web_server.hpp"

namespace perimap {

// A thread of its own receives and makes the messages; the server's thread sends them.
class LiveView final : public PageHandler {
 public:
  // For a person at the terminal; any thread.
  using Say = std::function<void(const std::string&)>;

  // The server must outlive this.
  [[nodiscard]] static Expected<std::unique_ptr<LiveView>> create(const dds::Membership& membership, WebServer& server,
                                                                  Say say);
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;
  ~LiveView() override;

  void opened(PageId page) override;
  // Nothing can be asked of what is live.
  [[nodiscard]] Expected<void> said(PageId page, std::string_view text) override;
  void tick() override;
  // Of the receiving thread: it has ended by itself, and so has the server.
  [[nodiscard]] Expected<void> result() const override;

 private:
  // What came since the last surface that was sent.
  struct Since {
    std::vector<double> late_ms;  // receipt minus release
    std::uint64_t lost = 0;       // by the sequence
  };
  // One perimapd, as the receiving thread knows it.
  struct Publisher {
    SurfaceTeller teller;
    Instant heard;
  };

  using GuidanceReader = dds::Reader<perimap_Guidance>;

  LiveView(int domain, SampleReaders readers, std::optional<GuidanceReader> guidance, WebServer& server, Say say);

  void receive();
  // Gives each sample with its publisher, and the next one of the same writer that has come with it (or null).
  template <class T, class Use>
  void hear(dds::Reader<T>& reader, Use use);
  void count(const perimap_Surface& surface, std::uint64_t publisher, Instant receipt);
  void tell(const perimap_Surface& surface, std::uint64_t publisher, Instant receipt);
  void follow_anew(const perimap_Surface& surface);
  void hear_guidance();
  void forget_old(Instant now);
  void send(const PageMessage& message);
  [[nodiscard]] PageMessage publishers_message() const;

  const int domain_;
  SampleReaders readers_;
  std::optional<GuidanceReader> guidance_;  // none: the keys do not allow it
  WebServer& server_;
  const Say say_;
  const Instant begun_ = MonotonicClock::now();

  // Of the receiving thread.
  FollowedPublisher followed_;
  std::map<std::uint64_t, Publisher> publishers_;
  std::map<dds_instance_handle_t, std::uint64_t> writers_;  // whose they are
  std::optional<perimap_SurfaceState> state_;               // of the last surface that was followed
  std::optional<perimap_SurfaceReason> reason_;
  Since since_;
  Instant sent_;
  std::optional<std::uint64_t> last_sequence_;
  bool failing_ = false;

  // Of both threads: when each perimapd's last surface came, and of which source it was.
  struct Heard {
    Instant at;
    std::string source;
  };
  std::mutex mutex_;
  std::map<std::uint64_t, Heard> heard_;

  // Relaxed: each is a message by itself.
  std::atomic<bool> stopping_{false};
  std::atomic<bool> failed_{false};

  // Of the server's thread.
  std::optional<std::size_t> count_;  // perimapds that publish; none: not told yet
  bool same_source_ = false;          // two of them under one name
  bool silent_ = false;
  std::optional<PageMessage> status_;
  Instant status_came_;
  std::optional<PageMessage> following_;

  std::thread thread_;
};

}  // namespace perimap

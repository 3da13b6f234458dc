// What a running perimapd publishes, for the pages: a subscriber like any other.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/dds/reader.hpp"
#include "daemon/dds/wait_set.hpp"
#include "daemon/view/live/followed_publisher.hpp"
#include "daemon/view/messages/surface_teller.hpp"
#include "daemon/view/web/web_server.hpp"

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

 private:
  struct Readers {
    dds::Participant participant;
    dds::Reader<perimap_Surface> surfaces;
    dds::Reader<perimap_SurfaceModel> models;
    dds::Reader<perimap_SurfaceMesh> meshes;
    dds::Reader<perimap_Phase> phases;
    dds::Reader<perimap_Status> statuses;
    dds::WaitSet wait_set;
  };
  // What came since the last surface that was sent.
  struct Since {
    std::vector<double> delays_ms;  // receipt minus capture
    std::vector<double> late_ms;    // receipt minus release
    std::uint64_t lost = 0;         // by the sequence
  };

  LiveView(int domain, Readers readers, WebServer& server, Say say);
  [[nodiscard]] static Expected<Readers> subscribe(const dds::Membership& membership);

  void receive();
  template <class T, class Use>
  void take(dds::Reader<T>& reader, Use use);
  void surface(const perimap_Surface& surface, std::uint64_t publisher, Instant receipt);
  void send(const PageMessage& message);
  void send_status(const PageMessage& message);
  [[nodiscard]] PageMessage publishers_message() const;

  const int domain_;
  Readers readers_;
  WebServer& server_;
  const Say say_;

  // Of the receiving thread.
  FollowedPublisher followed_;
  std::map<std::uint64_t, SurfaceTeller> tellers_;             // by publisher
  std::map<dds_instance_handle_t, std::uint64_t> publishers_;  // of writers
  Since since_;
  Instant sent_;
  std::string last_state_;
  std::optional<std::uint64_t> last_sequence_;
  bool failing_ = false;

  // Relaxed: by itself, when a surface last came; 0: never.
  std::atomic<std::int64_t> last_surface_ns_{0};

  // Of the server's thread.
  int count_ = -1;  // perimapds in the domain; -1: not told yet
  bool silent_ = false;
  std::optional<PageMessage> status_;

  std::thread thread_;
};

}  // namespace perimap

// What is published, to the viewers Foxglove and Lichtblick.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/bridge/foxglove/surface_messages.hpp"
#include "daemon/bridge/live/surface_subscriber.hpp"
#include "daemon/web/web_server.hpp"

namespace perimap {

// A surface is there for as long as it may be used: an invalid one, one whose valid_until has passed and none at all
// take what was shown away, and say why.
class FoxgloveBridge final : public PageHandler {
 public:
  // For a person at the terminal; any thread.
  using Say = std::function<void(const std::string&)>;

  // What the server has to be made for. `origins`: of pages of elsewhere that may connect; an error says which is none.
  // `say` is told of the first ones that were refused.
  [[nodiscard]] static Expected<WebService> service(std::vector<std::string> origins, Say say);

  // Joins the domain. The server must outlive this; `name` is what viewers call it.
  [[nodiscard]] static Expected<std::unique_ptr<FoxgloveBridge>> create(const dds::Membership& membership,
                                                                        WebServer& server, std::string name, Say say);
  FoxgloveBridge(const FoxgloveBridge&) = delete;
  FoxgloveBridge& operator=(const FoxgloveBridge&) = delete;
  ~FoxgloveBridge() override = default;

  void opened(PageId viewer) override;
  void closed(PageId viewer) override { viewers_.erase(viewer); }
  [[nodiscard]] Expected<void> said(PageId viewer, std::string_view text) override;
  void tick() override;
  void ending() override;
  [[nodiscard]] Expected<void> result() const override;

 private:
  // Of each channel the viewer's number; a later subscription takes the place of one before.
  using Subscriptions = std::array<std::optional<std::uint32_t>, kSurfaceChannels>;
  // What a viewer is to be told in words, beside the messages.
  struct Words {
    FoxgloveLevel level = FoxgloveLevel::kInfo;
    std::string text;
    [[nodiscard]] bool operator==(const Words&) const = default;
  };

  FoxgloveBridge(int domain, WebServer& server, std::string name, std::string session, Say say);

  void hear(const ShownSurface& surface);
  // Of the server's thread.
  void tell(const SurfaceMessages& messages, const Words& words, Instant until);
  void send(PageId viewer, std::uint32_t subscription, std::size_t channel);
  void send_all();
  void clear();
  void say(const Words& words);

  const int domain_;
  WebServer& server_;
  const std::string name_, session_;
  const Say say_;
  const Instant begun_ = MonotonicClock::now();

  SurfaceMessageMaker maker_;  // of the subscriber's thread

  // Of the server's thread.
  std::map<PageId, Subscriptions> viewers_;
  SurfaceMessageMaker clearing_maker_;
  SurfaceMessages newest_;
  Words words_;
  std::string frame_id_ = "tracker";
  Instant until_;  // what is shown may be shown; the clock's epoch: nothing has come
  bool silent_ = false;
  bool nobody_ = false;
  bool failed_ = false;

  std::unique_ptr<SurfaceSubscriber> subscriber_;  // last: its thread uses the others
};

}  // namespace perimap

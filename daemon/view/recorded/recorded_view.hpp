// A recording for the pages: any instant of it, which each page asks for as its own time line goes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "daemon/recordings/published_states.hpp"
#include "daemon/recordings/recording_player.hpp"
#include "daemon/view/messages/page_request.hpp"
#include "daemon/view/messages/surface_teller.hpp"
#include "daemon/web/web_server.hpp"
#include "drivers/recording/recorded_frame.hpp"

namespace perimap {

// On the server's thread alone. Instants are those of the surfaces' publisher.
class RecordedView final : public PageHandler {
 public:
  struct Files {
    std::string recording;  // of devices, of what was received, or of both
    std::string samples;    // what was received, where that is a file of its own; empty: it is not
  };
  // For a person at the terminal.
  using Say = std::function<void(const std::string&)>;

  // The server must outlive this. Says what is damaged, and what is not there.
  [[nodiscard]] static Expected<std::unique_ptr<RecordedView>> open(const Files& files, WebServer& server, Say say);

  void opened(PageId page) override;
  [[nodiscard]] Expected<void> said(PageId page, std::string_view text) override;

 private:
  using Json = nlohmann::ordered_json;
  struct Shown {
    Sample<perimap_Surface> surface;
    Instant receipt;
  };
  // A frame as it stands in the recording.
  struct Picture {
    RecordedMessage message;
    std::vector<std::byte> bytes;
    std::string type;
  };

  RecordedView(std::string name, std::vector<RecordingPlayer> players, PublishedStates states, WebServer& server,
               Say say);

  // Of the players the first has what devices gave, the last what was published.
  [[nodiscard]] Duration offset_of(const RecordingPlayer& player) const {
    return &player == &players_.back() ? Duration(0) : offset_;
  }
  void read_lens();
  void say_what_is_missing();
  void show(PageId page, const PageRequest& request);
  void use(RecordingPlayer& player, const RecordedMessage& message, Json& told);
  void use_surface(Sample<perimap_Surface> surface, Instant receipt, Json& told);
  void keep_picture(const RecordedMessage& message);
  void send_picture(PageId page, Json& told);
  [[nodiscard]] Json hello() const;

  std::string name_;
  std::vector<RecordingPlayer> players_;
  PublishedStates states_;
  WebServer& server_;
  Say say_;
  Duration offset_{0};  // of the devices' recording
  Instant begin_, end_;
  std::optional<CameraModel> lens_;
  std::vector<std::string> warnings_;

  // What was shown last, and to whom.
  std::optional<PageId> page_;
  Instant at_;
  SurfaceTeller teller_;
  std::optional<Shown> shown_;
  std::map<std::uint64_t, Picture> pictures_;  // the last ones, by the camera's count
  RecordedFrame frame_;
};

}  // namespace perimap

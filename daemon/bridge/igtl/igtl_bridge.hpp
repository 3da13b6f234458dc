// What is published, to the clients of an OpenIGTLink server.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/bridge/igtl/igtl_messages.hpp"
#include "daemon/bridge/igtl/igtl_server.hpp"
#include "daemon/bridge/live/surface_subscriber.hpp"

namespace perimap {

// A surface is there for as long as it may be used: an invalid one, one whose valid_until has passed and none at all
// leave an empty POLYDATA, and a STATUS that says why.
class IgtlBridge {
 public:
  // For a person at the terminal; any thread.
  using Say = std::function<void(const std::string&)>;

  // Joins the domain. The server must outlive this.
  [[nodiscard]] static Expected<std::unique_ptr<IgtlBridge>> create(const dds::Membership& membership,
                                                                    IgtlServer& server, Say say);
  IgtlBridge(const IgtlBridge&) = delete;
  IgtlBridge& operator=(const IgtlBridge&) = delete;
  ~IgtlBridge() = default;

  // Until the descriptor becomes readable (a StopSignal's). Fails when DDS ended by itself.
  [[nodiscard]] Expected<void> run(int stop_descriptor);

 private:
  IgtlBridge(int domain, IgtlServer& server, Say say) : domain_(domain), server_(server), say_(std::move(say)) {}

  // All of the server's thread.
  struct Told {
    IgtlOutgoing surface;
    std::optional<IgtlOutgoing> camera;
    IgtlOutgoing tools, tool_words;
    bool has_tools = false;
    IgtlState surface_state, camera_state;
    Instant until;  // after that it may not be shown
  };
  [[nodiscard]] static Told told_of(const ShownSurface& surface);
  void tell(const Told& told);
  void tell_tools(const IgtlOutgoing& tips, const IgtlOutgoing& words, bool any);
  void tell_states(const IgtlState& surface, const IgtlState& camera);
  void clear(const IgtlState& why);
  void nobody();
  void silent();

  const int domain_;
  IgtlServer& server_;
  const Say say_;
  std::optional<IgtlState> surface_state_, camera_state_;  // as sent last
  bool heard_ = false;                                     // a surface, ever
  bool had_tools_ = false;                                 // ever: who has none is told nothing of any
  bool silent_ = false;
  bool failed_ = false;
  std::unique_ptr<SurfaceSubscriber> subscriber_;  // last: its thread uses the others
};

}  // namespace perimap

// What is published, to programs of ROS 2.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/bridge/live/surface_subscriber.hpp"
#include "daemon/bridge/ros2/ros2_messages.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/writer.hpp"

namespace perimap {

// ROS 2 without ROS: its messages on its topics, by a participant of our own in its domain. A surface is there for as
// long as it may be used: an invalid one, one whose valid_until has passed and none at all leave no point, no mesh and
// no tool, and diagnostics that say why.
class Ros2Bridge {
 public:
  // For a person at the terminal; any thread.
  using Say = std::function<void(const std::string&)>;

  // Joins both domains.
  [[nodiscard]] static Expected<std::unique_ptr<Ros2Bridge>> create(const dds::Membership& membership, int ros_domain,
                                                                    Say say);
  Ros2Bridge(const Ros2Bridge&) = delete;
  Ros2Bridge& operator=(const Ros2Bridge&) = delete;
  ~Ros2Bridge() = default;

  // Until the descriptor becomes readable (a StopSignal's). Fails when DDS ended by itself.
  [[nodiscard]] Expected<void> run(int stop_descriptor);

 private:
  struct Writers {
    dds::Participant participant;
    dds::UntypedWriter points, mesh, tools, transforms, diagnostics;
  };

  Ros2Bridge(int domain, Writers writers, Say say)
      : domain_(domain), writers_(std::move(writers)), say_(std::move(say)) {
    nothing_.frame_id = "tracker";
  }

  // Each of them with the lock.
  void tell(const ShownSurface& surface);
  void clear(Ros2Level level, std::string_view words);
  void diagnose(const ShownSurface& surface, Ros2Level level, const std::string& words);
  void look_at_the_clock(Instant now);
  void write(dds::UntypedWriter& writer, const void* message, const char* topic);

  const int domain_;
  const Instant begun_ = MonotonicClock::now();
  std::mutex mutex_;  // of all that follows: surfaces come on the subscriber's thread, silence is seen on another
  Writers writers_;
  const Say say_;
  Ros2Messages messages_;
  ShownSurface nothing_;  // of the last source and frame
  Instant transformed_;   // the last capture whose camera was told
  std::optional<Ros2Level> level_;
  std::string words_;                  // of the last diagnostics
  std::vector<Ros2ToolStatus> tools_;  // likewise
  Instant diagnosed_;
  Instant until_;    // what was sent may be used; the clock's epoch: nothing has come
  Instant cleared_;  // when it was said last that nothing comes
  bool silent_ = false;
  bool nobody_ = false;
  bool failed_ = false;
  bool unwritten_ = false;                         // said that a message could not be written
  std::unique_ptr<SurfaceSubscriber> subscriber_;  // last: its thread uses the others
};

}  // namespace perimap

// What pushes sensor data into the pipeline's entrance: devices, or a recording.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/runtime/thread_launcher.hpp"

namespace perimap {

class ToolTeller;

class SensorFeeder {
 public:
  virtual ~SensorFeeder() = default;

  // Before start(): what takes the readings of tools whose distance is told; null where there are none. It must outlive
  // stop().
  virtual void give_tools_to(ToolTeller* /*tools*/) {}

  // `threads` must outlive stop().
  virtual void start(ThreadLauncher& threads) = 0;
  // Ends and joins its threads; called twice it does nothing.
  virtual void stop() = 0;
  // About ten times a second, on the thread that waits for the session's end.
  virtual void tick() {}

  // On the status thread: what the devices' drivers know, into the status.
  virtual void describe(StatusFacts& /*facts*/) const {}

  // On the control thread: begins to record what the devices give, or ends the recording; what came of it, in words.
  [[nodiscard]] virtual Expected<std::string> record(bool /*on*/) {
    return fail("there are no devices to record: what runs is a recording");
  }

  // Nothing more will come. Devices never end.
  [[nodiscard]] virtual bool ended() const noexcept = 0;
  // Why it ended early, and what was damaged in a recording; to be asked after ended().
  [[nodiscard]] virtual const std::optional<Error>& error() const noexcept = 0;
  [[nodiscard]] virtual std::vector<Error> damage() const = 0;
};

}  // namespace perimap

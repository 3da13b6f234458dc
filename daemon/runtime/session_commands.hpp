// What a running session does when it is told to (perimap ctl).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/control/control_request.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/wire_status.hpp"

namespace perimap {

class Pipeline;

// Used by the thread that takes the commands.
class SessionCommands {
 public:
  // `pipeline` must outlive it and run. `facts` tells what the status says beside the counters; `reload` reads the
  // configuration again and says what came of it; `record` begins or ends a recording; `on_new_patient` is called when
  // the old patient's map is to go, with how many maps were forgotten before: it may take the pipeline a while.
  SessionCommands(Pipeline& pipeline, const Identity& identity, std::function<StatusFacts()> facts,
                  std::function<Expected<std::string>()> reload, std::function<Expected<std::string>(bool)> record,
                  std::function<void(std::uint64_t)> on_new_patient);

  [[nodiscard]] Expected<std::string> answer(ControlCommand command);

 private:
  [[nodiscard]] std::string tell_status();
  [[nodiscard]] Expected<std::string> forget_patient();
  [[nodiscard]] Expected<std::string> move_map();

  Pipeline& pipeline_;
  std::vector<WireStatus> statuses_;  // of the streams that are published
  std::function<StatusFacts()> facts_;
  std::function<Expected<std::string>()> reload_;
  std::function<Expected<std::string>(bool)> record_;
  std::function<void(std::uint64_t)> on_new_patient_;
};

}  // namespace perimap

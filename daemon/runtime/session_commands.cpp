#include "daemon/runtime/session_commands.hpp"

#include <thread>
#include <utility>

#include "daemon/publishing/status_text.hpp"

namespace perimap {
namespace {

constexpr Duration kMapperPatience = std::chrono::seconds(2);

}  // namespace

SessionCommands::SessionCommands(Pipeline& pipeline, const Identity& identity, std::function<StatusFacts()> facts,
                                 std::function<Expected<std::string>()> reload,
                                 std::function<Expected<std::string>(bool)> record, std::function<void()> on_forgotten)
    : pipeline_(pipeline),
      status_(identity),
      facts_(std::move(facts)),
      reload_(std::move(reload)),
      record_(std::move(record)),
      on_forgotten_(std::move(on_forgotten)) {}

Expected<std::string> SessionCommands::answer(ControlCommand command) {
  switch (command) {
    case ControlCommand::kStatus:
      return full_status_json(status_.fill(pipeline_.counters(), facts_(), MonotonicClock::now())).dump() + "\n";
    case ControlCommand::kNewPatient:
      return forget_patient();
    case ControlCommand::kRecordOn:
    case ControlCommand::kRecordOff:
      return record_(command == ControlCommand::kRecordOn);
    case ControlCommand::kReload:
      return reload_();
  }
  return fail("an unknown command");
}

// Said to be done only when it is: until then the old patient's surface is published.
Expected<std::string> SessionCommands::forget_patient() {
  const std::uint64_t before = pipeline_.counters().maps_forgotten.get();
  pipeline_.ask_to_forget();
  const Instant until = MonotonicClock::now() + kMapperPatience;
  while (pipeline_.counters().maps_forgotten.get() == before) {
    if (MonotonicClock::now() > until) return fail("the mapper does not answer: the map is not cleared yet");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  on_forgotten_();
  return "the map is cleared\n";
}

}  // namespace perimap

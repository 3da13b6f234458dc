#include "daemon/runtime/session_commands.hpp"

#include <fmt/format.h>

#include <thread>
#include <utility>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "daemon/publishing/status_text.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

constexpr Duration kMapperPatience = std::chrono::seconds(2);

}  // namespace

SessionCommands::SessionCommands(Pipeline& pipeline, const Identity& identity, std::function<StatusFacts()> facts,
                                 std::function<Expected<std::string>()> reload,
                                 std::function<Expected<std::string>(bool)> record,
                                 std::function<void(std::uint64_t)> on_new_patient)
    : pipeline_(pipeline),
      statuses_(wire_statuses(identity, pipeline.settings())),
      facts_(std::move(facts)),
      reload_(std::move(reload)),
      record_(std::move(record)),
      on_new_patient_(std::move(on_new_patient)) {}

Expected<std::string> SessionCommands::answer(ControlCommand command) {
  switch (command) {
    case ControlCommand::kStatus:
      return tell_status();
    case ControlCommand::kNewPatient:
      return forget_patient();
    case ControlCommand::kOrganMoved:
      return move_map();
    case ControlCommand::kRecordOn:
    case ControlCommand::kRecordOff:
      return record_(command == ControlCommand::kRecordOn);
    case ControlCommand::kReload:
      return reload_();
  }
  return fail("an unknown command");
}

// The first stream's status, and what the others have of their own.
std::string SessionCommands::tell_status() {
  const StatusFacts facts = facts_();
  const Instant now = MonotonicClock::now();
  nlohmann::ordered_json told;
  for (WireStatus& status : statuses_) {
    const perimap_Status& wire = status.fill(pipeline_.counters(), facts, now);
    if (told.is_null()) told = full_status_json(wire);
    told["streams"][wire.stream] = stream_status_json(wire);
  }
  return json_line(told) + "\n";
}

// Said to be done only when it is: until then the old patient's surface is published.
Expected<std::string> SessionCommands::forget_patient() {
  const std::uint64_t before = pipeline_.counters().maps_forgotten.get();
  pipeline_.ask_to_forget();
  on_new_patient_(before);
  const Instant until = MonotonicClock::now() + kMapperPatience;
  while (pipeline_.counters().maps_forgotten.get() == before) {
    if (MonotonicClock::now() > until) return fail("the mapper does not answer: the map is not cleared yet");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return "the map is cleared\n";
}

// Said to be done only when it is: until then surfaces are where the organ was.
Expected<std::string> SessionCommands::move_map() {
  const PipelineCounters& counters = pipeline_.counters();
  if (counters.displaced.get() == 0) return fail("the images show the organ where it is mapped: nothing was moved");
  const std::uint64_t before = counters.maps_moved.get();
  const std::uint64_t refused = counters.moves_refused.get();
  pipeline_.ask_to_move_map();
  const Instant until = MonotonicClock::now() + kMapperPatience;
  while (counters.maps_moved.get() == before) {
    if (counters.moves_refused.get() != refused) {
      return fail(
          "the organ does not rest, or is not seen well enough: hold the scope on it for some seconds, and ask again");
    }
    // One that is being done is waited for.
    if (MonotonicClock::now() > until && pipeline_.take_back_move()) {
      return fail("the mapper does not answer: the map is not moved");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return fmt::format("the map is moved with the organ, by {:.1f} mm\n",
                     1e-3 * static_cast<double>(counters.moved_um.get()));
}

}  // namespace perimap

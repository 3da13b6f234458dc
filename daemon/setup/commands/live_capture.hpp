// Calibrations from live devices: what they give is recorded while the user is told what is missing, and then measured
// as from any recording.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/command_line/console.hpp"
#include "daemon/command_line/outcome.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/live_guide.hpp"

namespace perimap {

class Command;
struct LiveOptions {
  std::string configuration;  // empty: not live
  double longest_s = 120.0;
  std::string keep;           // where the recording stays; empty: it is taken away
  bool unregistered = false;  // poses are recorded as without the configuration's registration, which is to be measured
};

// --live, --seconds and --keep.
void add_live(Command& command, LiveOptions& options);

// For a board; with the lens, where it is known, it tells what is left over by now. One that guides nobody when the
// options are not live. `configuration`: as lens_of() takes it.
[[nodiscard]] SetupExpected<std::unique_ptr<LiveGuide>> live_board_guide(const LiveOptions& options,
                                                                         const RecordedOptions& recorded,
                                                                         const std::string& configuration,
                                                                         double least_s);

// The recording of a capture; taken away with it, unless it is to be kept.
class LiveRecording {
 public:
  explicit LiveRecording(std::filesystem::path file, bool kept) : file_(std::move(file)), kept_(kept) {}
  LiveRecording(LiveRecording&& other) noexcept : file_(std::move(other.file_)), kept_(other.kept_) {
    other.kept_ = true;
  }
  LiveRecording& operator=(LiveRecording&&) = delete;
  LiveRecording(const LiveRecording&) = delete;
  LiveRecording& operator=(const LiveRecording&) = delete;
  ~LiveRecording();

  [[nodiscard]] std::string file() const { return file_.string(); }

 private:
  std::filesystem::path file_;
  bool kept_;
};

// Records what the configuration's devices give until the guide has enough, the longest time is over, or a signal
// comes. `tool`: whose poses the guide follows. Fails when the configuration names no such device, or nothing comes.
[[nodiscard]] SetupExpected<LiveRecording> record_live(const LiveOptions& options, const std::string& tool,
                                                       LiveGuide& guide, const Console& console);

// Does `measure` with the recording that --from names or, live, that is made now: `recording` is then that. In what is
// told of one that is taken away again the configuration's name stands for it.
[[nodiscard]] Outcome with_recording(const LiveOptions& options, const std::string& tool, LiveGuide& guide,
                                     const Console& console, std::string& recording,
                                     const std::function<Outcome()>& measure);

}  // namespace perimap

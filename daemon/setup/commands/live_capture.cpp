#include "daemon/setup/commands/live_capture.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <utility>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/status_line.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/setup/commands/guidance_writer.hpp"

namespace perimap {
namespace {

// A line on a terminal, or one every five seconds elsewhere.
class Lines {
 public:
  explicit Lines(const Console& console) : line_(console) {}
  void show(double elapsed_s, const std::string& line) {
    if (!line_.on_terminal() && elapsed_s < next_s_) return;
    line_.show(fmt::format("{:.0f} s: {}", elapsed_s, line));
    constexpr double kEvery_s = 5.0;
    next_s_ = elapsed_s + kEvery_s;
  }

 private:
  StatusLine line_;
  double next_s_ = 0.0;
};

// For pages. What does not work is said once, and hinders no calibration.
class Guidance {
 public:
  Guidance(const LiveOptions& options, const Console& console) : options_(options), console_(console) {}

  void tell(const LiveMoment& moment) {
    // Not before the recording has begun: the threads of DDS must not get the signals that it waits for.
    if (!std::exchange(begun_, true)) begin();
    if (writer_) check(writer_->tell(moment));
  }
  void recorded() {
    if (writer_) check(writer_->recorded());
  }

 private:
  void begin() {
    // The recording has loaded it, too.
    const auto configuration = load_configuration(options_.configuration, {}, NamedFiles::kMayBeMissing);
    if (!configuration) return;
    constexpr std::string_view kProgram = "perimap ";
    std::string what = console_.name();
    if (what.starts_with(kProgram)) what.erase(0, kProgram.size());
    auto writer = GuidanceWriter::create({configuration->dds.domain, configuration->dds.security}, std::move(what),
                                         options_.longest_s);
    if (writer) {
      writer_.emplace(std::move(*writer));
    } else {
      complain(writer.error());
    }
  }
  void check(const Expected<void>& written) {
    if (written) return;
    complain(written.error());
    writer_.reset();
  }
  void complain(const Error& error) { console_.complain("perimap view is told nothing of this: " + error.message); }

  const LiveOptions& options_;
  const Console& console_;
  bool begun_ = false;
  std::optional<GuidanceWriter> writer_;
};

SetupExpected<LiveRecording> told_while_recording(const LiveOptions& options, const std::string& tool, LiveGuide& guide,
                                                  const Console& console) {
  Lines lines(console);
  Guidance guidance(options, console);
  auto recording = record_live(options, tool, guide, [&](const LiveMoment& moment) {
    lines.show(moment.elapsed_s, moment.line);
    guidance.tell(moment);
  });
  if (recording) guidance.recorded();
  return recording;
}

}  // namespace

void add_live(Command& command, LiveOptions& options) {
  command.add_option("--live", options.configuration,
                     "The devices of this configuration (TOML) in place of files: they are recorded, and you are told "
                     "what is missing");
  command.add_option("--seconds", options.longest_s, "With --live: for so long at most")
      ->check(Range(5.0, 3600.0))
      ->capture_default_str();
  command.add_option("--keep", options.keep,
                     "With --live: where the recording stays; it must not be there yet [nowhere]");
}

SetupExpected<std::unique_ptr<LiveGuide>> live_board_guide(const LiveOptions& options, const RecordedOptions& recorded,
                                                           const std::string& configuration, double least_s) {
  const auto source = source_of(recorded, configuration);
  if (!source) return tl::unexpected(source.error());
  std::optional<KnownLens> known;
  if (!options.configuration.empty()) {
    if (auto lens = lens_of(*source)) known = *std::move(lens);
  }
  return board_guide(source->board, std::move(known), least_s);
}

Outcome with_recording(const LiveOptions& options, const std::string& tool, LiveGuide& guide, const Console& console,
                       std::string& recording, const std::function<Outcome()>& measure) {
  if (options.configuration.empty()) return measure();
  if (!recording.empty()) return refuse("--live and --from: expected one of them", ExitCode::kWrongUsage);
  const auto recorded = told_while_recording(options, tool, guide, console);
  if (!recorded) return refuse(recorded.error());
  if (!guide.enough()) console.complain("ended before there was enough of everything: " + guide.line());
  recording = recorded->file();
  Outcome measured = measure();
  if (!measured && options.keep.empty()) {
    std::string& told = measured.error().error.message;
    for (auto at = told.find(recording); at != std::string::npos; at = told.find(recording)) {
      told.replace(at, recording.size(), options.configuration);
    }
  }
  return measured;
}

}  // namespace perimap

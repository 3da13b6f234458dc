// `perimap session`: what could be trusted when, by what perimapd said of itself.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/evaluation/session/session_page.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

struct SessionOptions {
  SessionFiles files;
  std::string page;
};

// Beside what was published, under a name that no other command gives.
std::string page_beside(const SessionFiles& files) {
  std::filesystem::path page = files.published.empty() ? files.recording : files.published;
  return page.replace_extension(".session.html");
}

Outcome session(const SessionOptions& options) {
  const Output page{"--html", options.page.empty() ? page_beside(options.files) : options.page};
  const auto usable = check_apart(
      {page}, {{"a file that is read", options.files.recording}, {"a file that is read", options.files.published}});
  if (!usable) return refuse(usable.error(), ExitCode::kWrongUsage);
  if (auto able = check_writable({page}); !able) return refuse(able.error());
  const auto record = read_session(options.files);
  if (!record) return refuse(record.error());
  if (auto written = write_text_file(page.file, session_page(*record)); !written) return refuse(written.error());
  fmt::print("{}\n{}\n", session_answer(*record), session_verdict(*record));
  for (const std::string& concern : session_concerns(*record)) fmt::print("- {}\n", concern);
  fmt::print("page        {}\n", page.file);
  return {};
}

}  // namespace

void add_session_command(Commands& commands) {
  const auto options = std::make_shared<SessionOptions>();
  Command& command =
      commands.add("session", "Tell on one HTML page what could be trusted when, of any recording with surfaces",
                   [options](const Console&) { return session(*options); });
  command
      .add_option("RECORDING", options->files.recording,
                  "A recording (MCAP): of what was published (perimap watch --record, perimap replay --samples), or of "
                  "the devices, with --samples")
      ->required();
  command.add_option("--samples", options->files.published, "What was published, where that is a file of its own");
  command.add_option(
      "--html", options->page,
      "Write the page to this file; without it beside the file that has the surfaces, with the ending .session.html");
  command.add_option("--source", options->files.source, "Which perimapd, where there are several");
  command.add_option("--stream", options->files.stream, "Which stream, where there are several: frame or clock");
}

}  // namespace perimap

// `perimap forget`: recordings, checkpoints and segments of a black box that are older than they may be kept.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/retention/old_files.hpp"

namespace perimap {
namespace {

struct ForgetOptions {
  std::vector<std::string> folders;
  std::string older_than;
  bool dry = false;
};

Outcome forget(const ForgetOptions& options, const Console& console) {
  const auto age = parse_age(options.older_than);
  if (!age) return refuse(Error{"--older-than: " + age.error().message}, ExitCode::kWrongUsage);
  const Forgotten forgotten = forget_old(
      options.folders, *age, options.dry,
      [&](const OldFile& file) {
        fmt::print("{}{} ({:.1f} MB, {} days old)\n", options.dry ? "would remove " : "removed ", file.path.string(),
                   static_cast<double>(file.bytes) / 1e6,
                   std::chrono::duration_cast<std::chrono::days>(file.age).count());
      },
      [&](const Error& error) { console.complain(error); });
  fmt::print("{} files, {:.1f} MB{}\n", forgotten.files, static_cast<double>(forgotten.bytes) / 1e6,
             options.dry ? " would be removed" : "");
  if (forgotten.failed) return refuse("");
  return {};
}

}  // namespace

void add_forget_command(Commands& commands) {
  const auto options = std::make_shared<ForgetOptions>();
  Command& command = commands.add("forget",
                                  "Removes recordings, checkpoints and segments of a black box that have not been "
                                  "written for so long: what is known of patients",
                                  [options](const Console& console) { return forget(*options, console); });
  command
      .add_option("FOLDER", options->folders,
                  "Where they are, as recording.folder and blackbox.folder have it; not the folders in it. Every MCAP "
                  "file counts as a "
                  "recording, a ROS bag too")
      ->required();
  command.add_option("--older-than", options->older_than, "As 30d (days), 12h (hours) or 8w (weeks)")->required();
  command.add_flag("--dry-run", options->dry, "Only tell what would go");
}

}  // namespace perimap

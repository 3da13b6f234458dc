// `perimap track`: features followed through a video by their looks alone.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/evaluation/tracking/followed_video.hpp"
#include "daemon/process/stop_signal.hpp"

namespace perimap {
namespace {

Outcome track(const FollowSettings& settings, const Console& console) {
  const Output table{"--csv", settings.table};
  const Output video{"--video", settings.video};
  if (auto apart = check_apart({table, video}, {{"INPUT itself", settings.input}}); !apart) {
    return refuse(apart.error(), ExitCode::kWrongUsage);
  }
  if (auto able = check_writable({table, video}); !able) return refuse(able.error());
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  std::optional<Progress> progress;
  const auto summary = follow_features(settings, *stop, [&](std::uint64_t frames, std::uint64_t all) {
    if (all == 0) return;
    if (!progress) progress.emplace(console, "frames", all);
    progress->update(frames);
  });
  progress.reset();
  if (!summary) return refuse(summary.error());
  for (const Error& damage : summary->damage) console.complain(damage);
  for (const std::string& warning : warnings(*summary, settings)) console.complain(warning);
  fmt::print("{}", to_text(*summary, settings));
  if (summary->broken) return refuse(*summary->broken);
  return {};
}

}  // namespace

void add_track_command(Commands& commands) {
  const auto settings = std::make_shared<FollowSettings>();
  Command& command = commands.add(
      "track", "Follow features through a video or the frames of a recording by their looks alone, without map or pose",
      [settings](const Console& console) { return track(*settings, console); });
  command.add_option("INPUT", settings->input, "A video file, or a recording (MCAP)")->required();
  command
      .add_option(
          "--csv", settings->table,
          "Where to write the tracks: frame,id,x,y,state; a row a feature a frame in which it is found. Frames\n"
          "count from 0, pixels from the centre of the first; states are candidate and tracked. A candidate that is\n"
          "never tracked has no rows")
      ->required();
  command.add_option("--video", settings->video, "Where to write the frames with their features marked (.mkv, .avi)");
  command.add_option("--features", settings->features, "How many are kept followed")
      ->check(Range(1, 5000))
      ->capture_default_str();
  command.add_flag("--no-new-features", settings->first_features_alone,
                   "Only those found in the first frame that shows any");
  command.footer(
      "Prediction: each feature by its own velocity; where that fails by the motion of the features around it; where\n"
      "most fail at once, a wide search. A recording's tracker and ECG are not used. What stands still while the\n"
      "camera moves (text, a logo) is let go.\n"
      "Exit codes: 0 done, 1 failed, 2 wrong usage.");
}

}  // namespace perimap

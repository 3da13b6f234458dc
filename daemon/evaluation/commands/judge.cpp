// `perimap judge`: the visual front end over footage of which no truth is known, beside Lucas-Kanade.
#include <fmt/format.h>

#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/evaluation/track_judge/clip.hpp"
#include "daemon/evaluation/track_judge/contest.hpp"
#include "daemon/evaluation/track_judge/disturbance_trial.hpp"
#include "daemon/evaluation/track_judge/judge_text.hpp"
#include "daemon/evaluation/track_judge/track_picture.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

struct JudgeOptions {
  std::string input;
  std::string picture;
  int features = 131;
  std::size_t first = 0;
  std::size_t frames = 100;
  bool events = false;
  bool json = false;
};

Outcome judge(const JudgeOptions& options) {
  const Output picture{"--picture", options.picture};
  if (auto apart = check_apart({picture}, {{"VIDEO itself", options.input}}); !apart) {
    return refuse(apart.error(), ExitCode::kWrongUsage);
  }
  if (auto able = check_writable({picture}); !able) return refuse(able.error());
  const auto clip = Clip::read(options.input, options.first, options.frames);
  if (!clip) return refuse(clip.error());
  if (options.events) {
    const auto figures = try_disturbances(*clip, options.features);
    if (!figures) return refuse(fmt::format("{}: {}", options.input, figures.error().message));
    fmt::print("{}", options.json ? json_document(to_json(*figures)) : to_text(*figures));
    return {};
  }
  const auto contest = hold_contest(*clip, options.features);
  if (!contest) return refuse(contest.error());
  if (!options.picture.empty()) {
    if (const auto drawn = draw_contest(*contest, *clip, options.picture); !drawn) return refuse(drawn.error());
  }
  fmt::print("{}", options.json ? json_document(to_json(*contest, *clip)) : to_text(*contest, *clip));
  return {};
}

}  // namespace

void add_judge_command(Commands& commands) {
  const auto options = std::make_shared<JudgeOptions>();
  Command& command = commands.add(
      "judge", "Follow features through a video played there and back, beside Lucas-Kanade, and count what comes back",
      [options](const Console& /*console*/) { return judge(*options); });
  command.add_option("VIDEO", options->input, "A video file")->required();
  command.add_option("--features", options->features, "How many each of the two begins with at most")
      ->check(Range(1, 5000))
      ->capture_default_str();
  command.add_option("--first", options->first, "The first frame, counted from 0")->capture_default_str();
  command.add_option("--frames", options->frames, "How many frames are played at most; all are held in memory")
      ->check(Range(2, 100000))
      ->capture_default_str();
  const Option* const picture = command.add_option(
      "--picture", options->picture,
      "Where to write the tracks over the first frame, as PNG: perimap's on the left, Lucas-Kanade's on\n"
      "the right; green right, yellow strayed at the turn, red elsewhere at the end, grey lost");
  command
      .add_flag("--events", options->events,
                "Instead, compose events on the clip, played there and back (blood, fog, a lens that is wiped, one\n"
                "that is withdrawn for 5 s and comes back elsewhere, a step of exposure), and count the features\n"
                "that are found again within 1 s of the picture's return, and those that are wrong by then; the\n"
                "tracks of the clip without the event are the truth")
      ->excludes(picture);
  command.add_flag("--json", options->json, "Print the figures as JSON");
  command.footer(
      "begun: in one of the first three frames. alive: found in the last one. right: alive, within 3 px of where it\n"
      "began and, at the turn, within 5 px of where Lucas-Kanade, started where it began, has it, if that still has "
      "it.\n"
      "off: alive and more than 5 px away. These lengths are at 1280 pixels of width. jumps: of more than 60 px.\n"
      "Lucas-Kanade is OpenCV's: corners of quality 0.01, 10 px apart, windows of 21 x 21, three levels above the\n"
      "first, in grey, and a way back that ends within 1 px.\n"
      "Exit codes: 0 done, 1 failed, 2 wrong usage.");
}

}  // namespace perimap

// This tracker and OpenCV's Lucas-Kanade over clips that are played there and back (daemon/evaluation/track_judge), a
// line a clip. Arguments: FEATURES, then VIDEO[:FIRST[:FRAMES]] each; `events` before them: events composed on the
// clips instead.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "daemon/evaluation/track_judge/clip.hpp"
#include "daemon/evaluation/track_judge/contest.hpp"
#include "daemon/evaluation/track_judge/disturbance_trial.hpp"
#include "daemon/evaluation/track_judge/judge_text.hpp"

namespace perimap::bench {
namespace {

bool run(const std::string& argument, int features, bool events) {
  std::string path = argument;
  std::size_t first = 0, frames = 1000;
  if (const auto colon = argument.find(':'); colon != std::string::npos) {
    path = argument.substr(0, colon);
    char* rest = nullptr;
    first = std::strtoul(argument.c_str() + colon + 1, &rest, 10);
    if (*rest == ':') frames = std::strtoul(rest + 1, nullptr, 10);
  }
  const auto clip = Clip::read(path, first, frames);
  if (!clip) {
    std::fprintf(stderr, "%s\n", clip.error().message.c_str());
    return false;
  }
  const auto slash = path.rfind('/');
  const std::string name = path.substr(slash == std::string::npos ? 0 : slash + 1);
  if (events) {
    const auto figures = try_disturbances(*clip, features);
    if (!figures) {
      std::fprintf(stderr, "%s: %s\n", name.c_str(), figures.error().message.c_str());
      return false;
    }
    std::printf("%s\n%s", name.c_str(), to_text(*figures).c_str());
    std::fflush(stdout);
    return true;
  }
  const auto contest = hold_contest(*clip, features);
  if (!contest) {
    std::fprintf(stderr, "%s\n", contest.error().message.c_str());
    return false;
  }
  const auto& a = contest->our_figures;
  const auto& b = contest->their_figures;
  const ContestGoals goals = goals_of(*contest);
  std::printf(
      "%-22.22s %4dx%-4d %3zu | %4zu %4zu %4zu %3zu %2zu %5.2f | %4zu %4zu %4zu %3zu %5.2f | goal %5.1f %s%s%s%s\n",
      name.c_str(), clip->width(), clip->height(), clip->frames(), a.begun, a.alive, a.right, a.off, a.jumps,
      a.median_px, b.begun, b.alive, b.right, b.off, b.median_px, goals.least_right, goals.is_right_enough ? "R" : "-",
      goals.is_begun_enough ? "B" : "-", goals.has_no_jumps ? "J" : "-", goals.is_seldom_off ? "O" : "-");
  std::fflush(stdout);
  return true;
}

}  // namespace
}  // namespace perimap::bench

int main(int argc, char** argv) {
  const bool events = argc > 1 && std::string(argv[1]) == "events";
  const int first = events ? 2 : 1;
  if (argc < first + 2) {
    std::fprintf(stderr, "footage_bench [events] FEATURES VIDEO[:FIRST[:FRAMES]]...\n");
    return 2;
  }
  if (!events) std::printf("%38s | ours: begun alive right off jumps median px | theirs\n", "");
  bool all = true;
  for (int i = first + 1; i < argc; ++i) all = perimap::bench::run(argv[i], std::atoi(argv[first]), events) && all;
  return all ? 0 : 1;
}

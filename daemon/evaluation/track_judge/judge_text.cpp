#include "daemon/evaluation/track_judge/judge_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace perimap {
namespace {

std::string row(const char* name, const TripFigures& figures) {
  return fmt::format("{:<14}{:>7}{:>7}{:>7}{:>7}{:>7}{:>11.2f}\n", name, figures.begun, figures.alive, figures.right,
                     figures.off, figures.jumps, figures.median_px);
}

const char* word(bool is_reached) { return is_reached ? "reached" : "missed"; }

nlohmann::json to_json(const TripFigures& figures) {
  return {{"begun", figures.begun}, {"alive", figures.alive}, {"right", figures.right},
          {"off", figures.off},     {"jumps", figures.jumps}, {"median_px", figures.median_px}};
}

}  // namespace

ContestGoals goals_of(const Contest& contest) {
  constexpr double kTimes = 1.5, kShare = 0.9, kMostOff = 0.03;
  const TripFigures& ours = contest.our_figures;
  const TripFigures& theirs = contest.their_figures;
  ContestGoals goals;
  goals.least_begun = kShare * static_cast<double>(theirs.begun);
  goals.least_right = std::min(kTimes * static_cast<double>(theirs.right), goals.least_begun);
  goals.most_off = kMostOff * static_cast<double>(ours.alive);
  goals.is_right_enough = static_cast<double>(ours.right) >= goals.least_right;
  goals.is_begun_enough = static_cast<double>(ours.begun) >= goals.least_begun;
  goals.has_no_jumps = ours.jumps == 0;
  goals.is_seldom_off = static_cast<double>(ours.off) <= goals.most_off;
  return goals;
}

std::string to_text(const Contest& contest, const Clip& clip) {
  const ContestGoals goals = goals_of(contest);
  std::string text = fmt::format("{} frames of {}x{}, there and back\n", clip.frames(), clip.width(), clip.height());
  text += fmt::format("{:<14}{:>7}{:>7}{:>7}{:>7}{:>7}{:>11}\n", "", "begun", "alive", "right", "off", "jumps",
                      "median px");
  text += row("perimap", contest.our_figures) + row("Lucas-Kanade", contest.their_figures);
  text +=
      fmt::format("right, at least {:.1f}: {}; begun, at least {:.1f}: {}; jumps, none: {}; off, at most {:.1f}: {}\n",
                  goals.least_right, word(goals.is_right_enough), goals.least_begun, word(goals.is_begun_enough),
                  word(goals.has_no_jumps), goals.most_off, word(goals.is_seldom_off));
  return text;
}

nlohmann::json to_json(const Contest& contest, const Clip& clip) {
  const ContestGoals goals = goals_of(contest);
  return {{"frames", clip.frames()},
          {"width", clip.width()},
          {"height", clip.height()},
          {"perimap", to_json(contest.our_figures)},
          {"lucas_kanade", to_json(contest.their_figures)},
          {"reached",
           {{"right", goals.is_right_enough},
            {"begun", goals.is_begun_enough},
            {"jumps", goals.has_no_jumps},
            {"off", goals.is_seldom_off}}}};
}

}  // namespace perimap

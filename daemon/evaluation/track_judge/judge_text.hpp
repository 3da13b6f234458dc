// What a contest comes to, for people and programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/evaluation/track_judge/clip.hpp"
#include "daemon/evaluation/track_judge/contest.hpp"

namespace perimap {

// As many right as one and a half times the other tracker's, or nine tenths of what that begins with where this is
// fewer; nine tenths of what it begins with begun; no jumps; at most 3 % of those alive off.
struct ContestGoals {
  double least_right = 0, least_begun = 0, most_off = 0;
  bool is_right_enough = false, is_begun_enough = false, has_no_jumps = false, is_seldom_off = false;
};
[[nodiscard]] ContestGoals goals_of(const Contest& contest);

[[nodiscard]] std::string to_text(const Contest& contest, const Clip& clip);
[[nodiscard]] nlohmann::json to_json(const Contest& contest, const Clip& clip);

}  // namespace perimap

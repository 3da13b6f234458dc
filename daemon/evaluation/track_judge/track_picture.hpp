// Tracks over the frame that they begin in, coloured by how far from their beginning they have ended.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "daemon/evaluation/track_judge/clip.hpp"
#include "daemon/evaluation/track_judge/contest.hpp"

namespace perimap {

// A PNG at `path`: ours on the left, the other tracker's on the right, each up to the turn. Green is right, yellow
// strayed at the turn, red elsewhere at the end, grey lost.
[[nodiscard]] Expected<void> draw_contest(const Contest& contest, const Clip& clip, const std::string& path);

}  // namespace perimap

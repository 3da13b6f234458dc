#include "daemon/evaluation/track_judge/contest.hpp"

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/following/confirmed_tracks.hpp"
#include "core/following/video_tracker.hpp"
#include "daemon/evaluation/track_judge/lucas_kanade.hpp"

namespace perimap {
namespace {

Expected<Tracks> follow_with_patches(const Clip& clip, int features) {
  VideoTracker tracker({.features = features, .first_features_alone = true, .frames_per_s = clip.frames_per_s()});
  ConfirmedTracks confirmed(tracker.frames_to_judge());
  Tracks tracks;
  const auto take = [&](std::span<const TrackRow> rows) {
    for (const TrackRow& row : rows) {
      Track& track = tracks[row.id];
      track.resize(clip.steps());
      track[row.frame] = row.px;
    }
  };
  for (std::size_t step = 0; step < clip.steps(); ++step) {
    const VideoFrame frame = clip.at(step);
    tracker.track_into(frame.grey);
    if (const auto filled = tracker.fill_up(frame.grey, frame.colour); !filled) return tl::unexpected(filled.error());
    take(confirmed.add(step, tracker.features()));
  }
  take(confirmed.finish());
  return tracks;
}

Expected<Tracks> follow_with_lucas_kanade(const Clip& clip, int features, LucasKanade& tracker) {
  const auto corners = tracker.corners(clip.luminance(0), features);
  if (!corners) return tl::unexpected(corners.error());
  std::vector<std::optional<Vector2d>> points(corners->begin(), corners->end());
  Tracks tracks;
  for (std::size_t step = 0; step < clip.steps(); ++step) {
    if (step > 0) {
      const auto followed = tracker.track_points(clip.luminance(step - 1), clip.luminance(step), points);
      if (!followed) return tl::unexpected(followed.error());
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      Track& track = tracks[static_cast<std::uint32_t>(k)];
      track.resize(clip.steps());
      track[step] = points[k];
    }
  }
  return tracks;
}

// Where Lucas-Kanade has at the turn what it was given where our tracks begin.
Expected<std::map<std::uint32_t, Vector2d>> reference_at_turn(const Clip& clip, const Tracks& tracks,
                                                              LucasKanade& tracker) {
  std::map<std::uint32_t, Vector2d> reference;
  for (std::size_t first = 0; first < TripLimits::kFirstFrames; ++first) {
    std::vector<std::uint32_t> ids;
    std::vector<std::optional<Vector2d>> points;
    for (const auto& [id, track] : tracks) {
      if (begin_of(track) != first) continue;
      ids.push_back(id);
      points.push_back(track[first]);
    }
    for (std::size_t step = first + 1; step <= clip.turn(); ++step) {
      const auto followed = tracker.track_points(clip.luminance(step - 1), clip.luminance(step), points);
      if (!followed) return tl::unexpected(followed.error());
    }
    for (std::size_t k = 0; k < ids.size(); ++k) {
      if (points[k]) reference.emplace(ids[k], *points[k]);
    }
  }
  return reference;
}

}  // namespace

Expected<Contest> hold_contest(const Clip& clip, int features) {
  auto tracker = LucasKanade::create();
  if (!tracker) return tl::unexpected(tracker.error());
  auto ours = follow_with_patches(clip, features);
  if (!ours) return tl::unexpected(ours.error());
  auto theirs = follow_with_lucas_kanade(clip, features, **tracker);
  if (!theirs) return tl::unexpected(theirs.error());
  const auto reference = reference_at_turn(clip, *ours, **tracker);
  if (!reference) return tl::unexpected(reference.error());
  Contest contest{*std::move(ours), *std::move(theirs), {}, {}};
  contest.our_figures = judge_round_trip(contest.ours, clip.turn(), clip.width(), *reference);
  contest.their_figures = judge_round_trip(contest.theirs, clip.turn(), clip.width(), {});
  return contest;
}

}  // namespace perimap

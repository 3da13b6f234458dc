// What is kept of one feature that is followed through video.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/following/followed_patch.hpp"
#include "core/geometry/pose.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

enum class FollowState : std::uint8_t {
  kEmpty,
  kCandidate,  // new: may be a highlight, an instrument, the rim of the view or what is laid over the picture
  kTracked,
  kOccluded,  // was tracked and is not found at present; its place is carried along with its neighbours
};

struct FollowedFeature {
  static constexpr std::size_t kTrail = 16;  // places kept, about a 30th of a second apart

  FollowState state = FollowState::kEmpty;
  std::uint32_t id = 0;
  bool found = false;                       // in the last frame
  bool was_found_at_once = false;           // in the last frame in which most were not: where it was expected
  Vector2d px = Vector2d::Zero();           // where it was found, else where it is expected
  Vector2d velocity_px = Vector2d::Zero();  // per frame
  FollowedPatch patch;
  PatchMatch match;                      // of the last frame
  Vector2d last_px = Vector2d::Zero();   // in the frame before
  Vector2d first_px = Vector2d::Zero();  // where it began, and in which frame
  std::uint64_t first_frame = 0;
  int frames = 0;        // found in
  int misses = 0;        // in a row
  int hidden = 0;        // of them, those in which its region showed no tissue
  bool is_away = false;  // missed for more than a moment
  int strange = 0;       // frames in which it moved otherwise than its neighbours, less those in which not
  Vector2d astray_px = Vector2d::Zero();  // how far it has lately gone another way than its neighbours
  double doubt_px = 0;                   // deviations of its matches and misses of the ways back, summed over its trial
  bool is_ripe = false;                  // a candidate that has stood its trial
  bool is_overlay = false;               // let go in the last frame because it is laid over the picture
  bool swept = false;                    // it vanished together with nearly all others
  int place = 0;                         // SeenPlaces' number of the picture that they vanished from
  bool is_recalled = false;              // it has come back with them in the last frame
  std::uint32_t layout = 0;              // PastLayouts' number of the one before it was lost; 0: none
  bool has_layout = false;               // that told in the last frame where it should be
  bool was_alone = false;                // it has come back without others: it tells nothing of where they should be
  int returning = 0;                     // frames for which it counts as having just come back
  int strays = 0;                        // how often it has gone astray and was taken back
  FollowedPatch::Places last_places;     // in the frame before: what is not believed is taken back
  std::array<Vector2d, kTrail> trail{};  // where it was, by the number of the place
  std::size_t trail_length = 0;

  // False for what has been away for more than a moment: another may take its place then.
  [[nodiscard]] bool fills_place() const noexcept;
  // Its place is free then.
  void let_go() noexcept;
};

}  // namespace perimap

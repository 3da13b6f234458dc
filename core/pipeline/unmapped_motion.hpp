// How fast a feature may go another way than it went.
#pragma once

namespace perimap {

// Image motion changes by about so much where no map predicts it (systole begins at up to 750 px/s at 640x480). In
// pixels at any width of the picture: at 30 frames/s the search region's radius is 37 px then, and 40 px about the
// prediction are all that a search sees (core/vision/patch_search). As a share of a wider picture's width it would
// ask for more than that.
inline constexpr double kUnmappedMotion_px_per_s = 300.0;

}  // namespace perimap

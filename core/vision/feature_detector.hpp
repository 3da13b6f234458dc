// Places worth following: corners spread evenly over the visible tissue.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/picture_light.hpp"

namespace perimap {

struct DetectorSettings {
  int tile_px = 40;             // each tile gives its best corner before any gives its second
  double min_distance_px = 14;  // between features, occupied ones included
  int border_px = 24;           // kept clear along the frame, so that coarse windows fit too
  double min_corner = 6.0;      // smaller eigenvalue of the mean gradient product, (grey levels / px)^2
  double min_roundness = 0;     // smaller over larger eigenvalue: an edge slides along itself
  int highlight_grey = 245;     // at or above: a specular highlight
  double highlight_clearance_px = 12;
  int background_grey = 18;  // mean over background_size_px below: no tissue, or none that is lit
  int background_size_px = 13;
  double background_clearance_px = 16;  // silhouettes slide over the tissue
  // Mean over a few pixels, at or below, and joined to the picture's border: the surround of a view that does not fill
  // the picture; -1 where it does. Its edge goes with the scope and stands out of all that is in the picture: what is
  // followed must not have it in its template.
  int surround_grey = -1;
  double surround_clearance_px = PatchTemplate::kReach + 2.0;
};

// For how_many features spread over an image of this size, this noise and this light, whatever they are. A corner must
// stand out of the noise, and no more: tissue without vessels has little texture. What a dim picture shows has less
// contrast, and less light is no background there.
[[nodiscard]] DetectorSettings detector_settings_for(int width, int height, double noise, int how_many,
                                                     const PictureLight& light = {}) noexcept;

// Likewise, of what this image shows.
[[nodiscard]] DetectorSettings detector_settings_for(const GreyImage& image, int how_many);

// Likewise, for corners that are tried before they are followed: whatever stands out of the noise at all, and lengths
// go with the picture's width.
[[nodiscard]] DetectorSettings detector_settings_for_trial(const GreyImage& image, int how_many);

// For the templates of what was found so.
[[nodiscard]] TemplateSettings template_settings_for(const DetectorSettings& settings) noexcept;

// Rows [begin, end) of an image; all of them as it stands.
struct RowRange {
  int begin = 0;
  int end = std::numeric_limits<int>::max();
};

// To look for features with a bounded amount of work at a time: in how many bands, of no more pixels than 640x480 has
// each, which rows the bands 0, 1, ... are, and which of them has a row.
[[nodiscard]] int bands_of(int width, int height) noexcept;
[[nodiscard]] RowRange rows_of_band(int height, int band, int bands) noexcept;
[[nodiscard]] int band_of_row(int height, int row, int bands) noexcept;

// Up to how_many new features, level-0 pixels (whole ones), none within min_distance_px of another or of occupied.
// `barred`, when it has the image's size, is not 0 where no feature may be (instruments); an empty one bars nothing.
// Features are found in `rows` alone, the same ones of a row whatever the others, but for distances and shares; no more
// of the image is read than those rows and what is within the border's and the clearances' reach of them.
// The same input gives the same output in the same order, best tiles' corners first. Allocates; meant for a thread
// without a deadline. An empty list when there is nothing to be found; an error for an unusable image or setting.
[[nodiscard]] Expected<std::vector<Vector2d>> find_features(const GreyImage& image, std::span<const Vector2d> occupied,
                                                            const DetectorSettings& settings, int how_many,
                                                            const GreyImage& barred = {}, RowRange rows = {});

}  // namespace perimap

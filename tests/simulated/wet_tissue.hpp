// A clip of beating tissue as a video camera gives it: weak texture, looks that change, highlights that wander, noise,
// compression. Where each point of it is in each frame is known.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

struct WetTissueSettings {
  int width = 360;
  int height = 288;
  double frames_per_s = 25;
  double beat_s = 0.72;     // from one beat to the next
  double beat_px = 9;       // the largest displacement in a beat
  double texture_grey = 7;  // standard deviation of the green channel's texture
  double sheen_grey = 3;    // of what lies over it and stays behind when it moves
  double noise_grey = 1.2;  // of a pixel, before compression
  double compression = 6;   // quantisation step of the 8 x 8 blocks' cosines, grey levels
  int highlights = 10;
  std::uint64_t seed = 1;
};

class WetTissue {
 public:
  explicit WetTissue(const WetTissueSettings& settings);

  // Frame `number` of an endless clip. What is returned is valid until the next call.
  struct Frame {
    GreyImage grey;  // the green channel
    ColourImage colour;
  };
  [[nodiscard]] Frame frame(int number);

  // Where in frame `number` the tissue is that frame `from` shows at px.
  [[nodiscard]] Vector2d moved(const Vector2d& px, int from, int number) const;

  // Whether a highlight is nearer than this to px there.
  [[nodiscard]] bool is_highlight(const Vector2d& px, int number, double within_px) const;

 private:
  struct Highlight {
    Vector2d at_px;
    double radius_px;
    double phase_rad;
  };
  [[nodiscard]] double displaced_by(int number) const;  // along field(), in beat_px
  [[nodiscard]] Vector2d field(const Vector2d& px) const;
  [[nodiscard]] Vector2d seen_at(const Vector2d& rest_px, int number) const;
  [[nodiscard]] Vector2d at_rest(const Vector2d& px, int number) const;
  [[nodiscard]] Vector2d place_of(const Highlight& highlight, int number) const;
  [[nodiscard]] std::pair<cv::Mat, cv::Mat> texture_places(int number) const;
  void compress(cv::Mat& channel) const;

  WetTissueSettings settings_;
  cv::Mat texture_, sheen_;
  std::vector<Highlight> highlights_;
  cv::Mat bgr_, green_;
};

}  // namespace perimap

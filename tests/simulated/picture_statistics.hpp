// What pictures look like, by what matters to whoever follows points in them: of footage and of simulated looks alike,
// so that these can be held against those.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "core/sensors/grey_image.hpp"

namespace perimap {

// Means over the pictures of a clip; medians within each. Highlights with what is beside them, and what is dark, are
// left out of all figures but those of highlights. Grey levels, pixels of the picture as it is given.
struct PictureStatistics {
  double lit_grey = 0;  // median of what is lit
  double spread = 0;    // of the grey levels between the 10th and the 90th hundredth, over lit_grey

  // Noise of a pixel (core/vision/image_noise), of all and by the level that it lies on.
  double noise = 0, noise_dim = 0, noise_bright = 0;  // up to 80 and above 120 grey levels

  double gradient = 0;          // root of the mean gradient energy, after a blur of 1 px, grey levels a px
  double fine_over_coarse = 0;  // that over the same after a blur of 3 px: small where the picture is blurred
  double blocks = 0;            // steps across borders of 8 x 8 blocks over those within them: 1 without compression

  // Of the strongest corner (smaller eigenvalue of the mean gradient product, 15 x 15, (grey levels a px)^2) in each
  // tile of a 16th of the width: quarter, middle and three quarters of the tiles.
  double corner_weak = 0, corner_middle = 0, corner_strong = 0;

  double highlights_percent = 0;  // of the picture
  double highlight_permille = 0;  // of the picture, the middle one's area; 0 without any
  double highlights = 0;          // how many
  double highlights_changed = 0;  // share of their pixels that is theirs in one of two neighbouring pictures alone
  double highlight_speed = 0;     // the middle one's, against the tissue around it, picture widths in 100 s

  // Of windows of 21 x 21 px that Lucas-Kanade follows there and back through a time: how far the light has changed,
  // and how well the window correlates with what it was (median, and what a tenth is below).
  static constexpr double kFollowed_s = 0.4;
  double gain_percent = 0;  // RMS of the gain's logarithm
  double bias_grey = 0;     // RMS of the mean's change
  double kept_correlation = 0, kept_correlation_tenth = 0;
  double followed = 0;  // share of the corners begun that is followed so long
  double speed = 0;     // the middle window's, picture widths in 100 s
};

// Every figure by its name, in the order of a table.
struct NamedStatistic {
  std::string_view name;
  double PictureStatistics::*value;
  int decimals;
};
[[nodiscard]] const std::vector<NamedStatistic>& named_statistics();

// Looks at one picture after the other, all of one size.
class PictureWatch {
 public:
  explicit PictureWatch(double frames_per_s) : frames_per_s_(frames_per_s) {}

  void look_at(const GreyImage& picture);
  // Of all pictures so far; those between pictures are 0 with fewer than two.
  [[nodiscard]] PictureStatistics statistics() const;

 private:
  struct Spot {
    cv::Point2d centre;
    int area;
  };
  void look_at_texture(const cv::Mat& picture, const cv::Mat& usable);
  void look_at_corners(const cv::Mat& gx, const cv::Mat& gy, const cv::Mat& usable);
  void look_at_highlights(const cv::Mat& picture, const cv::Mat& bright);
  void look_at_change(const cv::Mat& from, const cv::Mat& usable, const cv::Mat& to);
  [[nodiscard]] std::optional<cv::Point2d> tissue_flow_at(const cv::Point2d& place, const cv::Mat& from,
                                                          const cv::Mat& to) const;

  double frames_per_s_;
  std::vector<cv::Mat> pictures_;  // the last ones, of PictureStatistics::kFollowed_s and one more
  std::vector<cv::Mat> usable_;
  cv::Mat bright_before_;
  std::vector<Spot> spots_before_;
  std::vector<PictureStatistics> of_pictures_;
  // Of what there is only between pictures, one by one.
  std::vector<double> highlights_changed_, highlight_speed_, gain_, bias_, correlation_, speed_, followed_;
};

}  // namespace perimap

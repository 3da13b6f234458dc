#include "daemon/setup/camera_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

// Shown all over the picture and tilted, seven tell the focal length within 0.3 % (95 %).
constexpr std::size_t kFewestViews = 7;
constexpr std::size_t kFewestAlike = 4;  // a view that is off is told by the others
constexpr std::size_t kMostViews = 60;   // fitted; a view's cost grows with their square
constexpr int kIntrinsics = 9;           // fx fy cx cy and five coefficients, or four of a fisheye

struct Points {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> image;
};

struct Fit {
  cv::Mat K;
  cv::Mat d;
  std::vector<cv::Mat> rvecs;
  std::vector<cv::Mat> tvecs;
  bool k3_is_free = false;
};

struct Problem {
  cv::Size size;
  bool fisheye = false;
};

Fit fit_of(const Points& points, const Problem& problem, bool k3_is_free) {
  Fit fit;
  fit.k3_is_free = k3_is_free;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 1e-10);
  if (problem.fisheye) {
    cv::fisheye::calibrate(points.board, points.image, problem.size, fit.K, fit.d, fit.rvecs, fit.tvecs,
                           cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW, criteria);
  } else {
    // Its steps are solved by singular values where nothing else is said: of 60 views, of 369 unknowns, minutes.
    cv::calibrateCamera(points.board, points.image, problem.size, fit.K, fit.d, fit.rvecs, fit.tvecs,
                        cv::CALIB_USE_QR | (k3_is_free ? 0 : cv::CALIB_FIX_K3), criteria);
  }
  return fit;
}

// Residuals of a view, and their derivatives by the intrinsics and by the pose.
struct Linearised {
  std::vector<Vector2d> residuals;
  Eigen::MatrixXd by_intrinsics;  // 2n x 9
  Eigen::MatrixXd by_pose;        // 2n x 6
};

Eigen::MatrixXd block_of(const cv::Mat& J, int column, int columns) {
  Eigen::MatrixXd block(J.rows, columns);
  for (int i = 0; i < J.rows; ++i) {
    for (int j = 0; j < columns; ++j) block(i, j) = J.at<double>(i, column + j);
  }
  return block;
}

Linearised linearise(const Fit& fit, const Problem& problem, const std::vector<cv::Point3f>& board,
                     const std::vector<cv::Point2f>& image, const cv::Mat& rvec, const cv::Mat& tvec) {
  Linearised result;
  std::vector<cv::Point2f> projected;
  cv::Mat J;
  if (problem.fisheye) {
    // Columns: f, c, k1 to k4, rotation, translation, skew.
    cv::fisheye::projectPoints(board, projected, rvec, tvec, fit.K, fit.d, 0.0, J);
    result.by_intrinsics = Eigen::MatrixXd::Zero(J.rows, kIntrinsics);
    result.by_intrinsics.leftCols(8) = block_of(J, 0, 8);
    result.by_pose = block_of(J, 8, 6);
  } else {
    // Columns: rotation, translation, f, c, k1 k2 p1 p2 k3.
    cv::projectPoints(board, rvec, tvec, fit.K, fit.d, projected, J);
    result.by_pose = block_of(J, 0, 6);
    result.by_intrinsics = block_of(J, 6, kIntrinsics);
  }
  for (std::size_t i = 0; i < image.size(); ++i) {
    result.residuals.emplace_back(image[i].x - projected[i].x, image[i].y - projected[i].y);
  }
  return result;
}

double rms_of(const std::vector<Vector2d>& residuals) {
  double squares = 0.0;
  for (const Vector2d& r : residuals) squares += r.squaredNorm();
  return residuals.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(residuals.size()));
}

std::vector<std::vector<Vector2d>> residuals_of(const Fit& fit, const Problem& problem, const Points& points) {
  std::vector<std::vector<Vector2d>> residuals;
  for (std::size_t v = 0; v < points.board.size(); ++v) {
    residuals.push_back(
        linearise(fit, problem, points.board[v], points.image[v], fit.rvecs[v], fit.tvecs[v]).residuals);
  }
  return residuals;
}

struct Certainty {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(kIntrinsics, kIntrinsics);
  double variance_factor = 1.0;
};

// By the normal equations with each view's pose eliminated; widened where the views' own sums scatter more than
// independent residuals would let them (a sandwich estimate over views).
Certainty certainty_of(const Fit& fit, const Problem& problem, const Points& points) {
  std::vector<int> free{0, 1, 2, 3, 4, 5, 6, 7};
  if (!problem.fisheye && fit.k3_is_free) free.push_back(8);
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::VectorXd> scores;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t v = 0; v < points.board.size(); ++v) {
    const Linearised view = linearise(fit, problem, points.board[v], points.image[v], fit.rvecs[v], fit.tvecs[v]);
    Eigen::VectorXd r(2 * static_cast<Eigen::Index>(view.residuals.size()));
    for (std::size_t i = 0; i < view.residuals.size(); ++i)
      r.segment<2>(2 * static_cast<Eigen::Index>(i)) = view.residuals[i];
    const Eigen::MatrixXd Ji = view.by_intrinsics(Eigen::all, free);
    const Eigen::MatrixXd& Jp = view.by_pose;
    // What the pose can not take up.
    const Eigen::MatrixXd left = Ji - Jp * (Jp.transpose() * Jp).ldlt().solve(Jp.transpose() * Ji);
    S += left.transpose() * left;
    scores.emplace_back(left.transpose() * r);
    squares += r.squaredNorm(), count += static_cast<double>(r.size());
  }
  const double parameters = static_cast<double>(n) + 6.0 * static_cast<double>(points.board.size());
  const double variance = squares / std::max(1.0, count - parameters);
  const Eigen::MatrixXd inverse = S.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
  for (const Eigen::VectorXd& score : scores) scatter += score * score.transpose();
  const double views = static_cast<double>(scores.size());
  const Eigen::MatrixXd sandwich = views / std::max(1.0, views - 1.0) * (inverse * scatter * inverse);
  std::vector<double> ratios;
  for (Eigen::Index i = 0; i < n; ++i) ratios.push_back(sandwich(i, i) / (variance * inverse(i, i)));
  Certainty certainty;
  // The ratio of one parameter over so many views scatters by chance; what is within that is left alone.
  const double ratio = upper_median(ratios.begin(), ratios.end());
  if (ratio > 1.0 + 2.5 * std::sqrt(2.0 / views)) certainty.variance_factor = ratio;
  certainty.covariance(free, free) = certainty.variance_factor * variance * inverse;
  return certainty;
}

CameraModel model_of(const Fit& fit, const Problem& problem) {
  CameraModel camera;
  camera.width = problem.size.width;
  camera.height = problem.size.height;
  camera.fx = fit.K.at<double>(0, 0);
  camera.fy = fit.K.at<double>(1, 1);
  camera.cx = fit.K.at<double>(0, 2);
  camera.cy = fit.K.at<double>(1, 2);
  const auto d = [&](int i) { return fit.d.reshape(1, 1).at<double>(0, i); };
  camera.k1 = d(0), camera.k2 = d(1);
  if (problem.fisheye) {
    camera.lens = Lens::kKannalaBrandt;
    camera.k3 = d(2), camera.k4 = d(3);
  } else {
    camera.p1 = d(2), camera.p2 = d(3), camera.k3 = d(4);
  }
  return camera;
}

// Leaves out what is off by more than chance lets it be: four and a half robust deviations, never what is within half a
// pixel. Whether anything was.
bool leave_out(Points& points, const std::vector<std::vector<Vector2d>>& residuals, std::size_t& left_out) {
  std::vector<double> sizes;
  for (const auto& view : residuals) {
    for (const Vector2d& r : view) sizes.push_back(r.norm());
  }
  // The median of a Rayleigh distribution is 1.177 deviations of an axis.
  const double limit = std::max(0.5, 4.5 * upper_median(sizes.begin(), sizes.end()) / 1.177);
  bool changed = false;
  for (std::size_t v = 0; v < points.board.size(); ++v) {
    std::vector<cv::Point3f> board;
    std::vector<cv::Point2f> image;
    for (std::size_t i = 0; i < points.board[v].size(); ++i) {
      if (residuals[v][i].norm() > limit) continue;
      board.push_back(points.board[v][i]);
      image.push_back(points.image[v][i]);
    }
    constexpr std::size_t kFewest = 8;
    if (board.size() == points.board[v].size() || board.size() < kFewest) continue;
    left_out += points.board[v].size() - board.size();
    changed = true;
    points.board[v] = std::move(board);
    points.image[v] = std::move(image);
  }
  return changed;
}

// A view whose points are mostly wrong, by its RMS beside the others'.
std::vector<char> sound_views(const std::vector<std::vector<Vector2d>>& residuals) {
  std::vector<double> rms;
  for (const auto& view : residuals) rms.push_back(rms_of(view));
  std::vector<double> sorted = rms;
  const double limit = std::max(1.0, 4.0 * upper_median(sorted.begin(), sorted.end()));
  std::vector<char> sound;
  for (const double r : rms) sound.push_back(r <= limit ? 1 : 0);
  return sound;
}

Points of_views(const Points& all, const std::vector<std::size_t>& chosen) {
  Points points;
  for (const std::size_t v : chosen) {
    points.board.push_back(all.board[v]);
    points.image.push_back(all.image[v]);
  }
  return points;
}

// RMS over the views that the fit has not seen; each view's pose is its own.
double judge_views(const Fit& fit, const Problem& problem, const Points& points, double& count) {
  double squares = 0.0;
  for (std::size_t v = 0; v < points.board.size(); ++v) {
    cv::Mat rvec, tvec;
    std::vector<cv::Point2f> image = points.image[v];
    if (problem.fisheye) {
      cv::fisheye::undistortPoints(points.image[v], image, fit.K, fit.d, cv::noArray(), fit.K);
      if (!cv::solvePnP(points.board[v], image, fit.K, cv::noArray(), rvec, tvec)) continue;
    } else if (!cv::solvePnP(points.board[v], image, fit.K, fit.d, rvec, tvec)) {
      continue;
    }
    for (const Vector2d& r : linearise(fit, problem, points.board[v], points.image[v], rvec, tvec).residuals) {
      squares += r.squaredNorm(), count += 1.0;
    }
  }
  return squares;
}

double held_aside(const Points& points, const Problem& problem, bool k3_is_free) {
  constexpr std::size_t kParts = 5;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t part = 0; part < kParts; ++part) {
    std::vector<std::size_t> fitted;
    std::vector<std::size_t> held;
    for (std::size_t v = 0; v < points.board.size(); ++v) (v % kParts == part ? held : fitted).push_back(v);
    if (fitted.size() < 3 || held.empty()) continue;
    const Fit fit = fit_of(of_views(points, fitted), problem, k3_is_free);
    squares += judge_views(fit, problem, of_views(points, held), count);
  }
  return count > 0.0 ? std::sqrt(squares / count) : 0.0;
}

constexpr std::array<const char*, 9> kNinths{"upper left", "upper middle", "upper right",  "left",       "middle",
                                             "right",      "lower left",   "lower middle", "lower right"};

std::string missing_of(const std::array<int, 9>& coverage) {
  std::string missing;
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    if (coverage[i] == 0) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", kNinths[i]);
  }
  return missing.empty() ? "" : fmt::format("; nothing of the board was seen {}", missing);
}

Expected<void> check_certainty(const CameraCalibration& result, const CameraCalibrationSettings& settings) {
  const double focal = std::max(result.deviations[0] / result.camera.fx, result.deviations[1] / result.camera.fy);
  const double centre = std::max(result.deviations[2], result.deviations[3]) / result.camera.width;
  if (!(focal <= settings.largest_focal_deviation)) {
    return fail(fmt::format(
        "the focal length stays open by {:.1f} % (standard deviation): tilt the board by 30 degrees and more to all "
        "sides and take some ten pictures more{}",
        100.0 * focal, missing_of(result.coverage)));
  }
  if (!(centre <= settings.largest_centre_deviation)) {
    return fail(fmt::format(
        "the principal point stays open by {:.1f} px (standard deviation): tilt the board to all sides, turn it by 90 "
        "degrees, and fill the picture's edges{}",
        centre * result.camera.width, missing_of(result.coverage)));
  }
  return {};
}

void describe(CameraCalibration& result, const Fit& fit, const Problem& problem, const Points& points) {
  const Certainty certainty = certainty_of(fit, problem, points);
  result.camera = model_of(fit, problem);
  result.variance_factor = certainty.variance_factor;
  for (int i = 0; i < kIntrinsics; ++i) {
    result.deviations.push_back(std::sqrt(std::max(0.0, certainty.covariance(i, i))));
  }
  result.covariance = certainty.covariance;
  result.residuals_px = residuals_of(fit, problem, points);
  double squares = 0.0;
  for (std::size_t v = 0; v < points.image.size(); ++v) {
    std::vector<Vector2d> where;
    for (std::size_t i = 0; i < points.image[v].size(); ++i) {
      const cv::Point2f& p = points.image[v][i];
      where.emplace_back(p.x, p.y);
      const int column = std::clamp(static_cast<int>(3.0F * p.x / static_cast<float>(problem.size.width)), 0, 2);
      const int row = std::clamp(static_cast<int>(3.0F * p.y / static_cast<float>(problem.size.height)), 0, 2);
      ++result.coverage[static_cast<std::size_t>(3 * row + column)];
      squares += result.residuals_px[v][i].squaredNorm();
      ++result.points;
    }
    result.points_px.push_back(std::move(where));
  }
  result.rms_px = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, result.points)));
}

Pose pose_of(const cv::Mat& rvec, const cv::Mat& tvec) {
  const auto at = [](const cv::Mat& m, int i) { return m.reshape(1, 3).at<double>(i, 0); };
  return {so3_exp({at(rvec, 0), at(rvec, 1), at(rvec, 2)}), {at(tvec, 0), at(tvec, 1), at(tvec, 2)}};
}

Expected<CameraCalibration> calibrate(const std::vector<BoardView>& views, const Problem& problem,
                                      const CameraCalibrationSettings& settings) {
  CameraCalibration result;
  Points all;
  for (const BoardView& view : views) {
    std::vector<cv::Point3f> board;
    std::vector<cv::Point2f> image;
    for (std::size_t i = 0; i < view.px.size(); ++i) {
      board.emplace_back(static_cast<float>(view.board_mm[i].x()), static_cast<float>(view.board_mm[i].y()), 0.0F);
      image.emplace_back(static_cast<float>(view.px[i].x()), static_cast<float>(view.px[i].y()));
    }
    all.board.push_back(std::move(board));
    all.image.push_back(std::move(image));
    result.views.push_back({view.name, false, 0.0, {}});
  }
  std::vector<std::size_t> chosen;
  const std::size_t count = std::min(views.size(), kMostViews);
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(k * views.size() / count);
  Points points = of_views(all, chosen);
  Fit fit = fit_of(points, problem, false);
  for (int round = 0; round < 4; ++round) {
    const auto residuals = residuals_of(fit, problem, points);
    const std::vector<char> sound = sound_views(residuals);
    std::vector<std::size_t> kept;
    std::vector<std::size_t> places;
    for (std::size_t v = 0; v < sound.size(); ++v) {
      if (sound[v] != 0) kept.push_back(chosen[v]), places.push_back(v);
    }
    const bool views_fell = kept.size() < chosen.size() && kept.size() >= kFewestAlike;
    std::vector<std::vector<Vector2d>> of_kept = residuals;
    if (views_fell) {
      points = of_views(points, places);
      of_kept.clear();
      for (const std::size_t v : places) of_kept.push_back(residuals[v]);
      chosen = kept;
    }
    const bool points_fell = leave_out(points, of_kept, result.points_left_out);
    if (!views_fell && !points_fell) break;
    fit = fit_of(points, problem, false);
  }
  if (chosen.size() < kFewestViews) {
    return fail(fmt::format(
        "only {} of the {} views of the board that were tried fit together, and at least {} are needed, "
        "better 20: take more, sharp, with the board flat, tilted to all sides and in all parts of the picture",
        chosen.size(), count, kFewestViews));
  }
  if (!problem.fisheye) {
    Fit richer = fit_of(points, problem, true);
    const Certainty certainty = certainty_of(richer, problem, points);
    const double k3 = richer.d.reshape(1, 1).at<double>(0, 4);
    if (std::abs(k3) > 3.0 * std::sqrt(certainty.covariance(8, 8))) fit = std::move(richer);
  }
  describe(result, fit, problem, points);
  double squares = 0.0;
  double all_count = 0.0;
  for (std::size_t v = 0; v < chosen.size(); ++v) {
    ViewResult& view = result.views[chosen[v]];
    view.used = true;
    view.rms_px = rms_of(result.residuals_px[v]);
    view.X_CB = pose_of(fit.rvecs[v], fit.tvecs[v]);
    const auto whole = linearise(fit, problem, all.board[chosen[v]], all.image[chosen[v]], fit.rvecs[v], fit.tvecs[v]);
    for (const Vector2d& r : whole.residuals) squares += r.squaredNorm(), all_count += 1.0;
  }
  result.rms_all_px = std::sqrt(squares / std::max(1.0, all_count));
  result.held_aside_rms_px = held_aside(points, problem, fit.k3_is_free);
  if (const auto certain = check_certainty(result, settings); !certain) return tl::unexpected(certain.error());
  return result;
}

}  // namespace

Expected<CameraCalibration> calibrate_camera(const std::vector<BoardView>& views, int width, int height,
                                             const CameraCalibrationSettings& settings) {
  if (views.size() < kFewestViews) {
    return fail(
        fmt::format("the board is seen in {} pictures only, and at least {} are needed, better 20: take more, "
                    "with the board tilted to all sides and in all parts of the picture",
                    views.size(), kFewestViews));
  }
  try {
    return calibrate(views, {{width, height}, settings.lens == Lens::kKannalaBrandt}, settings);
  } catch (const cv::Exception& thrown) {
    std::string what = thrown.err;
    std::replace(what.begin(), what.end(), '\n', ' ');
    return fail("the views do not determine the lens (" + what + "): take more, tilted to all sides");
  }
}

}  // namespace perimap

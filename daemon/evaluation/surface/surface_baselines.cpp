#include "daemon/evaluation/surface/surface_baselines.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace perimap {
namespace {

using Corners = std::array<Eigen::Index, 3>;

std::vector<Corners> delaunay(const std::vector<Vector2d>& features) {
  cv::Rect2f bounds(cv::Point2f(-1.0F, -1.0F), cv::Point2f(1.0F, 1.0F));
  std::vector<cv::Point2f> points;
  for (const Vector2d& s : features) {
    points.emplace_back(static_cast<float>(s.x()), static_cast<float>(s.y()));
    bounds |= cv::Rect2f(points.back().x - 1.0F, points.back().y - 1.0F, 2.0F, 2.0F);
  }
  cv::Subdiv2D subdivision(
      cv::Rect(static_cast<int>(std::floor(bounds.x)) - 1, static_cast<int>(std::floor(bounds.y)) - 1,
               static_cast<int>(std::ceil(bounds.width)) + 3, static_cast<int>(std::ceil(bounds.height)) + 3));
  std::map<std::pair<float, float>, Eigen::Index> index_of;
  for (std::size_t i = 0; i < points.size(); ++i) {
    subdivision.insert(points[i]);
    index_of.emplace(std::pair(points[i].x, points[i].y), static_cast<Eigen::Index>(i));
  }
  std::vector<cv::Vec6f> found;
  subdivision.getTriangleList(found);
  std::vector<Corners> triangles;
  for (const cv::Vec6f& t : found) {
    Corners corners{};
    bool known = true;
    for (int corner = 0; corner < 3; ++corner) {
      const auto at = index_of.find(std::pair(t[2 * corner], t[2 * corner + 1]));
      known = known && at != index_of.end();
      if (known) corners[static_cast<std::size_t>(corner)] = at->second;
    }
    // Others lean on the frame around them all.
    if (known) triangles.push_back(corners);
  }
  return triangles;
}

}  // namespace

Eigen::MatrixXd barycentric_weights(const std::vector<Vector2d>& features, const std::vector<Vector2d>& places) {
  Eigen::MatrixXd W =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(features.size()), static_cast<Eigen::Index>(places.size()));
  for (const Corners& corners : delaunay(features)) {
    const auto at = [&](std::size_t corner) { return features[static_cast<std::size_t>(corners[corner])]; };
    Matrix2d sides;
    sides << at(1) - at(0), at(2) - at(0);
    if (!(std::abs(sides.determinant()) > 1e-9)) continue;
    const Matrix2d inverse = sides.inverse();
    for (std::size_t v = 0; v < places.size(); ++v) {
      const Vector2d share = inverse * (places[v] - at(0));
      if (share.minCoeff() < 0.0 || share.sum() > 1.0) continue;
      auto column = W.col(static_cast<Eigen::Index>(v));
      column.setZero();
      column(corners[0]) = 1.0 - share.sum();
      column(corners[1]) = share.x();
      column(corners[2]) = share.y();
    }
  }
  return W;
}

Eigen::MatrixXd thin_plate_weights(const std::vector<Vector2d>& features, const std::vector<Vector2d>& places) {
  const auto N = static_cast<Eigen::Index>(features.size());
  const auto V = static_cast<Eigen::Index>(places.size());
  const auto bending = [](const Vector2d& a, const Vector2d& b) {
    const double r2 = (a - b).squaredNorm();
    return r2 > 0.0 ? 0.5 * r2 * std::log(r2) : 0.0;
  };
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(N + 3, N + 3);
  Eigen::MatrixXd right(N + 3, V);
  for (Eigen::Index i = 0; i < N; ++i) {
    const Vector2d& feature = features[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < N; ++j) system(i, j) = bending(feature, features[static_cast<std::size_t>(j)]);
    system.block<1, 3>(i, N) << 1.0, feature.x(), feature.y();
    system.block<3, 1>(N, i) = system.block<1, 3>(i, N).transpose();
    for (Eigen::Index v = 0; v < V; ++v) right(i, v) = bending(feature, places[static_cast<std::size_t>(v)]);
  }
  for (Eigen::Index v = 0; v < V; ++v) {
    right.block<3, 1>(N, v) << 1.0, places[static_cast<std::size_t>(v)].x(), places[static_cast<std::size_t>(v)].y();
  }
  return system.partialPivLu().solve(right).topRows(N);
}

}  // namespace perimap

#include "core/geometry/nearest_triangle.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <iterator>
#include <limits>
#include <utility>

#include "core/geometry/nearest_shares.hpp"

namespace perimap {
namespace {

namespace bg = boost::geometry;
using TreePoint = bg::model::point<double, 3, bg::cs::cartesian>;
using TreeBox = bg::model::box<TreePoint>;
using TreeEntry = std::pair<TreeBox, std::uint32_t>;

TreePoint tree_point(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

struct NearestTriangle::Tree {
  // Built at once from all entries.
  explicit Tree(const std::vector<TreeEntry>& entries) : of_boxes(entries.begin(), entries.end()) {}
  bg::index::rtree<TreeEntry, bg::index::rstar<16>> of_boxes;
};

NearestTriangle::NearestTriangle(const TriangleMesh& mesh)
    : mesh_(mesh), normals_(vertex_normals(mesh)), border_(mesh.triangles, mesh.vertices.size()) {
  std::vector<TreeEntry> entries;
  entries.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    const Vector3d &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]], &c = mesh.vertices[triangle[2]];
    entries.emplace_back(TreeBox(tree_point(a.cwiseMin(b).cwiseMin(c)), tree_point(a.cwiseMax(b).cwiseMax(c))), t);
  }
  tree_ = std::make_unique<const Tree>(entries);
}

NearestTriangle::~NearestTriangle() = default;

NearestPlace NearestTriangle::to(const Vector3d& p) const {
  NearestPlace best;
  const TreePoint at = tree_point(p);
  const auto& tree = tree_->of_boxes;
  // The nearest boxes: no triangle is nearer than its box, so that those beyond them hold none that is nearer than one
  // found within their distance.
  std::vector<TreeEntry> nearest;
  for (std::size_t count = 16;; count *= 4) {
    nearest.clear();
    tree.query(bg::index::nearest(at, static_cast<unsigned>(std::min(count, tree.size()))),
               std::back_inserter(nearest));
    double least = std::numeric_limits<double>::infinity(), furthest = 0.0;
    for (const auto& [box, t] : nearest) {
      furthest = std::max(furthest, bg::comparable_distance(at, box));
      const auto& triangle = mesh_.triangles[t];
      const Vector3d &a = mesh_.vertices[triangle[0]], &b = mesh_.vertices[triangle[1]],
                     &c = mesh_.vertices[triangle[2]];
      const Vector3d s = nearest_shares(p, a, b, c);
      const Vector3d point = s[0] * a + s[1] * b + s[2] * c;
      const double distance = (point - p).squaredNorm();
      if (distance < least) {
        least = distance;
        best.triangle = t;
        best.shares = s;
        best.point = point;
      }
    }
    if (least <= furthest || nearest.size() == tree.size()) break;
  }
  const auto& triangle = mesh_.triangles[best.triangle];
  best.normal = Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    best.normal += best.shares[static_cast<Eigen::Index>(k)] * normals_[triangle[k]];
  }
  best.normal.normalize();
  best.on_border = border_.has(best.triangle, triangle, best.shares);
  return best;
}

}  // namespace perimap

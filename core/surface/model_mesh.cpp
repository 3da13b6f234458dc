#include "core/surface/model_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/periodic/basis.hpp"
#include "core/surface/six_elements.hpp"

namespace perimap {
namespace {

// The field changes over centimetres, and a vertex lies millimetres from its mean place: each round leaves a tenth of
// what it is off at most.
constexpr int kMeanPlaceRounds = 3;
// Of the angle between the normal and the ray to the camera: 80 degrees, as for a chart's triangles.
constexpr double kFacingCosine = 0.17;
// Beyond so many deviations of both the model and the surface that is seen are of different things.
constexpr double kContradiction = 4.0;

Matrix3d model_covariance(const OrganModel& model, const Vector3d& n) {
  return model.registration_mm * model.registration_mm * Matrix3d::Identity() +
         model.shape_mm * model.shape_mm * (n * n.transpose());
}

// Vertices with a feature within reach, in space.
std::vector<Eigen::Index> near_features(const PeriodicSurface& surface, const OrganModel& model) {
  std::vector<Eigen::Index> near;
  const double reach2 = surface.support().reach_mm() * surface.support().reach_mm();
  for (std::size_t v = 0; v < model.mesh_W.vertices.size(); ++v) {
    const double d2 = (surface.mean_places().colwise() - model.mesh_W.vertices[v]).colwise().squaredNorm().minCoeff();
    if (d2 <= reach2) near.push_back(static_cast<Eigen::Index>(v));
  }
  return near;
}

struct Moving {
  Eigen::Matrix3Xd p_W_mm;  // mean places
  PredictedMotion motion;
};

// The mean places of vertices that lie at m_W at the model's phase, and their motion there.
Moving moving(const PeriodicSurface& surface, const Eigen::Matrix3Xd& m_W_mm, double phase_rad) {
  const Basis b = basis_without_breath(surface.layout(), phase_rad);
  Moving at{m_W_mm, {}};
  for (int round = 0; round < kMeanPlaceRounds; ++round) {
    at.motion = surface.motion_at(at.p_W_mm);
    const Eigen::VectorXd h = at.motion.coefficients_W_mm * b;
    at.p_W_mm = m_W_mm - Eigen::Map<const Eigen::Matrix3Xd>(h.data(), 3, m_W_mm.cols());
  }
  return at;
}

// One vertex beside the surface that is seen at its bearing.
struct Seen {
  bool supported = false;
  Vector3d p_W_mm = Vector3d::Zero();
  Matrix3d covariance_mm2 = Matrix3d::Zero();  // of the mean place
};

class DepthMeasurement {
 public:
  DepthMeasurement(const PeriodicSurface& surface, const Eigen::Matrix3Xd& p_W_mm) : surface_(surface) {
    Eigen::Matrix2Xd s_mm(2, p_W_mm.cols());
    places_.reserve(static_cast<std::size_t>(p_W_mm.cols()));
    for (Eigen::Index v = 0; v < p_W_mm.cols(); ++v) {
      places_.push_back(surface.chart().place_of(p_W_mm.col(v)));
      s_mm.col(v) = places_.back().s;
    }
    depth_ = surface.depth().at(s_mm);
  }

  // `covariance_mm2`: of the mean place p by the model, n its outward normal.
  [[nodiscard]] Seen update(Eigen::Index v, const Vector3d& p, const Vector3d& n,
                            const Matrix3d& covariance_mm2) const {
    Seen seen{false, p, covariance_mm2};
    const SurfaceChart::Place& place = places_[static_cast<std::size_t>(v)];
    if (!(place.depth_mm > 0.0) || surface_.support().at(place.s) != Support::kSupported) return seen;
    const Vector3d ray = surface_.chart().ray_W(place.s);
    const double along = n.dot(ray);
    if (!(-along > kFacingCosine * ray.norm())) return seen;
    const double variance_mm2 = depth_.variance_mm2(v) + surface_.turning_variance_mm2(place.s, depth_.depth_mm(v));
    const double r = along * (depth_.depth_mm(v) - place.depth_mm);
    const Vector3d Sigma_n = covariance_mm2 * n;
    const double innovation_mm2 = n.dot(Sigma_n) + along * along * variance_mm2;
    if (!(r * r <= kContradiction * kContradiction * innovation_mm2)) return seen;
    const Vector3d K = Sigma_n / innovation_mm2;
    seen.p_W_mm += K * r;
    seen.covariance_mm2 -= K * Sigma_n.transpose();
    const double bound_mm = surface_.settings().largest_deviation_mm;
    seen.supported = n.dot(seen.covariance_mm2 * n) <= bound_mm * bound_mm;
    return seen;
  }

 private:
  const PeriodicSurface& surface_;
  std::vector<SurfaceChart::Place> places_;
  DepthField::Prediction depth_;
};

}  // namespace

SurfaceMesh mesh_of(const PeriodicSurface& surface, const OrganModel& model) {
  const TriangleMesh& at_rest = model.mesh_W;
  const auto V = static_cast<Eigen::Index>(at_rest.vertices.size());
  SurfaceMesh mesh;
  mesh.layout = surface.layout();
  mesh.coefficients_W_mm.setZero(3 * V, surface.layout().size());
  mesh.covariances_W_mm2.resize(6, V);
  mesh.support.assign(at_rest.vertices.size(), Support::kUncertain);
  const Matrix3d unknown_mm2 = surface.unknown_motion_W_mm2();
  for (Eigen::Index v = 0; v < V; ++v) {
    const auto i = static_cast<std::size_t>(v);
    mesh.coefficients_W_mm.block<3, 1>(3 * v, 0) = at_rest.vertices[i];
    // From its place at one phase to that at another: twice.
    mesh.covariances_W_mm2.col(v) = to_six(model_covariance(model, model.normals_W[i]) + 2.0 * unknown_mm2);
  }

  const std::vector<Eigen::Index> near = near_features(surface, model);
  Eigen::Matrix3Xd m_W_mm(3, static_cast<Eigen::Index>(near.size()));
  for (std::size_t k = 0; k < near.size(); ++k) {
    m_W_mm.col(static_cast<Eigen::Index>(k)) = at_rest.vertices[static_cast<std::size_t>(near[k])];
  }
  const Moving at = moving(surface, m_W_mm, model.phase_rad);
  const DepthMeasurement depth(surface, at.p_W_mm);
  for (std::size_t k = 0; k < near.size(); ++k) {
    const auto from = static_cast<Eigen::Index>(k);
    const auto i = static_cast<std::size_t>(near[k]);
    const Vector3d& n = model.normals_W[i];
    const Matrix3d motion_mm2 = from_six(at.motion.covariances_W_mm2.col(from));
    const Seen seen = depth.update(from, at.p_W_mm.col(from), n, model_covariance(model, n) + motion_mm2);
    mesh.coefficients_W_mm.middleRows<3>(3 * near[k]) = at.motion.coefficients_W_mm.middleRows<3>(3 * from);
    mesh.coefficients_W_mm.block<3, 1>(3 * near[k], 0) = seen.p_W_mm;
    mesh.covariances_W_mm2.col(near[k]) = to_six(seen.covariance_mm2 + motion_mm2);
    if (seen.supported) mesh.support[i] = Support::kSupported;
  }
  for (const TriangleMesh::Triangle& triangle : at_rest.triangles) {
    const bool supported = std::all_of(triangle.begin(), triangle.end(),
                                       [&mesh](std::uint32_t v) { return mesh.support[v] == Support::kSupported; });
    if (supported) mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace perimap

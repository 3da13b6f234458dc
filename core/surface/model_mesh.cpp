#include "core/surface/model_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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

// The mean places of vertices that lie at m_W at the model's phase and move by themselves as `own` has it, and their
// motion there.
Moving moving(const PeriodicSurface& surface, const Eigen::Matrix3Xd& m_W_mm, const OwnHarmonics& own_W_mm,
              double phase_rad) {
  const Basis b = basis_without_breath(surface.layout(), phase_rad);
  Moving at{m_W_mm, {}};
  for (int round = 0; round < kMeanPlaceRounds; ++round) {
    at.motion = surface.motion_at(at.p_W_mm, own_W_mm);
    const Eigen::VectorXd h = at.motion.coefficients_W_mm * b;
    at.p_W_mm = m_W_mm - Eigen::Map<const Eigen::Matrix3Xd>(h.data(), 3, m_W_mm.cols());
  }
  return at;
}

// Mean places beside the surface that is seen.
struct Seen {
  Eigen::Matrix3Xd p_W_mm;
  std::vector<Matrix3d> covariances_mm2;
  std::vector<bool> supported;
};

// The depth that is seen at the bearing of each place, as a measurement of it along the model's normal. Where the
// surface is seen obliquely, a place that is moved has another bearing: the measurement is taken anew there, and the
// step is made again from where the model has it (an iterated Kalman filter).
Seen on_what_is_seen(const PeriodicSurface& surface, const Eigen::Matrix3Xd& p_W_mm, const Eigen::Matrix3Xd& normals_W,
                     std::vector<Matrix3d> covariances_mm2) {
  constexpr int kIterations = 3;
  const Eigen::Index V = p_W_mm.cols();
  Seen seen{p_W_mm, std::move(covariances_mm2), std::vector<bool>(static_cast<std::size_t>(V), false)};
  const double bound_mm = surface.settings().largest_deviation_mm;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<SurfaceChart::Place> places;
    Eigen::Matrix2Xd s_mm(2, V);
    for (Eigen::Index v = 0; v < V; ++v) {
      places.push_back(surface.chart().place_of(seen.p_W_mm.col(v)));
      s_mm.col(v) = places.back().s;
    }
    const DepthField::Prediction depth = surface.depth().at(s_mm);
    for (Eigen::Index v = 0; v < V; ++v) {
      const auto i = static_cast<std::size_t>(v);
      const SurfaceChart::Place& place = places[i];
      const Vector3d n = normals_W.col(v);
      const Vector3d ray = surface.chart().ray_W(place.s);
      const double along = n.dot(ray);
      const bool faced = -along > kFacingCosine * ray.norm();
      if (!(place.depth_mm > 0.0) || !faced || surface.support().at(place.s) != Support::kSupported) {
        seen.supported[i] = false;
        continue;
      }
      const Vector3d moved = seen.p_W_mm.col(v) - p_W_mm.col(v);
      const double innovation_mm = along * (depth.depth_mm(v) - place.depth_mm) + n.dot(moved);
      const double variance_mm2 = depth.variance_mm2(v) + surface.turning_variance_mm2(place.s, depth.depth_mm(v));
      const Vector3d Sigma_n = seen.covariances_mm2[i] * n;
      const double innovation_mm2 = n.dot(Sigma_n) + along * along * variance_mm2;
      const bool agrees = innovation_mm * innovation_mm <= kContradiction * kContradiction * innovation_mm2;
      const Vector3d K = Sigma_n / innovation_mm2;
      const Matrix3d after_mm2 = seen.covariances_mm2[i] - K * Sigma_n.transpose();
      seen.supported[i] = agrees && n.dot(after_mm2 * n) <= bound_mm * bound_mm;
      if (!agrees) continue;
      seen.p_W_mm.col(v) = p_W_mm.col(v) + K * innovation_mm;
      if (iteration + 1 == kIterations) seen.covariances_mm2[i] = after_mm2;
    }
  }
  return seen;
}

}  // namespace

SurfaceMesh mesh_of(const PeriodicSurface& surface, const OrganModel& model) {
  const TriangleMesh& at_rest = model.mesh_W;
  const auto V = static_cast<Eigen::Index>(at_rest.vertices.size());
  SurfaceMesh mesh;
  mesh.layout = surface.layout();
  mesh.covariances_W_mm2.resize(6, V);
  mesh.support.assign(at_rest.vertices.size(), Support::kUncertain);
  const OwnHarmonics own_W_mm = surface.model() != nullptr ? surface.model()->of_vertices() : OwnHarmonics();
  const PredictedMotion unseen = surface.unseen_motion(V, own_W_mm);
  mesh.coefficients_W_mm = unseen.coefficients_W_mm;
  const Eigen::VectorXd from_mean_mm =
      unseen.coefficients_W_mm * basis_without_breath(surface.layout(), model.phase_rad);
  for (Eigen::Index v = 0; v < V; ++v) {
    const auto i = static_cast<std::size_t>(v);
    mesh.coefficients_W_mm.block<3, 1>(3 * v, 0) = at_rest.vertices[i] - from_mean_mm.segment<3>(3 * v);
    // From its place at one phase to that at another: twice.
    mesh.covariances_W_mm2.col(v) =
        to_six(model_covariance(model, model.normals_W[i]) + 2.0 * from_six(unseen.covariances_W_mm2.col(v)));
  }

  const std::vector<Eigen::Index> near = near_features(surface, model);
  Eigen::Matrix3Xd m_W_mm(3, static_cast<Eigen::Index>(near.size()));
  OwnHarmonics own_near_W_mm(own_W_mm.rows() > 0 ? 3 * m_W_mm.cols() : 0, own_W_mm.cols());
  for (std::size_t k = 0; k < near.size(); ++k) {
    const auto from = static_cast<Eigen::Index>(k);
    m_W_mm.col(from) = at_rest.vertices[static_cast<std::size_t>(near[k])];
    if (own_W_mm.rows() > 0) own_near_W_mm.middleRows<3>(3 * from) = own_W_mm.middleRows<3>(3 * near[k]);
  }
  const Moving at = moving(surface, m_W_mm, own_near_W_mm, model.phase_rad);
  Eigen::Matrix3Xd normals_W(3, m_W_mm.cols());
  std::vector<Matrix3d> covariances_mm2;
  for (std::size_t k = 0; k < near.size(); ++k) {
    const auto from = static_cast<Eigen::Index>(k);
    normals_W.col(from) = model.normals_W[static_cast<std::size_t>(near[k])];
    covariances_mm2.emplace_back(model_covariance(model, normals_W.col(from)) +
                                 from_six(at.motion.covariances_W_mm2.col(from)));
  }
  const Seen seen = on_what_is_seen(surface, at.p_W_mm, normals_W, std::move(covariances_mm2));
  for (std::size_t k = 0; k < near.size(); ++k) {
    const auto from = static_cast<Eigen::Index>(k);
    mesh.coefficients_W_mm.middleRows<3>(3 * near[k]) = at.motion.coefficients_W_mm.middleRows<3>(3 * from);
    mesh.coefficients_W_mm.block<3, 1>(3 * near[k], 0) = seen.p_W_mm.col(from);
    mesh.covariances_W_mm2.col(near[k]) =
        to_six(seen.covariances_mm2[k] + from_six(at.motion.covariances_W_mm2.col(from)));
    if (seen.supported[k]) mesh.support[static_cast<std::size_t>(near[k])] = Support::kSupported;
  }
  for (const TriangleMesh::Triangle& triangle : at_rest.triangles) {
    const bool supported = std::all_of(triangle.begin(), triangle.end(),
                                       [&mesh](std::uint32_t v) { return mesh.support[v] == Support::kSupported; });
    if (supported) mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace perimap

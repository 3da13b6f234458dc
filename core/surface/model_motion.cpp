#include "core/surface/model_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/periodic/basis.hpp"

namespace perimap {
namespace {

// Of the smallest eigenvalue of the series' normal matrix, which is 1 for phases that are evenly spread: a coefficient
// is then twice as uncertain as theirs.
constexpr double kLeastTold = 0.25;

// Rows of phases, columns of the basis.
Eigen::MatrixXd series(std::span<const double> phases_rad, int harmonics) {
  const BasisLayout layout{harmonics, 0};
  Eigen::MatrixXd B(static_cast<Eigen::Index>(phases_rad.size()), layout.size());
  for (Eigen::Index k = 0; k < B.rows(); ++k) {
    B.row(k) = basis_at(layout, phases_rad[static_cast<std::size_t>(k)]).transpose();
  }
  return B;
}

}  // namespace

int harmonics_told(std::span<const double> phases_rad) {
  const auto K = static_cast<int>(phases_rad.size());
  for (int harmonics = std::min((K - 1) / 2, kMaxHarmonics); harmonics > 0; --harmonics) {
    Eigen::MatrixXd B = series(phases_rad, harmonics);
    B.rightCols(2 * harmonics) *= std::sqrt(2.0);
    const Eigen::MatrixXd normal = B.transpose() * B / static_cast<double>(K);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(normal, Eigen::EigenvaluesOnly);
    if (solver.eigenvalues()(0) >= kLeastTold) return harmonics;
  }
  return 0;
}

ModelMotion::Series ModelMotion::fit(std::span<const double> phases_rad, const PlacesByPhase& vertices_mm) {
  const int harmonics = harmonics_told(phases_rad);
  const Eigen::MatrixXd B = series(phases_rad, harmonics);
  const auto V = static_cast<Eigen::Index>(vertices_mm.front().size());
  Eigen::MatrixXd m_mm(B.rows(), 3 * V);
  for (Eigen::Index k = 0; k < B.rows(); ++k) {
    const std::vector<Vector3d>& places = vertices_mm[static_cast<std::size_t>(k)];
    for (Eigen::Index v = 0; v < V; ++v) {
      m_mm.row(k).segment<3>(3 * v) = places[static_cast<std::size_t>(v)].transpose();
    }
  }
  const Eigen::MatrixXd c_mm = (B.transpose() * B).ldlt().solve(B.transpose() * m_mm);
  Series fitted;
  fitted.residual_mm = (m_mm - B * c_mm).norm() / std::sqrt(static_cast<double>(B.rows() * V));
  fitted.harmonics_mm = c_mm.bottomRows(2 * harmonics).transpose();
  return fitted;
}

ModelMotion::ModelMotion(std::span<const double> phases_rad, const PlacesByPhase& vertices_mm,
                         std::vector<TriangleMesh::Triangle> triangles)
    : phase_rad_(phases_rad.front()),
      series_(fit(phases_rad, vertices_mm)),
      mesh_{vertices_mm.front(), std::move(triangles)},
      nearest_(mesh_) {}

OwnHarmonics ModelMotion::at(const Eigen::Matrix3Xd& p_mm) const {
  OwnHarmonics own = OwnHarmonics::Zero(3 * p_mm.cols(), series_.harmonics_mm.cols());
  for (Eigen::Index v = 0; v < p_mm.cols(); ++v) {
    const NearestPlace place = nearest_.to(p_mm.col(v));
    const TriangleMesh::Triangle& corners = mesh_.triangles[place.triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      own.middleRows<3>(3 * v) += place.shares[static_cast<Eigen::Index>(k)] *
                                  series_.harmonics_mm.middleRows<3>(3 * static_cast<Eigen::Index>(corners[k]));
    }
  }
  return own;
}

}  // namespace perimap

// How a preoperative model moves by itself: several phases of one mesh, as a Fourier series of each vertex.
//
// A vertex that lies at m_k at the phase phi_k moves, by least squares over the phases, as
//
//   m(phi) = c + sum_h a_h cos(h phi) - b_h sin(h phi)
//
// with as many harmonics as the phases tell. Any other place moves as the nearest place of the mesh does; of the mesh
// as it is at the first phase, since that is where it is registered. Frames: that of the mesh, which is the one that
// poses are registered to; a mesh that is turned turns a_h and b_h.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/geometry/nearest_triangle.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

// 3 V x 2 H, mm: rows x, y, z of place 0, then of place 1; columns a_1 .. a_H, b_1 .. b_H.
using OwnHarmonics = Eigen::MatrixXd;

// Of each phase where all vertices lie, each time in the same order.
using PlacesByPhase = std::vector<std::vector<Vector3d>>;

// How many harmonics so many phases tell (rad, any order): at most as many as there are numbers for, and no more than
// leave each coefficient at most twice as uncertain as phases that are evenly spread would. 0: not one.
[[nodiscard]] int harmonics_told(std::span<const double> phases_rad);

class ModelMotion {
 public:
  // `phases_rad` tell a harmonic, and the mesh at the first of them has a triangle with an area.
  ModelMotion(std::span<const double> phases_rad, const PlacesByPhase& vertices_mm,
              std::vector<TriangleMesh::Triangle> triangles);
  // The tree points into the mesh.
  ModelMotion(const ModelMotion&) = delete;
  ModelMotion& operator=(const ModelMotion&) = delete;

  [[nodiscard]] int harmonics() const noexcept { return static_cast<int>(series_.harmonics_mm.cols() / 2); }
  // Of the phases from the series, 3-D RMS: 0 where there are as many numbers as phases.
  [[nodiscard]] double residual_mm() const noexcept { return series_.residual_mm; }

  // The first one.
  [[nodiscard]] double phase_rad() const noexcept { return phase_rad_; }
  // Of the vertices, in their order.
  [[nodiscard]] const OwnHarmonics& of_vertices() const noexcept { return series_.harmonics_mm; }
  // Of places near the mesh as they are at the first phase, 3 x V, mm. Beyond an edge of it: as the edge.
  [[nodiscard]] OwnHarmonics at(const Eigen::Matrix3Xd& p_mm) const;

 private:
  struct Series {
    OwnHarmonics harmonics_mm;
    double residual_mm = 0.0;
  };
  [[nodiscard]] static Series fit(std::span<const double> phases_rad, const PlacesByPhase& vertices_mm);

  double phase_rad_;
  Series series_;
  TriangleMesh mesh_;
  NearestTriangle nearest_;
};

}  // namespace perimap

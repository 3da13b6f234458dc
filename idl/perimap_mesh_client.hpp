// For navigation software: the one surface through all features at an instant of its own choosing, and how far a point
// is from it. From the newest perimap::SurfaceMesh and the newest perimap::SurfaceModel, whose clocks it moves by.
//
//   perimap::client::PredictedMesh mesh;   // kept: its memory is used again
//   if (!perimap::client::predict(*newest_mesh, *newest_model, display_time_ns, now_ns, {}, mesh))
//   show(describe(mesh)); const auto tip = perimap::client::nearest(mesh, tip_W_mm); if (tip.refusal ==
//   perimap::client::PointRefusal::kNone) show(tip.distance_mm, tip.deviation_mm);
//
// Needs C++17, the C types that idlc makes of perimap.idl and perimap_mesh.idl, and nothing else. Units and clocks are
// those of perimap_client.hpp. Functions keep nothing but what is in the PredictedMesh that they are given. Once that
// has held a mesh of its size nothing is allocated.
// Long: a program takes one header for a mesh, and needs no more.
#pragma once

#include <perimap_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <perimap_client.hpp>
#include <vector>

namespace perimap::client {

// Why there is no mesh. The first ones are those of a SurfaceModel, which tells the phases.
enum class MeshRefusal : std::uint8_t {
  kNone,
  kModel,        // the model is refused: PredictedMesh::model_refusal, and reason where that is perimapd's
  kStale,        // now, or the instant asked for, is past the mesh's valid_until_ns
  kNoSurface,    // perimapd says that there is none: PredictedMesh::mesh_reason
  kOtherSource,  // mesh and model are of different perimapds
  kOtherLaw,     // the motion was learnt under another law than the model's phases: the next mesh will be of this one
  kMalformed     // numbers that perimapd does not send
};

struct PredictedMesh {
  MeshRefusal refusal = MeshRefusal::kMalformed;
  Refusal model_refusal = Refusal::kNone;
  std::uint8_t mesh_reason = perimap_MESH_REASON_NONE;   // one of MESH_REASON_...
  perimap_SurfaceState state = perimap_SURFACE_INVALID;  // at time_ns, as of a PredictedSurface
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  std::int64_t time_ns = 0;

  using Vector = std::array<double, 3>;
  using Triangle = std::array<std::uint32_t, 3>;
  // Of each vertex; all empty when refused.
  std::vector<Vector> positions_W_mm;
  std::vector<Vector> velocities_W_mm_per_s;
  std::vector<Vector> normals_W;      // unit, towards where the camera was; zero where no triangle is
  std::vector<double> deviations_mm;  // not below the position's in any direction
  std::vector<std::uint8_t> states;   // VERTEX_SUPPORTED, or not to be used
  std::vector<Triangle> triangles;    // of supported vertices alone, counter-clockwise from the front

  // What depends on the mesh alone is computed once for each. For the functions of this header.
  struct OfMesh {
    std::array<std::uint8_t, 16> run_id{};
    std::array<char, sizeof(perimap_SurfaceMesh::source)> source{};
    std::uint64_t sample_sequence = 0;  // 0: of none
    bool sound = false;
    std::vector<double> largest_mm2;  // of each vertex' covariance, the largest eigenvalue
    std::vector<std::array<double, 6>> covariances_mm2;
    std::vector<std::uint8_t> on_border;              // of each vertex
    std::vector<std::array<std::uint32_t, 3>> edges;  // lower vertex, upper vertex, triangle
    std::vector<std::uint8_t> border_edges;           // of each triangle, bit k: the edge from corner k to the next
  } of_mesh;
  std::vector<Vector>
      half_spreads_mm;  // of each vertex: earlier and later half of the phase's deviation, see predict()
  std::vector<Vector> other_spreads_mm;
  double breath_variance_mm2 = 0.0;
  std::vector<float> sums;  // of predict()
};

// Why a point has no distance.
enum class PointRefusal : std::uint8_t {
  kNone,
  kNoMesh,  // the mesh itself is refused
  kNotANumber,
  kBeyondEdge  // what is nearest lies on the border of what is known: a hole, or the end of what was seen
};

// Where a point is, beside the surface.
struct NearestPoint {
  PointRefusal refusal = PointRefusal::kNoMesh;
  std::array<double, 3> point_W_mm{};           // of the surface
  std::array<double, 3> normal_W{};             // unit, towards where the camera was
  double distance_mm = 0.0;                     // signed: positive in front, where the camera was; negative within
  double deviation_mm = 0.0;                    // of the surface along the normal
  std::array<double, 3> velocity_W_mm_per_s{};  // of the surface there
  double approach_mm_per_s = 0.0;  // of the signed distance, by the velocity that was given: negative towards within
};

namespace detail {

using Vector = PredictedMesh::Vector;

inline Vector minus(const Vector& a, const Vector& b) noexcept { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double dot(const Vector& a, const Vector& b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector cross(const Vector& a, const Vector& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vector unit(const Vector& a) noexcept {
  const double length = std::sqrt(dot(a, a));
  if (!(length > 0.0)) return {};
  return {a[0] / length, a[1] / length, a[2] / length};
}
inline bool finite(const Vector& a) noexcept {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

// Of xx xy xz yy yz zz, in closed form (the characteristic polynomial's trigonometric roots).
inline double largest_eigenvalue(const std::array<double, 6>& c) noexcept {
  const double mean = (c[0] + c[3] + c[5]) / 3.0;
  const double xx = c[0] - mean, yy = c[3] - mean, zz = c[5] - mean;
  const double p2 = (xx * xx + yy * yy + zz * zz + 2.0 * (c[1] * c[1] + c[2] * c[2] + c[4] * c[4])) / 6.0;
  if (!(p2 > 0.0)) return mean;
  const double p = std::sqrt(p2);
  const double determinant =
      xx * (yy * zz - c[4] * c[4]) - c[1] * (c[1] * zz - c[4] * c[2]) + c[2] * (c[1] * c[4] - yy * c[2]);
  const double half = std::clamp(determinant / (2.0 * p * p2), -1.0, 1.0);
  return mean + 2.0 * p * std::cos(std::acos(half) / 3.0);
}

// What is read of any sample, the one before repeated or not, is there.
inline bool lengths_fit(const perimap_SurfaceMesh& mesh) noexcept {
  if (mesh.cardiac_harmonics > kMostHarmonics || mesh.respiratory_harmonics > kMostHarmonics) return false;
  const std::uint64_t B = 1 + 2 * (std::uint64_t{mesh.cardiac_harmonics} + mesh.respiratory_harmonics);
  const std::uint64_t V = mesh.vertex_states._length;
  if (mesh.coefficients_W_mm._length != 3 * B * V || mesh.covariances_W_mm2._length != 6 * V) return false;
  return V > 0 && mesh.triangles._length > 0 && mesh.triangles._length % 3 == 0;
}

inline bool well_formed(const perimap_SurfaceMesh& mesh) noexcept {
  if (!lengths_fit(mesh)) return false;
  const std::uint64_t V = mesh.vertex_states._length;
  const auto all_finite = [](const dds_sequence_float& values) {
    return std::all_of(values._buffer, values._buffer + values._length, [](float x) { return std::isfinite(x); });
  };
  if (!all_finite(mesh.coefficients_W_mm) || !all_finite(mesh.covariances_W_mm2)) return false;
  for (std::uint32_t i = 0; i < mesh.triangles._length; ++i) {
    const std::uint32_t vertex = mesh.triangles._buffer[i];
    if (vertex >= V || mesh.vertex_states._buffer[vertex] != perimap_VERTEX_SUPPORTED) return false;
  }
  return true;
}

// Which edges belong to one triangle alone.
inline void find_border(const std::vector<PredictedMesh::Triangle>& triangles, PredictedMesh::OfMesh& of) {
  of.edges.clear();
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k];
      const std::uint32_t b = triangles[t][(k + 1) % 3];
      of.edges.push_back({std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(4 * t + k)});
    }
  }
  std::sort(of.edges.begin(), of.edges.end());
  of.border_edges.assign(triangles.size(), 0);
  std::fill(of.on_border.begin(), of.on_border.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < of.edges.size();) {
    std::size_t end = i + 1;
    while (end < of.edges.size() && of.edges[end][0] == of.edges[i][0] && of.edges[end][1] == of.edges[i][1]) ++end;
    if (end == i + 1) {
      of.border_edges[of.edges[i][2] / 4] |= static_cast<std::uint8_t>(1U << (of.edges[i][2] % 4));
      of.on_border[of.edges[i][0]] = of.on_border[of.edges[i][1]] = 1;
    }
    i = end;
  }
}

inline void take_mesh(const perimap_SurfaceMesh& mesh, PredictedMesh& out) {
  PredictedMesh::OfMesh& of = out.of_mesh;
  const bool same = of.sample_sequence == mesh.sample_sequence && mesh.sample_sequence != 0 &&
                    std::memcmp(of.run_id.data(), mesh.run_id, of.run_id.size()) == 0 &&
                    std::memcmp(of.source.data(), mesh.source, of.source.size()) == 0;
  if (same && of.sound && of.on_border.size() == mesh.vertex_states._length &&
      3 * out.triangles.size() == mesh.triangles._length) {
    return;
  }
  std::memcpy(of.source.data(), mesh.source, of.source.size());
  std::memcpy(of.run_id.data(), mesh.run_id, of.run_id.size());
  of.sample_sequence = mesh.sample_sequence;
  of.sound = well_formed(mesh);
  if (!of.sound) return;
  const std::size_t V = mesh.vertex_states._length;
  of.largest_mm2.resize(V);
  of.covariances_mm2.resize(V);
  of.on_border.resize(V);
  for (std::size_t v = 0; v < V; ++v) {
    for (std::size_t e = 0; e < 6; ++e) {
      of.covariances_mm2[v][e] = static_cast<double>(mesh.covariances_W_mm2._buffer[e * V + v]);
    }
    of.largest_mm2[v] = largest_eigenvalue(of.covariances_mm2[v]);
    const std::array<double, 6>& c = of.covariances_mm2[v];
    of.sound = of.sound && std::min({c[0], c[3], c[5]}) >= 0.0 && of.largest_mm2[v] >= 0.0;
  }
  out.triangles.resize(mesh.triangles._length / 3);
  for (std::size_t t = 0; t < out.triangles.size(); ++t) {
    const std::uint32_t* corners = mesh.triangles._buffer + 3 * t;
    out.triangles[t] = {corners[0], corners[1], corners[2]};
  }
  find_border(out.triangles, of);
}

// The sums over one axis' coefficients for all vertices: five bases at once, so that each coefficient is read once.
constexpr std::size_t kSums = 5;
inline void sum_axis(const float* coefficients, std::size_t V, const Bases& bases, float* sums) noexcept {
  const std::array<const Basis*, kSums> all = {&bases.position, &bases.by_cardiac, &bases.by_respiratory,
                                               &bases.earlier, &bases.later};
  std::fill(sums, sums + kSums * V, 0.0F);
  constexpr std::size_t kBlock = 512;
  for (std::size_t first = 0; first < V; first += kBlock) {
    const std::size_t end = std::min(V, first + kBlock);
    for (std::size_t j = 0; j < bases.position.size; ++j) {
      const float* c = coefficients + j * V;
      for (std::size_t k = 0; k < kSums; ++k) {
        const auto b = static_cast<float>(all[k]->values[j]);
        if (b == 0.0F) continue;
        float* sum = sums + k * V;
        for (std::size_t v = first; v < end; ++v) sum[v] += b * c[v];
      }
    }
  }
}

// False when something of it is no number: a model's figures may be anything, and sums of finite ones too large.
inline bool move_vertices(const perimap_SurfaceMesh& mesh, const Bases& bases, PredictedMesh& out) {
  const std::size_t V = mesh.vertex_states._length;
  out.positions_W_mm.resize(V);
  out.velocities_W_mm_per_s.resize(V);
  out.half_spreads_mm.resize(V);
  out.other_spreads_mm.resize(V);
  out.deviations_mm.resize(V);
  out.sums.resize(kSums * V);
  out.states.assign(mesh.vertex_states._buffer, mesh.vertex_states._buffer + V);
  out.breath_variance_mm2 = bases.respiratory_variance_mm2;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sum_axis(mesh.coefficients_W_mm._buffer + axis * bases.position.size * V, V, bases, out.sums.data());
    const float* s = out.sums.data();
    for (std::size_t v = 0; v < V; ++v) {
      out.positions_W_mm[v][axis] = static_cast<double>(s[v]);
      out.velocities_W_mm_per_s[v][axis] = bases.cardiac_rate * static_cast<double>(s[V + v]) +
                                           bases.respiratory_rate * static_cast<double>(s[2 * V + v]);
      out.half_spreads_mm[v][axis] = static_cast<double>(s[3 * V + v] - s[v]);
      out.other_spreads_mm[v][axis] = static_cast<double>(s[4 * V + v] - s[v]);
    }
  }
  bool all_finite = true;
  for (std::size_t v = 0; v < V; ++v) {
    const Vector& before = out.half_spreads_mm[v];
    const Vector& after = out.other_spreads_mm[v];
    // The largest eigenvalue of a sum is not above the sum of the largest ones (Weyl).
    out.deviations_mm[v] = std::sqrt(out.of_mesh.largest_mm2[v] + 0.5 * (dot(before, before) + dot(after, after)) +
                                     bases.respiratory_variance_mm2);
    all_finite = all_finite && std::isfinite(out.deviations_mm[v]) && finite(out.positions_W_mm[v]) &&
                 finite(out.velocities_W_mm_per_s[v]);
  }
  return all_finite;
}

inline void find_normals(PredictedMesh& out) {
  out.normals_W.assign(out.positions_W_mm.size(), Vector{});
  for (const PredictedMesh::Triangle& triangle : out.triangles) {
    const Vector& a = out.positions_W_mm[triangle[0]];
    const Vector n = cross(minus(out.positions_W_mm[triangle[1]], a), minus(out.positions_W_mm[triangle[2]], a));
    for (const std::uint32_t corner : triangle) {
      for (std::size_t axis = 0; axis < 3; ++axis) out.normals_W[corner][axis] += n[axis];
    }
  }
  for (Vector& normal : out.normals_W) normal = unit(normal);
}

inline MeshRefusal mesh_refusal(const perimap_SurfaceMesh& mesh, const perimap_SurfaceModel& model, std::int64_t t_ns,
                                std::int64_t now_ns) noexcept {
  if (std::strncmp(mesh.source, model.source, sizeof mesh.source) != 0) return MeshRefusal::kOtherSource;
  if (mesh.state == perimap_MESH_NONE) return MeshRefusal::kNoSurface;  // none is not too old
  if (now_ns > mesh.valid_until_ns || t_ns > mesh.valid_until_ns) return MeshRefusal::kStale;
  if (mesh.state != perimap_MESH_THERE) return MeshRefusal::kMalformed;
  if (mesh.phase_law != static_cast<std::uint8_t>(model.cardiac_clock.law)) return MeshRefusal::kOtherLaw;
  return MeshRefusal::kNone;
}

// Moved by a phase that is known.
inline bool move_mesh(const perimap_SurfaceMesh& mesh, const perimap_SurfaceModel& model, const Phase& phase,
                      std::int64_t t_ns, PredictedMesh& out) {
  // A mesh that was made before breathing was known, or without it, is not moved by a model that has it.
  if (!well_formed(model) || !lengths_fit(mesh) || mesh.cardiac_harmonics != model.cardiac_harmonics ||
      mesh.respiratory_harmonics != model.respiratory_harmonics) {
    return false;
  }
  take_mesh(mesh, out);
  if (!out.of_mesh.sound) return false;
  if (!move_vertices(mesh, bases_at(model, phase, t_ns), out)) return false;
  find_normals(out);
  return true;
}

inline bool move_mesh(const perimap_SurfaceMesh& mesh, const perimap_SurfaceModel& model, std::int64_t t_ns,
                      PredictedMesh& out) {
  const perimap_CardiacCycle* cycle = cycle_at(model, t_ns);
  Phase phase;
  return cycle != nullptr && phase_at(model.cardiac_clock, *cycle, t_ns, phase) &&
         move_mesh(mesh, model, phase, t_ns, out);
}

inline bool move_mesh(const perimap_SurfaceMesh& mesh, const perimap_SurfaceModel& model,
                      const perimap_Surface& surface, PredictedMesh& out) {
  const Phase phase{surface.cardiac_phase_rad, surface.cardiac_phase_rate_rad_per_s,
                    surface.cardiac_phase_deviation_rad};
  return std::isfinite(phase.phase_rad) && std::isfinite(phase.rate_rad_per_s) && phase.deviation_rad >= 0.0 &&
         std::isfinite(phase.deviation_rad) && move_mesh(mesh, model, phase, surface.valid_time_ns, out);
}

inline Refusal refusal_of(const perimap_Surface& surface, const perimap_SurfaceModel& model, std::int64_t now_ns,
                          const Acceptance& acceptance) noexcept {
  if (now_ns > surface.valid_until_ns || now_ns > model.valid_until_ns) return Refusal::kStale;
  if (surface.state == perimap_SURFACE_GOOD) return Refusal::kNone;
  if (surface.state == perimap_SURFACE_DEGRADED) return acceptance.degraded ? Refusal::kNone : Refusal::kDegraded;
  return Refusal::kInvalid;
}

inline bool of_one_run(const perimap_Surface& surface, const perimap_SurfaceModel& model,
                       const perimap_SurfaceMesh& mesh) noexcept {
  return std::strncmp(surface.source, model.source, sizeof surface.source) == 0 &&
         std::memcmp(surface.run_id, model.run_id, sizeof surface.run_id) == 0 &&
         std::memcmp(surface.run_id, mesh.run_id, sizeof surface.run_id) == 0;
}

inline bool leave_empty(PredictedMesh& out) {
  out.of_mesh.sample_sequence = 0;
  out.positions_W_mm.clear();
  out.velocities_W_mm_per_s.clear();
  out.normals_W.clear();
  out.deviations_mm.clear();
  out.states.clear();
  out.triangles.clear();
  return false;
}

// The nearest point of a triangle, as shares of its corners.
inline Vector nearest_of_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) noexcept {
  const Vector ab = minus(b, a);
  const Vector ac = minus(c, a);
  const Vector ap = minus(p, a);
  // Within it, where the perpendicular from p meets its plane.
  const double aa = dot(ab, ab), ab_ac = dot(ab, ac), cc = dot(ac, ac);
  const double pb = dot(ap, ab), pc = dot(ap, ac);
  const double determinant = aa * cc - ab_ac * ab_ac;
  if (determinant > 0.0) {
    const double v = (cc * pb - ab_ac * pc) / determinant;
    const double w = (aa * pc - ab_ac * pb) / determinant;
    if (v >= 0.0 && w >= 0.0 && v + w <= 1.0) return {1.0 - v - w, v, w};
  }
  // Else on the nearest of its sides.
  const auto share = [](double along, double length2) {
    return length2 > 0.0 ? std::clamp(along / length2, 0.0, 1.0) : 0.0;
  };
  const Vector bc = minus(c, b);
  const double on_ab = share(pb, aa), on_ac = share(pc, cc), on_bc = share(dot(minus(p, b), bc), dot(bc, bc));
  const std::array<Vector, 3> shares = {Vector{1.0 - on_ab, on_ab, 0.0}, Vector{0.0, 1.0 - on_bc, on_bc},
                                        Vector{1.0 - on_ac, 0.0, on_ac}};
  double least = std::numeric_limits<double>::infinity();
  Vector best = shares[0];
  for (const Vector& s : shares) {
    Vector q{};
    for (std::size_t i = 0; i < 3; ++i) q[i] = s[0] * a[i] + s[1] * b[i] + s[2] * c[i] - p[i];
    const double d2 = dot(q, q);
    if (d2 < least) {
      least = d2;
      best = s;
    }
  }
  return best;
}

// On an edge, or a corner, beyond which there is no triangle.
inline bool on_border(const PredictedMesh& mesh, std::size_t triangle, const Vector& shares) noexcept {
  const PredictedMesh::Triangle& corners = mesh.triangles[triangle];
  for (std::size_t k = 0; k < 3; ++k) {
    if (shares[k] >= 1.0) return mesh.of_mesh.on_border[corners[k]] != 0;
    const bool on_edge = shares[(k + 2) % 3] <= 0.0;
    if (on_edge && (mesh.of_mesh.border_edges[triangle] >> k & 1U) != 0) return true;
  }
  return false;
}

inline double variance_along(const PredictedMesh& mesh, std::uint32_t vertex, const Vector& n) noexcept {
  const std::array<double, 6>& c = mesh.of_mesh.covariances_mm2[vertex];
  const double before = dot(mesh.half_spreads_mm[vertex], n);
  const double after = dot(mesh.other_spreads_mm[vertex], n);
  return n[0] * n[0] * c[0] + n[1] * n[1] * c[3] + n[2] * n[2] * c[5] +
         2.0 * (n[0] * n[1] * c[1] + n[0] * n[2] * c[2] + n[1] * n[2] * c[4]) +
         0.5 * (before * before + after * after) + mesh.breath_variance_mm2;
}

}  // namespace detail

// The surface at t_ns, as known from `mesh` and `model` at now_ns. False when refused: out.refusal says why, and there
// are no vertices.
inline bool predict(const perimap_SurfaceMesh& mesh, const perimap_SurfaceModel& model, std::int64_t t_ns,
                    std::int64_t now_ns, Acceptance acceptance, PredictedMesh& out) {
  const SurfaceVerdict verdict = verdict_at(model, t_ns, now_ns, acceptance);
  out.state = verdict.state;
  out.reason = verdict.reason;
  out.model_refusal = verdict.refusal;
  out.time_ns = t_ns;
  out.mesh_reason = mesh.reason;
  out.refusal =
      verdict.refusal != Refusal::kNone ? MeshRefusal::kModel : detail::mesh_refusal(mesh, model, t_ns, now_ns);
  if (out.refusal == MeshRefusal::kNone && !detail::move_mesh(mesh, model, t_ns, out)) {
    out.refusal = MeshRefusal::kMalformed;
  }
  return out.refusal == MeshRefusal::kNone || detail::leave_empty(out);
}

// The surface at the instant of `surface`, whose phase of the heart is newer than the model's: for programs that show
// each perimap::Surface as it comes. It is worth what that one is. The model tells the law and breathing. False when
// refused, as above; `kModel` where the surface itself is refused, with its reason, and kOtherSource where the three
// are not of one run.
inline bool predict(const perimap_SurfaceMesh& mesh, const perimap_SurfaceModel& model, const perimap_Surface& surface,
                    std::int64_t now_ns, Acceptance acceptance, PredictedMesh& out) {
  out.state = surface.state;
  out.reason = surface.reason;
  out.model_refusal = detail::refusal_of(surface, model, now_ns, acceptance);
  out.time_ns = surface.valid_time_ns;
  out.mesh_reason = mesh.reason;
  out.refusal = MeshRefusal::kModel;
  if (out.model_refusal == Refusal::kNone) {
    out.refusal = detail::of_one_run(surface, model, mesh)
                      ? detail::mesh_refusal(mesh, model, surface.valid_time_ns, now_ns)
                      : MeshRefusal::kOtherSource;
  }
  if (out.refusal == MeshRefusal::kNone && !detail::move_mesh(mesh, model, surface, out)) {
    out.refusal = MeshRefusal::kMalformed;
  }
  return out.refusal == MeshRefusal::kNone || detail::leave_empty(out);
}

// Where a point (mm, W) that moves with `velocity_W_mm_per_s` is beside the surface, at the mesh's instant. It says
// nothing of a point that is beside what is known.
inline NearestPoint nearest(const PredictedMesh& mesh, const std::array<double, 3>& point_W_mm,
                            const std::array<double, 3>& velocity_W_mm_per_s = {}) noexcept {
  NearestPoint out;
  if (mesh.refusal != MeshRefusal::kNone || mesh.triangles.empty()) return out;
  out.refusal = PointRefusal::kNotANumber;
  if (!detail::finite(point_W_mm) || !detail::finite(velocity_W_mm_per_s)) return out;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best = 0;
  detail::Vector shares{};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const PredictedMesh::Triangle& corners = mesh.triangles[t];
    const detail::Vector& a = mesh.positions_W_mm[corners[0]];
    const detail::Vector& b = mesh.positions_W_mm[corners[1]];
    const detail::Vector& c = mesh.positions_W_mm[corners[2]];
    const detail::Vector of = detail::nearest_of_triangle(point_W_mm, a, b, c);
    detail::Vector to{};
    for (std::size_t i = 0; i < 3; ++i) to[i] = of[0] * a[i] + of[1] * b[i] + of[2] * c[i] - point_W_mm[i];
    const double d2 = detail::dot(to, to);
    if (d2 < least) {
      least = d2;
      best = t;
      shares = of;
    }
  }
  if (!std::isfinite(least)) return out;
  out.refusal = detail::on_border(mesh, best, shares) ? PointRefusal::kBeyondEdge : PointRefusal::kNone;
  if (out.refusal != PointRefusal::kNone) return out;
  const PredictedMesh::Triangle& corners = mesh.triangles[best];
  detail::Vector normal{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      out.point_W_mm[i] += shares[k] * mesh.positions_W_mm[corners[k]][i];
      out.velocity_W_mm_per_s[i] += shares[k] * mesh.velocities_W_mm_per_s[corners[k]][i];
      normal[i] += shares[k] * mesh.normals_W[corners[k]][i];
    }
  }
  normal = detail::unit(normal);
  const detail::Vector to = detail::minus(point_W_mm, out.point_W_mm);
  const bool in_front = detail::dot(to, normal) >= 0.0;
  out.distance_mm = in_front ? std::sqrt(least) : -std::sqrt(least);
  out.normal_W = normal;
  const detail::Vector relative = detail::minus(velocity_W_mm_per_s, out.velocity_W_mm_per_s);
  out.approach_mm_per_s = detail::dot(relative, normal);
  double variance = 0.0;
  // What the corners' errors have in common makes the point's no larger than their mean.
  for (std::size_t k = 0; k < 3; ++k) variance += shares[k] * detail::variance_along(mesh, corners[k], normal);
  out.deviation_mm = std::sqrt(std::max(variance, 0.0));
  return out;
}

// For people; never null.
inline const char* describe_mesh_reason(std::uint8_t reason) noexcept {
  switch (reason) {
    case perimap_MESH_REASON_NOT_YET:
      return "no surface has been made yet";
    case perimap_MESH_REASON_MAP_CHANGED:
      return "the map is being learnt anew";
    case perimap_MESH_REASON_TOO_FEW_FEATURES:
      return "too few features for a surface";
    case perimap_MESH_REASON_ON_A_LINE:
      return "the features lie on a line";
    case perimap_MESH_REASON_NOT_SMOOTH:
      return "no smooth surface goes through the features";
    case perimap_MESH_REASON_UNUSABLE:
      return "the features' numbers make no surface";
    case perimap_MESH_REASON_NOTHING_SUPPORTED:
      return "the features are too uncertain for a surface";
    case perimap_MESH_REASON_NOT_THE_MODEL:
      return "the model of the organ does not lie where the surface is seen";
    default:
      return "there is no surface, for a reason that this client does not know";
  }
}

inline const char* describe(const PredictedMesh& mesh) noexcept {
  switch (mesh.refusal) {
    case MeshRefusal::kModel:
      return describe(mesh.model_refusal, mesh.reason);
    case MeshRefusal::kStale:
      return "the surface is too old";
    case MeshRefusal::kNoSurface:
      return describe_mesh_reason(mesh.mesh_reason);
    case MeshRefusal::kOtherSource:
      return "surface and phases are of different sources";
    case MeshRefusal::kOtherLaw:
      return "the surface was made under another law of the motion";
    case MeshRefusal::kMalformed:
      return "the surface cannot be read";
    case MeshRefusal::kNone:
      break;
  }
  return mesh.state == perimap_SURFACE_GOOD ? "good" : describe(mesh.reason);
}

inline const char* describe(const NearestPoint& nearest) noexcept {
  switch (nearest.refusal) {
    case PointRefusal::kNoMesh:
      return "there is no surface";
    case PointRefusal::kNotANumber:
      return "the point is not a number";
    case PointRefusal::kBeyondEdge:
      return "beside what is known of the surface";
    case PointRefusal::kNone:
      break;
  }
  return "known";
}

}  // namespace perimap::client

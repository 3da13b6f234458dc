// Ground truth as recorded messages, and back.
#pragma once

#include <perimap.h>
#include <perimap_procedure.h>
#include <perimap_trace.h>

#include <cstdint>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/standins/truth/ground_truth.hpp"

namespace perimap {

// Borrows the mesh's numbers: the message must not outlive it, and must not be freed.
[[nodiscard]] perimap_TruthMesh borrow_truth_mesh(const HeartMesh& mesh_W);

// The R peaks go to `r_peaks_ns`, which the message borrows: it must not outlive it, and must not be freed.
[[nodiscard]] perimap_TruthMotion borrow_truth_motion(const HeartMotion& motion, std::vector<std::int64_t>& r_peaks_ns);

[[nodiscard]] perimap_TruthCamera to_truth_camera(const CameraTruth& camera) noexcept;

// What TruthProcedure borrows: it must outlive the message, which must not be freed.
struct ProcedureBuffers {
  std::vector<perimap_TruthOrganMove> moves;
  std::vector<perimap_TruthDelay> delays;
};
[[nodiscard]] perimap_TruthProcedure borrow_truth_procedure(const GroundTruth& truth, ProcedureBuffers& buffers);

// Into a truth that has its mesh and motion. Checked as an organ's motion must be; delays are in order and below a
// second.
[[nodiscard]] Expected<void> set_procedure(const perimap_TruthProcedure& message, GroundTruth& truth);

// What TruthTrace borrows: it must outlive the message, which must not be freed.
struct TraceBuffers {
  std::vector<double> places, displacements;
};
[[nodiscard]] perimap_TruthTrace borrow_truth_trace(const SurfaceTrace& trace, TraceBuffers& buffers);

// Of a trace that is there; GroundTruth::set_trace() checks it. Numbers that do not come in threes are refused here.
[[nodiscard]] Expected<SurfaceTrace> surface_trace(const perimap_TruthTrace& message);

// Checked as a mesh or motion must be; the error names what is wrong.
[[nodiscard]] Expected<HeartMesh> heart_mesh(const perimap_TruthMesh& message);
[[nodiscard]] Expected<HeartMotion> heart_motion(const perimap_TruthMotion& message);
[[nodiscard]] Expected<CameraTruth> camera_truth(const perimap_TruthCamera& message);

}  // namespace perimap

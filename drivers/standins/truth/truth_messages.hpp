// Ground truth as recorded messages, and back.
#pragma once

#include <perimap.h>

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

// Checked as a mesh or motion must be; the error names what is wrong.
[[nodiscard]] Expected<HeartMesh> heart_mesh(const perimap_TruthMesh& message);
[[nodiscard]] Expected<HeartMotion> heart_motion(const perimap_TruthMotion& message);
[[nodiscard]] Expected<CameraTruth> camera_truth(const perimap_TruthCamera& message);

}  // namespace perimap

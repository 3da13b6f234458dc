// A registration by landmarks, refined by a preoperative model of the organ against the surface that was published.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/registration/model_fit.hpp"
#include "daemon/refinement/published_surface.hpp"

namespace perimap {

struct RefinementSource {
  std::string model;         // the mesh
  double unit_mm = 1.0;      // of its lengths
  std::string recording;     // of what was published
  double cycle_share = 0.0;  // of the heart's cycle at which the model was imaged
  double cycle_share_deviation = 0.02;
  std::string registration;  // by landmarks; empty: the session was registered already, and starts there
  double start_mm = 3.0;     // how far off the start may be, where it does not tell: RMS, mm
  double start_rad = 0.0523598775598298873;  // likewise
  double shape_mm = 1.0;                     // of the model along its normal, standard deviation
  double shape_length_mm = 30.0;
  std::string compare;  // another registration to tell the difference from; empty: none
};

struct Refinement {
  PublishedSurface surface;
  ModelFit fit;
  std::vector<std::string> mesh_doubts;
  std::optional<RegistrationDifference> difference;  // from `compare`
  std::size_t border_edges = 0;                      // of the model: 0 of a closed one
};

// Fails as check_mesh(), fit_model() and read_published_surface() do, in the same words.
[[nodiscard]] Expected<Refinement> refine_registration(const RefinementSource& source);

}  // namespace perimap

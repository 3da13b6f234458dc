// A preoperative model that is set in motion, against the surface of the simulated heart.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/pipeline/phase_spread.hpp"
#include "core/surface/periodic_surface.hpp"
#include "core/surface/surface_mesh.hpp"
#include "daemon/evaluation/report/accuracy.hpp"

namespace perimap {

// Of a model that moves by itself: what the newest surface has of its motion.
struct ModelMotionFigures {
  int harmonics = 0;
  double residual_mm = kNoFigure;  // of its phases from the series
  struct Gain {
    int harmonic = 1;
    double in_step = 0.0;
    double out_of_step = 0.0;
    double deviation = 0.0;  // of each
  };
  std::vector<Gain> gains;  // of what is adopted
};

// Of supported vertices, over all instants.
struct ModelFigures {
  std::size_t vertices = 0;      // of the model
  double supported = kNoFigure;  // of them, mean of the instants
  double rms_mm = kNoFigure;     // distance from the true surface
  double p95_mm = kNoFigure;
  double nees = kNoFigure;  // of the distance along the true surface's normal: 1 when the deviation is right
  // Of the others, of which no feature tells.
  double unseen_rms_mm = kNoFigure;
  double unseen_nees = kNoFigure;
  std::optional<ModelMotionFigures> motion;
};

[[nodiscard]] std::optional<ModelMotionFigures> motion_figures(const PeriodicSurface& surface);

class ModelScore {
 public:
  // The mesh at a basis and at those about it (see bases_about), and where the heart is then, W.
  void add(const SurfaceMesh& mesh, const Basis& b, const BasesAbout& about, double breath_mm2,
           const TriangleMesh& truth);

  [[nodiscard]] ModelFigures figures() const;

 private:
  std::size_t vertices_ = 0;
  std::size_t instants_ = 0;
  std::vector<float> errors_mm_;
  double nees_ = 0.0;
  double unseen_mm2_ = 0.0;
  double unseen_nees_ = 0.0;
  std::size_t unseen_ = 0;
};

[[nodiscard]] nlohmann::json to_json(const ModelFigures& figures);
// A line without its end; empty where there is no model.
[[nodiscard]] std::string to_text(const ModelFigures& figures);

}  // namespace perimap

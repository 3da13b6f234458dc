// How far a surface is from the truth at the points that were seen.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/evaluation/surface/model_score.hpp"

namespace perimap {

// Further ahead of the instant for which a frame's surface is valid, ms.
inline constexpr std::array<int, 3> kSurfaceHorizons_ms = {0, 100, 300};

struct SurfaceFigures {
  std::size_t instants = 0;  // at which there was a surface and a phase, from 15 s on
  std::size_t points = 0;    // that were seen well, not on the rim, and supported at one
  struct Horizon {
    double rms_mm = kNoFigure;
    double nees = kNoFigure;  // e' P^-1 e / 3
  };
  std::array<Horizon, kSurfaceHorizons_ms.size()> horizons;  // of those points
  double p95_mm = kNoFigure;                                 // at the first horizon
  double rim_rms_mm = kNoFigure;             // of supported points within 5 mm of what was not seen well
  double rim_nees = kNoFigure;               // likewise, / 3
  double coverage = kNoFigure;               // supported share of what was seen well, mean of the instants from 15 s on
  double coverage_at_any_angle = kNoFigure;  // of what was seen at all
  double time_to_90_percent_s = kNoFigure;   // from the first frame
  // At points that lie within the features as well, so that all three have something to say of them.
  struct Compared {
    double rms_mm = kNoFigure;
    double p95_mm = kNoFigure;
  };
  Compared gaussian_process;
  Compared barycentric;
  Compared thin_plate;
  double agreement_rms_mm = kNoFigure;  // leave-one-out, of the last surface
  double agreement_nees = kNoFigure;
  std::size_t features = 0;         // that the last surface rests on
  std::size_t contradicted = 0;     // that it left out
  std::uint64_t begun = 0;          // new features that started on it, over the session
  std::uint64_t contradicting = 0;  // and whose matches contradicted it
  ModelFigures model;               // where the mesh is of a preoperative model
  std::string refusal;              // of the last instant at which there was none
};

// Takes what was predicted at instants that follow one another, and what was true.
class SurfaceTally {
 public:
  // An instant from 15 s on counts for all figures, an earlier one for the time to 90 % alone.
  void begin_instant(double t_s);
  // Of the instant, every point that was seen; call with all of them.
  void add_seen(bool supported, bool well = true);
  // What the instant's seen points came to.
  void end_instant();

  struct Error {
    std::size_t point = 0;
    bool on_rim = false;
    double error_mm = 0.0;
    double nees = 0.0;  // / 3
  };
  // Of a supported point.
  void add(std::size_t horizon, const Error& error);
  void add_compared(double gaussian_process_mm, double barycentric_mm, double thin_plate_mm);

  // The instant that was begun counts for all figures.
  [[nodiscard]] bool settled() const noexcept { return settled_; }
  [[nodiscard]] SurfaceFigures figures() const;

 private:
  struct Sums {
    double squares = 0.0;
    double nees = 0.0;
    std::size_t count = 0;
  };

  double t_s_ = 0.0;
  bool settled_ = false;
  std::size_t seen_ = 0;
  std::size_t supported_ = 0;
  std::size_t seen_at_all_ = 0;
  std::size_t supported_at_all_ = 0;
  std::size_t instants_ = 0;
  double coverages_ = 0.0;
  double coverages_at_any_angle_ = 0.0;
  double time_to_90_percent_s_ = kNoFigure;
  std::array<Sums, kSurfaceHorizons_ms.size()> horizons_;
  Sums rim_;
  std::vector<bool> scored_;  // by point
  std::vector<float> errors_mm_;
  std::array<std::vector<float>, 3> compared_mm_;
};

[[nodiscard]] nlohmann::json to_json(const SurfaceFigures& figures);
// A few lines, the last without a line end.
[[nodiscard]] std::string to_text(const SurfaceFigures& figures);

}  // namespace perimap

// The estimator's goals that can be tried with known phase and association (docs/evidence/estimation.md has what is
// reached), and those of the ECG side (docs/evidence/ecg.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/standins/truth/heart_mesh.hpp"
#include "drivers/standins/truth/heart_motion.hpp"
#include "goal_report.hpp"

namespace perimap::test {

// What displayed_ahead() simulates; empty lists and a duration of 0: as much as the extent asks for.
struct HorizonScenes {
  std::vector<std::string> records;
  std::vector<MotionLaw> laws;
  int width = 640;  // px
  int height = 480;
  int duration_s = 0;
};

struct Extent {
  bool whole = false;  // the long form
  std::uint64_t seed = 1;
  HorizonScenes horizons;
};

// No feature is lost, whatever depth it is supposed at and with gross outliers.
void no_feature_is_lost(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Path error against the batch estimate and the Cramer-Rao bound; covariances are true.
void as_exact_as_the_data_allow(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Process noise by evidence: a motion that drifts is followed, one that does not is none the worse.
void motion_that_drifts(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// A truth with more harmonics than the state: what each more of them brings.
void motion_with_many_harmonics(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Path error and covariance of a heart that breathing moves, both phases known.
void motion_that_breathes(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Path error and covariance with errors of the camera pose, white and slow, without and with the shared pose.
void pose_errors(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Path error and covariance of maps that learn with the phase of completed cycles, beside maps that learn at once.
void learning_late(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// New features beside a map: started from the surface through it, and from their own prior.
void starts_on_the_surface(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Beats found in real ECG records with disturbances added, and which rhythms are called unpredictable;
// docs/evidence/ecg.md.
void beats_under_disturbances(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Displayed positions some time ahead, by predictor, record and motion law; docs/evidence/accuracy.md.
void displayed_ahead(const Extent& extent, const HeartMesh& heart, GoalReport& report);
// Displayed positions of a heart that a ventilator moves too; docs/evidence/accuracy.md.
void ventilated(const Extent& extent, const HeartMesh& heart, GoalReport& report);

}  // namespace perimap::test

// One frame's facts that all features share.
#pragma once

#include <array>
#include <cstdint>

#include "core/estimation/shared_pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/phase/phase_law.hpp"
#include "core/pipeline/evaluation_plan.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/phase_spread.hpp"
#include "core/pipeline/scouts.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"
#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// Written by the mapper before a stage, read by all workers during it.
struct FrameJob {
  const FrameRecord* frame = nullptr;
  const FrameHistory* history = nullptr;
  // While features are searched for; `before`, the frame before, without pixels where there was none.
  GreyImage image;
  GreyImage before;
  const PatchTracker* tracker = nullptr;
  const PatchTracker* view_tracker = nullptr;  // of last views; null: they are not asked
  TemplateSettings templates;                  // what a template must be in these pictures
  bool scouting = false;  // some features are scouts, and the others are searched for once those have been
  CommonShift shift;      // that they tell
  BasesAbout about_capture;
  EvaluationPlan plan;
  std::array<Basis, kCovariances> evaluated_b;  // the bases at the plan's instants, with the phases as known now
  // After B: how the features found have moved, and the pose that they agree on; null when they do not tell it.
  const NeighbourMotion* motion = nullptr;
  const CommonEstimate* shared_pose = nullptr;
  FrameDoubts doubts;
  bool starts_fail_alike = false;  // of more features than have an estimate: it is not the single feature's fault
  bool surface_there = false;      // made of the mapped features, and good: others can start on it
  LawBelief law;                   // by which the history's phases are told
  Instant learn_until;             // learning that has not begun by then is put off; never in lockstep
};

}  // namespace perimap

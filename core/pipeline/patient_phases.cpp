#include "core/pipeline/patient_phases.hpp"

namespace perimap {
namespace {

HeartPhaseSettings heart_settings(const PipelineSettings& settings) noexcept {
  return {settings.law_from_image, settings.image_alone};
}

}  // namespace

PatientPhases::PatientPhases(const PipelineSettings& settings, PhaseCells& cells, PipelineCounters& counters)
    : settings_(settings),
      model_{settings.camera},
      cells_(cells),
      counters_(counters),
      heart_(heart_settings(settings)),
      breathing_(settings.respiration) {}

PatientPhases::Change PatientPhases::begin_frame(const CardiacClock& ecg, const FrameStamp& stamp,
                                                 const FrameHistory& history) noexcept {
  Change change;
  change.breath = breathing_.begin_frame(history);
  if (change.breath.map_changes()) heart_.forget_r_peaks();
  change.heart = heart_.begin_frame(ecg, stamp.arrival, stamp.capture);
  return change;
}

void PatientPhases::tell(FrameRecord& frame, FrameHistory& history) noexcept {
  history.set_phase(frame, heart_.clock(), breathing_.clock());
  breathing_.expect_displacement(frame);
}

const CommonEstimate* PatientPhases::settle(std::span<FeatureGroup> groups, const FrameRecord& frame) noexcept {
  const CommonEstimate* shared_pose = nullptr;
  const bool breath_known = frame.respiration.known;
  bool breath_told = false;
  if (settings_.phase_from_image || breath_known) {
    const ImagePhases seen = image_.observe(groups, frame, model_, settings_.estimator);
    shared_pose = image_.shared_pose();
    if (settings_.phase_from_image) {
      heart_.observe(seen.cardiac);
      if (seen.cardiac.outcome == ImagePhaseOutcome::kObserved) counters_.phases_from_image.add();
    }
    if (breath_known) breath_told = breathing_.observe(seen.respiratory, frame.stamp.capture);
  }
  Vector3d displacement_mm;
  if (breathing_.asks_for_displacement(frame, breath_told) &&
      image_.displacement(groups, frame, model_, settings_.estimator, displacement_mm)) {
    breathing_.add_displacement(frame, displacement_mm);
  }
  publish();
  return shared_pose;
}

void PatientPhases::publish() noexcept {
  const PhaseBelief heart = heart_.belief();
  cells_.publisher_heart.write(heart);
  cells_.status_heart.write(heart);
  const RespiratoryClock breath = breathing_.published();
  cells_.publisher_breath.write(breath);
  cells_.status_breath.write(breath);
}

void PatientPhases::forget() noexcept {
  heart_ = HeartPhase(heart_settings(settings_), heart_.beats());
  breathing_ = Breathing(settings_.respiration);
}

void PatientPhases::recall(const MapMemory& memory, Instant now) noexcept {
  breathing_.recall(memory.respiration, now);
  heart_.recall(memory.law);
}

}  // namespace perimap

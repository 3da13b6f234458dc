// What the pipeline counts for the status topic.
#pragma once

#include <array>
#include <cstddef>

#include "core/estimation/batch_status.hpp"
#include "core/pipeline/release_stream.hpp"
#include "core/realtime/counter.hpp"
#include "core/realtime/deadline.hpp"
#include "core/realtime/latency_histogram.hpp"

namespace perimap {

// Of one stream of surfaces. Written by the publisher thread.
struct StreamCounters {
  Counter samples;
  Counter samples_without_frame;
  Counter samples_from_late_update;
  Counter releases_missed;  // left out, because it was too late for them, see ReleasePlan
  Counter releases_late;    // written, but begun to be more than kOnTime after their deadline
  LatencyHistogram release_tardiness;
  LatencyHistogram dds_write;

  // Of one release: from its deadline to just before its write.
  void count_tardiness(Duration tardiness) noexcept {
    release_tardiness.add(tardiness);
    // Counted by itself, because the histogram is right to 1/16 only.
    if (tardiness > kOnTime) releases_late.add();
  }
};

// Each member is written by one thread, named here, and read by the status thread.
struct PipelineCounters {
  // camera thread
  Counter frames_received;
  Counter frames_dropped;  // gaps in the device's sequence, no free buffer, full ring of pixels or of stamps
  LatencyHistogram camera_delay;
  Counter last_frame_ns;
  // tracker thread
  Counter poses_received;
  Counter poses_invalid;  // the device said so: tool missing, out of volume
  Counter poses_dropped;  // full ring
  LatencyHistogram tracker_delay;
  LatencyHistogram tracker_interval;  // from one reading's stamp to the next one's
  Counter last_pose_ns;
  Counter last_good_pose_ns;
  // ECG thread
  Counter ecg_samples;
  Counter ecg_lead_off;  // samples that mean nothing: the device said so, or the line was flat for a second
  Counter ecg_dropped;   // gaps in the device's sequence
  Counter ecg_repeated;  // samples of either lead that came before, see RepeatedSamples
  LatencyHistogram ecg_delay;
  Counter last_ecg_ns;
  Counter last_good_ecg_ns;
  std::array<Counter, 2> ecg_leads;  // what the first and the second are good for: 1 + EcgSignal; 0: there is none
  // respiration thread
  Counter respiration_samples;
  Counter respiration_off;      // samples that mean nothing: the sensor is off
  Counter respiration_dropped;  // gaps in the device's sequence
  LatencyHistogram respiration_delay;
  Counter last_respiration_ns;
  Counter last_good_respiration_ns;
  // R-trigger thread
  Counter r_triggers;
  Counter r_triggers_dropped;  // gaps in the device's count
  LatencyHistogram r_trigger_delay;
  Counter last_r_trigger_ns;
  // mapper thread
  Counter frames;
  Counter frames_without_pose;
  Counter frames_without_phase;
  Counter phases_from_image;    // frames whose matches told the phase
  Counter poses_refused;        // stamps that go back in time
  Counter poses_repeated;       // bit for bit the reading before
  Counter frames_repeated;      // likewise, pictures
  Counter scope_read;           // 1: how the scope is turned in its camera head is read in this frame; 0: it is not
  Counter scope_rotation_urad;  // where its notch is then, 0 to 2 pi
  Counter scope_changed;        // 1: turned or zoomed otherwise than at first, without a calibration of that
  Counter scope_turns;          // how often it was turned or zoomed
  Counter scope_frames_unread;  // in which its notch was sought and not found, where its turns are calibrated
  Counter learning_put_off;
  Counter adoptions_late;
  Counter features_tracked;
  Counter features_starting;
  Counter features_converging;
  Counter features_converged;
  Counter features_inconsistent;
  Counter features_shed;  // not looked for now, see LoadShedding
  Counter times_shed;
  Counter features_lost_unseen;
  Counter features_lost_refused;
  Counter features_lost_unstarted;                    // too many failed starts
  std::array<Counter, kBatchStatuses> starts_failed;  // by BatchStatus
  Counter start_matches_needed;                       // K
  Counter start_matches_most;                         // see StartProgress
  Counter start_matches_mean;
  Counter maps_forgotten;   // by command, for a new patient
  Counter maps_moved;       // with the organ, by its tool or by command
  Counter moved_um;         // by how much the last time
  Counter moves_refused;    // since the organ did not rest, or was at its place
  Counter displaced;        // 1: the organ is not where the map has it, or the tracker errs; see OrganWatch
  Counter displaced_um;     // by how much then, root mean square over the features
  Counter displaced_cause;  // DisplacedCause
  Counter times_displaced;
  Counter features_started_anew;  // inconsistent, also after inflation
  LatencyHistogram predict_and_find;
  LatencyHistogram phase_and_pose;
  LatencyHistogram evaluate;
  LatencyHistogram learn;
  LatencyHistogram frame_compute;  // A, B, C and D of one frame together
  LatencyHistogram capture_to_update;
  // finder thread
  Counter searches_failed;
  // publisher thread
  Counter frames_too_late;
  Counter last_release_capture_ns;  // where the frame times go on after a restart
  Counter last_owed_sequence;       // the newest frame that has come and whose update a surface was to rest on
  Counter frame_period_ns;
  std::array<StreamCounters, kReleaseStreams.size()> streams;

  // What was kept of the map before is void.
  [[nodiscard]] std::uint64_t maps_ended() const noexcept { return maps_forgotten.get() + maps_moved.get(); }
  [[nodiscard]] std::uint64_t features_lost() const noexcept {
    return features_lost_unseen.get() + features_lost_refused.get() + features_lost_unstarted.get();
  }
  [[nodiscard]] std::uint64_t starts_failed_by(BatchStatus status) const noexcept {
    return starts_failed[static_cast<std::size_t>(status)].get();
  }
  [[nodiscard]] StreamCounters& of(ReleaseStream stream) noexcept { return streams[index_of(stream)]; }
  [[nodiscard]] const StreamCounters& of(ReleaseStream stream) const noexcept { return streams[index_of(stream)]; }
};

}  // namespace perimap

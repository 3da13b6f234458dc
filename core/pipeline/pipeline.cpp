#include "core/pipeline/pipeline.hpp"

#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

ComposerSettings composer_settings(const PipelineSettings& settings) {
  ComposerSettings composer;
  composer.layout = settings.estimator.layout;
  composer.lead = settings.lead;
  composer.validity = settings.validity;
  composer.maximum_features = static_cast<std::size_t>(settings.features.maximum);
  return composer;
}

}  // namespace

Pipeline::Pipeline(const PipelineSettings& settings)
    : settings_(settings),
      slots_(static_cast<std::size_t>(settings.features.maximum)),
      cells_(static_cast<std::size_t>(settings.workers)),
      entrance_(settings.camera.width, settings.camera.height, {settings.clock, settings.r_trigger},
                {settings.respiration.search.shortest_period, settings.respiration.search.longest_period}, counters_),
      team_(settings.workers),
      finder_(settings, counters_),
      starter_(settings, slots_),
      mapper_(settings, slots_, cells_, team_, finder_, starter_, phase_cells_, counters_),
      plan_({settings.latency, settings.frame_stream, settings.clock_period, settings.lead + settings.validity}),
      composers_{SurfaceComposer(composer_settings(settings)), SurfaceComposer(composer_settings(settings))},
      publisher_view_(cells_.size()),
      model_view_(cells_.size()) {
  if (settings.pose.error_correlation > Duration(0)) {
    for (FeatureSlot& slot : slots_) {
      slot.slow_error = std::make_unique<CorrelatedPoseNoise>(settings.estimator.layout.state_size(),
                                                              to_seconds(settings.pose.error_correlation));
    }
  }
  for (ShardCells& cells : cells_) {
    for (TripleBuffer<ShardSnapshot>* cell : {&cells.publisher, &cells.model}) {
      // Each of the three copies needs its own reserve: copying a vector does not copy its capacity.
      for (int i = 0; i < 3; ++i) {
        cell->back().features.reserve(slots_.size());
        cell->publish();
        cell->update();
      }
    }
  }
  (void)model_snapshots();  // so that model_view_ holds no null
}

void Pipeline::drain_poses() noexcept {
  const RealtimeScope realtime;
  TrackerSample sample;
  while (entrance_.pop_pose(sample)) mapper_.add_pose(sample);
}

void Pipeline::map(const FrameHandle& frame) noexcept {
  const RealtimeScope realtime;
  TripleBuffer<CardiacClock>& ecg = entrance_.ecg_clocks().mapper;
  ecg.update();
  if (settings_.respiration.channel) mapper_.hear_breath(entrance_.breath(), frame.stamp.capture);
  mapper_.process(frame.stamp, entrance_.image(frame), entrance_.colour(frame), ecg.front());
  entrance_.give_back(frame);
  mapper_.beside_learning();
}

void Pipeline::ask_to_forget() noexcept {
  entrance_.ask_to_forget();
  forget_asked_.store(true, std::memory_order_relaxed);
  entrance_.mapper_wakeup().post();
}

void Pipeline::forget_if_asked() noexcept {
  if (forget_asked_.exchange(false, std::memory_order_relaxed)) mapper_.forget();
}

void Pipeline::recall(const MapMemory& memory, Instant now) {
  for (const EcgBlock& block : memory.ecg) entrance_.recall_ecg(block);
  mapper_.recall(memory, now);
  plan_.resume(memory.last_capture, memory.frame_period, now);
}

void Pipeline::drain_stamps(Instant now) noexcept {
  const RealtimeScope realtime;
  FrameStamp stamp;
  while (entrance_.pop_stamp(stamp)) {
    if (!plan_.on_frame(stamp, now)) counters_.frames_too_late.add();
  }
}

void Pipeline::leave_out_missed(Instant now) noexcept {
  const RealtimeScope realtime;
  const MissedReleases missed = plan_.leave_out_missed(now);
  for (const ReleaseStream stream : kReleaseStreams) {
    if (missed[index_of(stream)] > 0) counters_.of(stream).releases_missed.add(missed[index_of(stream)]);
  }
  plan_.let_come_due(now);
  tell_due();
}

void Pipeline::tell_due() noexcept {
  counters_.last_release_capture_ns.set(static_cast<std::uint64_t>(to_ns(plan_.last_due().capture)));
  counters_.last_owed_sequence.set(plan_.last_owed());
  counters_.frame_period_ns.set(static_cast<std::uint64_t>(plan_.frame_period().count()));
}

void Pipeline::sent(const SurfaceSample& sample) noexcept {
  const RealtimeScope realtime;
  StreamCounters& stream = counters_.of(sample.release.stream);
  stream.samples.add();
  if (sample.release.frame_missing) stream.samples_without_frame.add();
  if (sample.update_late) stream.samples_from_late_update.add();
}

void Pipeline::take_back(const SurfaceSample& sample) noexcept {
  const RealtimeScope realtime;
  counters_.of(sample.release.stream).releases_missed.add();
  composers_[index_of(sample.release.stream)].take_back();
}

const SurfaceSample& Pipeline::compose(const Release& release) noexcept {
  const RealtimeScope realtime;
  TripleBuffer<CardiacClock>& ecg = entrance_.ecg_clocks().publisher;
  ecg.update();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cells_[i].publisher.update();
    publisher_view_[i] = &cells_[i].publisher.front();
  }
  phase_cells_.publisher_heart.update();
  phase_cells_.publisher_breath.update();
  const CardiacClock heart = phase_cells_.publisher_heart.front().clock(ecg.front(), release.deadline);
  const SurfaceSample& sample = composers_[index_of(release.stream)].compose(
      release, heart, phase_cells_.publisher_breath.front(), publisher_view_);
  tell_due();
  return sample;
}

CardiacClock Pipeline::status_clock(Instant now) noexcept {
  TripleBuffer<CardiacClock>& ecg = entrance_.ecg_clocks().status;
  ecg.update();
  phase_cells_.status_heart.update();
  return phase_cells_.status_heart.front().clock(ecg.front(), now);
}

RespiratoryClock Pipeline::status_respiration() noexcept {
  phase_cells_.status_breath.update();
  return phase_cells_.status_breath.front();
}

std::span<const ShardSnapshot* const> Pipeline::model_snapshots() noexcept {
  // Before they are taken: a release that falls due afterwards asks nothing of them.
  model_owes_ = counters_.last_owed_sequence.get();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cells_[i].model.update();
    model_view_[i] = &cells_[i].model.front();
  }
  return model_view_;
}

SurfaceFooting Pipeline::model_footing(const RespiratoryClock& respiration, Instant now) const noexcept {
  SurfaceFooting footing = footing_of(model_view_);
  footing.breath_doubtful = respiration.doubtful();
  for (const ShardSnapshot* snapshot : model_view_) {
    footing.update_late =
        footing.update_late || !snapshot->any || snapshot->recalled || snapshot->frame_sequence < model_owes_;
  }
  // As the schedule has it: the frame after the last one, half a period late, has passed its release.
  const auto last = from_ns(static_cast<std::int64_t>(counters_.last_frame_ns.get()));
  const Duration period(static_cast<std::int64_t>(counters_.frame_period_ns.get()));
  footing.frame_missing = now > last + period + period / 2 + settings_.latency;
  return footing;
}

}  // namespace perimap

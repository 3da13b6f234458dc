#include "core/pipeline/pipeline.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/mapper.hpp"
#include "core/pipeline/phase_cells.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/scope_watch.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_composer.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "core/pipeline/surface_state.hpp"
#include "core/realtime/realtime_scope.hpp"
#include "core/realtime/worker_team.hpp"

namespace perimap {
namespace {

// Of the surface that is handed over, over all that is supported: 2 to 3 mm apart on a heart.
constexpr std::size_t kMeshVertices = 1000;

ComposerSettings composer_settings(const PipelineSettings& settings) {
  ComposerSettings composer;
  composer.layout = settings.estimator.layout;
  composer.lead = settings.lead;
  composer.validity = settings.validity;
  composer.use_within_mm = settings.use_within_mm;
  composer.maximum_features = static_cast<std::size_t>(settings.features.maximum);
  return composer;
}

}  // namespace

// In the order in which they are made: each may refer to those before it.
struct Pipeline::Parts {
  Parts(const PipelineSettings& of, FrameTrace* kept_trace);

  void tell_due() noexcept;

  PipelineSettings settings;
  PipelineCounters counters;
  FrameTrace* trace;  // null where none is kept
  std::vector<FeatureSlot> slots;
  std::vector<ShardCells> cells;
  SensorEntrance entrance;
  WorkerTeam team;
  FeatureFinder finder;
  SurfaceMaker surface_maker;
  BatchStarter starter;
  SetupWatcher watcher;
  std::unique_ptr<ScopeWatch> scope;  // null where pictures are not asked how the scope is turned
  PhaseCells phase_cells;
  Mapper mapper;
  FrameHandle mapped_before;  // its buffer is still taken; without one before the first frame
  ReleasePlan plan;
  std::array<SurfaceComposer, kReleaseStreams.size()> composers;  // one a stream
  CardiacClock composed_heart;                                    // of the last release
  // Relaxed: a message by itself; the mapper's wake-up follows it.
  std::atomic<bool> forget_asked{false};
  std::atomic<bool> move_asked{false};
  std::vector<const ShardSnapshot*> publisher_view;
  std::vector<const ShardSnapshot*> model_view;
  std::uint64_t model_owes = 0;  // the frame whose update the snapshots of model_view ought to have
};

Pipeline::Parts::Parts(const PipelineSettings& of, FrameTrace* kept_trace)
    : settings(of),
      trace(kept_trace),
      slots(static_cast<std::size_t>(settings.features.maximum)),
      cells(static_cast<std::size_t>(settings.workers)),
      entrance(
          settings.camera.width, settings.camera.height, {settings.clock, settings.r_trigger, settings.ecg_may_loop},
          {settings.respiration.search.shortest_period, settings.respiration.search.longest_period}, counters, trace),
      team(settings.workers),
      finder(settings, counters),
      surface_maker(settings.estimator.layout, slots.size(), kMeshVertices, settings.lockstep, settings.organ_model),
      starter(settings, slots, surface_maker),
      watcher(settings),
      scope(settings.turned_scope || settings.watch_scope ? std::make_unique<ScopeWatch>(settings, counters) : nullptr),
      mapper(settings, slots, team, {finder, starter, watcher, surface_maker, scope.get()},
             {cells, phase_cells, counters, trace}),
      plan({settings.latency, settings.frame_stream, settings.clock_period, settings.lead + settings.validity}),
      composers{SurfaceComposer(composer_settings(settings)), SurfaceComposer(composer_settings(settings))},
      publisher_view(cells.size()),
      model_view(cells.size()) {
  if (settings.pose.error_correlation > Duration(0)) {
    for (FeatureSlot& slot : slots) {
      slot.slow_error = std::make_unique<CorrelatedPoseNoise>(settings.estimator.layout.state_size(),
                                                              to_seconds(settings.pose.error_correlation));
    }
  }
  for (ShardCells& shard : cells) {
    for (TripleBuffer<ShardSnapshot>* cell : {&shard.publisher, &shard.model}) {
      // Each of the three copies needs its own reserve: copying a vector does not copy its capacity.
      for (int i = 0; i < 3; ++i) {
        cell->back().features.reserve(slots.size());
        cell->publish();
        cell->update();
      }
    }
  }
}

Pipeline::Pipeline(const PipelineSettings& settings, FrameTrace* trace)
    : parts_(std::make_unique<Parts>(settings, trace)) {
  static_cast<void>(model_snapshots());  // so that model_view holds no null
}

Pipeline::~Pipeline() = default;

const PipelineSettings& Pipeline::settings() const noexcept { return parts_->settings; }
PipelineCounters& Pipeline::counters() noexcept { return parts_->counters; }
FrameTrace* Pipeline::trace() noexcept { return parts_->trace; }
SensorEntrance& Pipeline::entrance() noexcept { return parts_->entrance; }
WorkerTeam& Pipeline::team() noexcept { return parts_->team; }
FeatureFinder& Pipeline::finder() noexcept { return parts_->finder; }
BatchStarter& Pipeline::starter() noexcept { return parts_->starter; }
SetupWatcher& Pipeline::setup_watcher() noexcept { return parts_->watcher; }
SurfaceMaker& Pipeline::surface_maker() noexcept { return parts_->surface_maker; }
ScopeWatch* Pipeline::scope() noexcept { return parts_->scope.get(); }
ReleasePlan& Pipeline::plan() noexcept { return parts_->plan; }
std::span<const FeatureSlot> Pipeline::slots() const noexcept { return parts_->slots; }
bool Pipeline::pose_reached(Instant t) const noexcept { return parts_->mapper.pose_reached(t); }
MapFeed& Pipeline::map_feed() noexcept { return parts_->mapper.feed(); }

void Pipeline::drain_poses() noexcept {
  const RealtimeScope realtime;
  TrackerSample sample;
  while (parts_->entrance.pop_pose(sample)) parts_->mapper.add_pose(sample);
  ToolPose tool;
  while (parts_->entrance.pop_tool_pose(tool)) parts_->mapper.add_tool_pose(tool);
}

void Pipeline::map(const FrameHandle& frame) noexcept {
  const RealtimeScope realtime;
  TripleBuffer<CardiacClock>& ecg = parts_->entrance.ecg_clocks().mapper;
  ecg.update();
  if (parts_->settings.respiration.channel) parts_->mapper.hear_breath(parts_->entrance.breath(), frame.stamp.capture);
  SensorEntrance& entrance = parts_->entrance;
  const bool first = parts_->mapped_before.buffer < 0;
  parts_->mapper.process(frame.stamp, entrance.image(frame),
                         first ? GreyImage{} : entrance.image(parts_->mapped_before), entrance.colour(frame),
                         ecg.front());
  // The next one's features are sought in it too.
  if (!first) parts_->entrance.give_back(parts_->mapped_before);
  parts_->mapped_before = frame;
  parts_->mapper.beside_learning();
}

void Pipeline::ask_to_forget() noexcept {
  parts_->entrance.ask_to_forget();
  parts_->forget_asked.store(true, std::memory_order_relaxed);
  parts_->entrance.mapper_wakeup().post();
}

void Pipeline::forget_if_asked() noexcept {
  if (parts_->forget_asked.exchange(false, std::memory_order_relaxed)) parts_->mapper.forget();
}

void Pipeline::ask_to_move_map() noexcept {
  parts_->move_asked.store(true, std::memory_order_relaxed);
  parts_->entrance.mapper_wakeup().post();
}

bool Pipeline::take_back_move() noexcept { return parts_->move_asked.exchange(false, std::memory_order_relaxed); }

void Pipeline::move_map_if_asked() noexcept {
  if (parts_->move_asked.exchange(false, std::memory_order_relaxed)) parts_->mapper.move_map();
}

void Pipeline::recall(const MapMemory& memory, Instant now) {
  for (const EcgBlock& block : memory.ecg) parts_->entrance.recall_ecg(block);
  parts_->mapper.recall(memory, now);
  parts_->plan.resume(memory.last_capture, memory.frame_period, now);
}

void Pipeline::drain_stamps(Instant now) noexcept {
  const RealtimeScope realtime;
  FrameStamp stamp;
  while (parts_->entrance.pop_stamp(stamp)) {
    if (!parts_->plan.on_frame(stamp, now)) parts_->counters.frames_too_late.add();
  }
}

void Pipeline::leave_out_missed(Instant now) noexcept {
  const RealtimeScope realtime;
  const MissedReleases missed = parts_->plan.leave_out_missed(now);
  for (const ReleaseStream stream : kReleaseStreams) {
    if (missed[index_of(stream)] > 0) parts_->counters.of(stream).releases_missed.add(missed[index_of(stream)]);
  }
  parts_->plan.let_come_due(now);
  parts_->tell_due();
}

void Pipeline::Parts::tell_due() noexcept {
  counters.last_release_capture_ns.set(static_cast<std::uint64_t>(to_ns(plan.last_due().capture)));
  counters.last_owed_sequence.set(plan.last_owed());
  counters.frame_period_ns.set(static_cast<std::uint64_t>(plan.frame_period().count()));
}

void Pipeline::sent(const SurfaceSample& sample) noexcept {
  const RealtimeScope realtime;
  StreamCounters& stream = parts_->counters.of(sample.release.stream);
  stream.samples.add();
  if (sample.release.frame_missing) stream.samples_without_frame.add();
  if (sample.update_late) stream.samples_from_late_update.add();
}

void Pipeline::take_back(const SurfaceSample& sample) noexcept {
  const RealtimeScope realtime;
  parts_->counters.of(sample.release.stream).releases_missed.add();
  parts_->composers[index_of(sample.release.stream)].take_back();
}

const SurfaceSample& Pipeline::compose(const Release& release) noexcept {
  const RealtimeScope realtime;
  TripleBuffer<CardiacClock>& ecg = parts_->entrance.ecg_clocks().publisher;
  ecg.update();
  for (std::size_t i = 0; i < parts_->cells.size(); ++i) {
    parts_->cells[i].publisher.update();
    parts_->publisher_view[i] = &parts_->cells[i].publisher.front();
  }
  parts_->phase_cells.publisher_heart.update();
  parts_->phase_cells.publisher_breath.update();
  parts_->composed_heart = parts_->phase_cells.publisher_heart.front().clock(ecg.front(), release.deadline);
  const SurfaceSample& sample = parts_->composers[index_of(release.stream)].compose(
      release, parts_->composed_heart, parts_->phase_cells.publisher_breath.front(), parts_->publisher_view);
  parts_->tell_due();
  return sample;
}

const CardiacClock& Pipeline::composed_heart() const noexcept { return parts_->composed_heart; }
const RespiratoryClock& Pipeline::composed_breath() const noexcept {
  return parts_->phase_cells.publisher_breath.front();
}

CardiacClock Pipeline::status_clock(Instant now) noexcept {
  TripleBuffer<CardiacClock>& ecg = parts_->entrance.ecg_clocks().status;
  ecg.update();
  parts_->phase_cells.status_heart.update();
  return parts_->phase_cells.status_heart.front().clock(ecg.front(), now);
}

RespiratoryClock Pipeline::status_respiration() noexcept {
  parts_->phase_cells.status_breath.update();
  return parts_->phase_cells.status_breath.front();
}

std::span<const ShardSnapshot* const> Pipeline::model_snapshots() noexcept {
  // Before they are taken: a release that falls due afterwards asks nothing of them.
  parts_->model_owes = parts_->counters.last_owed_sequence.get();
  for (std::size_t i = 0; i < parts_->cells.size(); ++i) {
    parts_->cells[i].model.update();
    parts_->model_view[i] = &parts_->cells[i].model.front();
  }
  return parts_->model_view;
}

SurfaceFooting Pipeline::model_footing(const RespiratoryClock& respiration, Instant now) const noexcept {
  SurfaceFooting footing = footing_of(parts_->model_view);
  footing.breath_doubtful = respiration.doubtful();
  for (const ShardSnapshot* snapshot : parts_->model_view) {
    footing.update_late =
        footing.update_late || !snapshot->any || snapshot->recalled || snapshot->frame_sequence < parts_->model_owes;
  }
  // As the schedule has it: the frame after the last one, half a period late, has passed its release.
  const auto last = from_ns(static_cast<std::int64_t>(parts_->counters.last_frame_ns.get()));
  const Duration period(static_cast<std::int64_t>(parts_->counters.frame_period_ns.get()));
  footing.frame_missing = now > last + period + period / 2 + parts_->settings.latency;
  return footing;
}

}  // namespace perimap

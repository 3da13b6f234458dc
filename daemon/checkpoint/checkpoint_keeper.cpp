#include "daemon/checkpoint/checkpoint_keeper.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <system_error>
#include <utility>
#include <vector>

#include "core/pipeline/map_feed.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/checkpoint/warm_restart.hpp"

namespace perimap {
namespace {

constexpr Duration kLongestWait = std::chrono::milliseconds(100);

}  // namespace

CheckpointKeeper::CheckpointKeeper(Pipeline& pipeline, std::filesystem::path file, SetUp set_up, Duration interval)
    : pipeline_(pipeline), file_(std::move(file)), set_up_(std::move(set_up)), interval_(interval) {}

std::unique_ptr<CheckpointKeeper> CheckpointKeeper::go_on_from(const std::filesystem::path& file,
                                                               const Configuration& configuration, Pipeline& pipeline) {
  const SetUp set_up = set_up_of(configuration, pipeline.settings());
  auto keeper = std::make_unique<CheckpointKeeper>(pipeline, file, set_up, configuration.checkpoint.interval);
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return keeper;
  const Expected<MapMemory> memory = load_memory(file, set_up, configuration.checkpoint.maximum_age);
  if (!memory) {
    spdlog::warn("the map starts empty: {}", memory.error().message);
    return keeper;
  }
  pipeline.recall(*memory, MonotonicClock::now());
  keeper->begin_with(*memory);
  if (!memory->setup.asked) {
    spdlog::info("nothing was known of the set-up when it was kept: no feature is called converged until it is asked");
  }
  spdlog::info("going on from {}: {} features", file.string(), memory->features.size());
  return keeper;
}

void CheckpointKeeper::begin_with(const MapMemory& memory) {
  std::size_t slot = 0;
  for (const FeatureMemory& feature : memory.features) features_[slot++] = serialize_feature(feature);
  respiration_ = memory.respiration;
  law_ = memory.law;
  setup_ = memory.setup;
  for (const EcgBlock& block : memory.ecg) ecg_.add(block);
}

void CheckpointKeeper::run() {
  Instant next = MonotonicClock::now() + interval_;
  while (!stopping_.load(std::memory_order_relaxed)) {
    pipeline_.map_feed().wait_until(std::min(next, MonotonicClock::now() + kLongestWait));
    const std::lock_guard lock(mutex_);
    notice_forgotten_map();
    take_map();
    take_ecg();
    if (MonotonicClock::now() < next) continue;
    write();
    next = MonotonicClock::now() + interval_;
  }
}

void CheckpointKeeper::notice_forgotten_map() {
  const std::uint64_t forgotten = pipeline_.counters().maps_forgotten.get();
  const std::uint64_t moved = pipeline_.counters().maps_moved.get();
  if (moved != maps_moved_) features_.clear();
  maps_moved_ = moved;
  if (forgotten == maps_forgotten_) return;
  maps_forgotten_ = forgotten;
  forgetting_ = false;
  let_go();
}

void CheckpointKeeper::take_map() {
  const MapFeed::Batch* batch = pipeline_.map_feed().front();
  if (batch == nullptr) return;
  const bool of_this_map = !forgetting_ && batch->maps_ended == pipeline_.counters().maps_ended();
  respiration_ = of_this_map ? batch->respiration : RespirationMemory{};
  law_ = of_this_map ? batch->law : LawMemory{};
  setup_ = batch->setup;  // no patient's
  for (const MapFeed::Entry& entry : batch->entries) {
    if (entry.mapped && of_this_map) {
      features_[entry.slot] = serialize_feature(entry.feature);
    } else {
      features_.erase(entry.slot);
    }
  }
  pipeline_.map_feed().give_back();
}

void CheckpointKeeper::take_ecg() {
  EcgBlock block;
  while (pipeline_.entrance().pop_heard_ecg(block)) ecg_.add(block);
}

void CheckpointKeeper::write() {
  if (features_.empty()) return;
  const Now now = this_boot_now();
  Checkpoint checkpoint{set_up_, now.boot, now.monotonic, now.utc_ns, now.suspended, {}};
  checkpoint.memory.ecg.assign(ecg_.blocks().begin(), ecg_.blocks().end());
  checkpoint.memory.respiration = respiration_;
  checkpoint.memory.law = law_;
  checkpoint.memory.setup = setup_;
  const PipelineCounters& counters = pipeline_.counters();
  checkpoint.memory.last_capture = from_ns(static_cast<std::int64_t>(counters.last_release_capture_ns.get()));
  checkpoint.memory.frame_period = Duration(static_cast<std::int64_t>(counters.frame_period_ns.get()));
  std::vector<std::string> features;
  features.reserve(features_.size());
  for (const auto& [slot, bytes] : features_) features.push_back(bytes);
  const Expected<void> written = replace_file(file_, serialize(checkpoint, features));
  if (!written && !write_failed_) spdlog::error("no checkpoint: {}", written.error().message);
  write_failed_ = !written;
}

void CheckpointKeeper::forget(std::uint64_t forgotten_before) {
  const std::lock_guard lock(mutex_);
  maps_forgotten_ = pipeline_.counters().maps_forgotten.get();
  // Not against what was last noticed: run() may have noticed this very one already.
  forgetting_ = maps_forgotten_ == forgotten_before;
  let_go();
}

void CheckpointKeeper::let_go() {
  take_ecg();
  features_.clear();
  respiration_ = {};
  law_ = {};
  ecg_.clear();
  if (const auto removed = remove_file(file_); !removed) {
    spdlog::error("the old patient's checkpoint stays: {}", removed.error().message);
  }
}

}  // namespace perimap

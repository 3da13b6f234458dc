// What one who keeps a run has got of it, as CheckpointKeeper has.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "core/pipeline/map_feed.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/sensor_entrance.hpp"

namespace perimap::test {

class KeptMap {
 public:
  void take(Pipeline& pipeline) {
    if (const MapFeed::Batch* batch = pipeline.map_feed().front()) {
      for (const MapFeed::Entry& entry : batch->entries) {
        if (entry.mapped) {
          features_[entry.slot] = entry.feature;
        } else {
          features_.erase(entry.slot);
        }
      }
      respiration_ = batch->respiration;
      law_ = batch->law;
      setup_ = batch->setup;
      pipeline.map_feed().give_back();
    }
    EcgBlock block;
    while (pipeline.entrance().pop_heard_ecg(block)) ecg_.push_back(block);
  }
  [[nodiscard]] MapMemory memory(const PipelineCounters& counters) const {
    MapMemory memory;
    for (const auto& [slot, feature] : features_) memory.features.push_back(feature);
    memory.respiration = respiration_;
    memory.law = law_;
    memory.setup = setup_;
    memory.ecg = ecg_;
    memory.last_capture = from_ns(static_cast<std::int64_t>(counters.last_release_capture_ns.get()));
    memory.frame_period = Duration(static_cast<std::int64_t>(counters.frame_period_ns.get()));
    return memory;
  }

 private:
  std::map<std::size_t, FeatureMemory> features_;
  RespirationMemory respiration_;
  LawMemory law_;
  SetupMemory setup_;
  std::vector<EcgBlock> ecg_;
};

}  // namespace perimap::test

// Keeps what a crash must not take: writes checkpoints while the pipeline runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "core/pipeline/map_memory.hpp"
#include "daemon/checkpoint/checkpoint_file.hpp"
#include "daemon/checkpoint/recent_ecg.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

class Pipeline;

// run() takes the mapped features from the pipeline as they come, some a frame, breathing, the belief in the set-up,
// and the ECG; every `interval` it replaces the file. None of it is on the real-time path.
class CheckpointKeeper {
 public:
  // Before the pipeline runs: it takes up what an earlier run left in the file, when it may; the log says what came of
  // it.
  [[nodiscard]] static std::unique_ptr<CheckpointKeeper> go_on_from(const std::filesystem::path& file,
                                                                    const Configuration& configuration,
                                                                    Pipeline& pipeline);
  CheckpointKeeper(Pipeline& pipeline, std::filesystem::path file, SetUp set_up, Duration interval);

  // On the calling thread until stop(). What can not be written is logged once and tried again.
  void run();
  void stop() noexcept { stopping_.store(true, std::memory_order_relaxed); }

  // Any thread, once the pipeline has been asked to forget the map: the file goes, and nothing of that map is written
  // again, however long the pipeline takes. `forgotten_before`: its count of forgotten maps before it was asked. (That
  // it has forgotten without a word of this, run() notices.)
  void forget(std::uint64_t forgotten_before);

 private:
  // What the pipeline has recalled, so that a crash that follows soon takes nothing either.
  void begin_with(const MapMemory& memory);
  void notice_forgotten_map();
  void let_go();
  void take_map();
  void take_ecg();
  void write();

  Pipeline& pipeline_;
  std::filesystem::path file_;
  SetUp set_up_;
  Duration interval_;
  std::mutex mutex_;                             // of what follows, between run() and forget()
  std::map<std::size_t, std::string> features_;  // by slot, serialized
  RespirationMemory respiration_;
  LawMemory law_;
  SetupMemory setup_;
  RecentEcg ecg_;
  std::uint64_t maps_moved_ = 0;
  std::uint64_t maps_forgotten_ = 0;  // before the map that is kept
  bool forgetting_ = false;           // that map is to go, and the pipeline still has it: nothing is kept
  bool write_failed_ = false;
  // Relaxed: a message by itself.
  std::atomic<bool> stopping_{false};
};

}  // namespace perimap

// From ECG samples or R triggers to the phase clock: what the ECG thread does with each block or pulse.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "core/phase/beat_classer.hpp"
#include "core/phase/beat_finder.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/r_trigger.hpp"
#include "core/phase/repeated_samples.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/triple_buffer.hpp"
#include "core/sensors/device_count.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/r_trigger_pulse.hpp"

namespace perimap {

// The ECG thread is the one writer of the clock. A triple buffer serves one reader, so there is a cell per reader.
struct EcgClockCells {
  TripleBuffer<CardiacClock> mapper;
  TripleBuffer<CardiacClock> publisher;
  TripleBuffer<CardiacClock> status;
};

struct EcgIntakeSettings {
  CardiacClockSettings clock;
  std::optional<RTriggerSettings> r_trigger;  // none: the beats are found in the samples
  bool may_loop = false;                      // a record is played again and again in the patient's place
};

class EcgIntake {
 public:
  EcgIntake(const EcgIntakeSettings& settings, EcgClockCells& cells, PipelineCounters& counters) noexcept
      : settings_(settings), tracker_(settings.clock), cells_(cells), counters_(counters) {
    if (settings.r_trigger) trigger_.emplace(*settings.r_trigger);
  }

  // With a trigger, samples are counted and told of, no more.
  void push(const EcgBlock& block) noexcept;
  // Without a trigger configured, pulses are counted, no more. One thread pushes pulses, another may push samples.
  void push(const RTriggerPulse& pulse) noexcept;

  // Before the first push(): hears a block of an earlier run again, uncounted.
  void recall(const EcgBlock& block) noexcept;
  // One other thread: the blocks as they came, as many as were not taken too late; false when there is none.
  [[nodiscard]] bool pop_heard(EcgBlock& block) noexcept { return heard_.pop(block); }

  // Any thread: before the next block (with a trigger, the next pulse) everything learnt of this patient's beats and
  // rhythm is forgotten.
  void ask_to_forget() noexcept { forget_asked_.store(true, std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kHeardBlocks = 256;

  void forget_when_asked() noexcept;
  void count(const EcgBlock& block) noexcept;
  [[nodiscard]] EcgBlock without_repeated(const EcgBlock& block) noexcept;
  // Of both leads, since the first block.
  [[nodiscard]] std::uint64_t repeated_samples() const noexcept { return repeated_[0].count() + repeated_[1].count(); }
  void hear(const EcgBlock& block) noexcept;
  void tell_of_leads(const EcgBlock& block) noexcept;
  void publish() noexcept;

  EcgIntakeSettings settings_;
  std::array<RepeatedSamples, 2> repeated_;  // by lead
  BeatFinder beats_;
  std::optional<RTrigger> trigger_;
  BeatClasser trigger_classer_;
  CardiacClockTracker tracker_;
  EcgClockCells& cells_;
  PipelineCounters& counters_;
  SpscRing<EcgBlock> heard_{kHeardBlocks};
  DeviceCount sample_count_;
  DeviceCount pulse_count_;
  std::atomic<bool> forget_asked_{false};  // relaxed: a message by itself
};

}  // namespace perimap

// Whether a lead gives again, bit for bit, what it gave seconds before: a device that has hung and plays its memory, or
// a record in the place of a patient. A sensor has noise, so that a second of it never comes twice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap {

// Looks for the last few samples among those of the last 20 s, and follows them from there as long as they agree. Told
// is a run of a second or more in which the line has moved as a heart beat moves it: one that stands still repeats
// itself and is flat. Nothing is allocated once made.
class RepeatedSamples {
 public:
  RepeatedSamples();

  // The next sample; `period`: from the one before.
  void add(float mV, Duration period) noexcept;
  // What comes next is not what follows on the last one.
  void interrupt() noexcept {
    lag_ = run_ = since_ = 0;
    told_ = false;
  }

  // The last sample belongs to such a run.
  [[nodiscard]] bool told() const noexcept { return told_; }
  // All that were told, from the runs' beginnings on.
  [[nodiscard]] std::uint64_t count() const noexcept { return counted_; }

 private:
  static constexpr std::size_t kCapacity = std::size_t{1} << 16;  // 20 s of 3000 samples a second
  static constexpr std::size_t kPlaces = std::size_t{1} << 16;
  static constexpr std::uint64_t kWord = 8;  // samples by which a place is known

  [[nodiscard]] float back(std::uint64_t samples) const noexcept { return ring_[(count_ - samples) % kCapacity]; }
  [[nodiscard]] std::size_t place_of_word() const noexcept;
  void begin_run(std::uint64_t place, std::uint64_t longest_lag) noexcept;
  void widen(float mV) noexcept;

  std::vector<float> ring_;
  std::vector<std::uint64_t> places_;  // where the word with this hash ended last, from 1
  std::uint64_t count_ = 0;            // samples so far
  std::uint64_t since_ = 0;            // of them since what was missing
  std::uint64_t lag_ = 0;              // so many samples ago is what comes now; 0: it is new
  std::uint64_t run_ = 0;              // samples that have agreed
  float lowest_mV_ = 0.0F;             // of the run
  float highest_mV_ = 0.0F;
  bool told_ = false;
  std::uint64_t counted_ = 0;
};

}  // namespace perimap

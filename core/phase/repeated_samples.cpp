#include "core/phase/repeated_samples.hpp"

#include <algorithm>
#include <bit>

namespace perimap {
namespace {

constexpr double kLongestLag_s = 20.0;
constexpr double kLongEnough_s = 1.0;
constexpr float kMoved_mV = 0.2F;

}  // namespace

RepeatedSamples::RepeatedSamples() : ring_(kCapacity), places_(kPlaces) {}

std::size_t RepeatedSamples::place_of_word() const noexcept {
  std::uint64_t hash = 14695981039346656037ULL;
  for (std::uint64_t i = kWord; i > 0; --i) hash = (hash ^ std::bit_cast<std::uint32_t>(back(i))) * 1099511628211ULL;
  return static_cast<std::size_t>((hash ^ (hash >> 29U)) % kPlaces);
}

void RepeatedSamples::widen(float mV) noexcept {
  lowest_mV_ = std::min(lowest_mV_, mV);
  highest_mV_ = std::max(highest_mV_, mV);
}

// From where the same word ended, at that count of samples.
void RepeatedSamples::begin_run(std::uint64_t place, std::uint64_t longest_lag) noexcept {
  if (place == 0 || place >= count_ || count_ - place > longest_lag) return;
  const std::uint64_t lag = count_ - place;
  for (std::uint64_t i = 1; i <= kWord; ++i) {
    if (back(i) != back(i + lag)) return;
  }
  lag_ = lag;
  run_ = kWord;
  lowest_mV_ = highest_mV_ = back(1);
  for (std::uint64_t i = 2; i <= kWord; ++i) widen(back(i));
}

void RepeatedSamples::add(float mV, Duration period) noexcept {
  ring_[count_ % kCapacity] = mV;
  ++count_;
  ++since_;
  const bool was_told = told_;
  told_ = false;
  const double period_s = to_seconds(period);
  if (!(period_s > 0.0)) return;
  const auto longest =
      std::min<std::uint64_t>(kCapacity - kWord - 1, static_cast<std::uint64_t>(kLongestLag_s / period_s));
  if (lag_ > 0 && mV == back(lag_ + 1)) {
    ++run_;
    widen(mV);
  } else {
    lag_ = run_ = 0;
  }
  if (since_ < kWord) return;
  const std::size_t place = place_of_word();
  if (lag_ == 0) begin_run(places_[place], longest);
  places_[place] = count_;
  const double run_s = static_cast<double>(run_) * period_s;
  if (lag_ == 0 || run_s < kLongEnough_s || highest_mV_ - lowest_mV_ < kMoved_mV) return;
  told_ = true;
  counted_ += was_told ? 1 : run_;
}

}  // namespace perimap

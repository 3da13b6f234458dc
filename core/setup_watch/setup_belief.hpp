// What is believed of the set-up after the windows judged so far.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/setup_watch/setup_memory.hpp"
#include "core/setup_watch/setup_verdict.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// One window's doubt is told at once where it is far beyond chance; else two in a row must blame, and one part is
// blamed by both. It ends when three would have shown it and do not, with none between them that doubts. A window of
// which nothing is known changes nothing; after three of them in a row nothing is known of a set-up that is not
// doubted.
class SetupBelief {
 public:
  // `after`: since the first frame.
  void add(const SetupVerdict& verdict, Duration after) noexcept {
    ++judged_;
    unknown_ = verdict.state == SetupState::kUnknown ? unknown_ + 1 : 0;
    if (unknown_ > 0) {
      if (unknown_ >= kToForget && !doubted_) told_ = {};
      return;
    }
    asked_ = asked_ || verdict.matches > 0;
    const bool doubts = verdict.state == SetupState::kDoubted;
    const bool again = doubts && newest_.state == SetupState::kDoubted && blame_alike(verdict, newest_);
    const bool certain = doubts && verdict.certainty >= kCertain;
    // A window that is undetermined, the scope at rest, neither ends a doubt nor takes a count back, nor what a window
    // that knew more has widened.
    if (doubts) consistent_ = 0;
    if (verdict.state == SetupState::kConsistent) ++consistent_;
    const bool knows = doubts || verdict.state == SetupState::kConsistent ||
                       (verdict.matches > 0 && verdict.surface_deviation_mm <= widened_at_mm_);
    if (knows || widening_mm_ == 0.0) {
      widened_at_mm_ = verdict.surface_deviation_mm;
      widening_mm_ = verdict.widening_mm;
    } else {
      // What knew more is not taken back later by what knows as little as this, nor does that widen by what it does not
      // know.
      widening_mm_ = std::max(widening_mm_, verdict.suspected_mm);
    }
    newest_ = verdict;
    if (again || certain || (doubts && doubted_)) {
      if (!first_doubted_) first_doubted_ = after;
      doubted_ = true;
      told_ = verdict;
    } else if (!doubted_ || consistent_ >= kToBelieve) {
      doubted_ = false;
      told_ = verdict;
      // Not before it has been seen twice.
      if (doubts) {
        told_.state = SetupState::kUndetermined;
        told_.blamed = {};
      }
    }
  }

  // What an earlier run believed of the same set-up. Before the first window.
  void recall(const SetupMemory& memory) noexcept {
    asked_ = memory.asked;
    doubted_ = memory.doubted;
    told_ = memory.told;
    widening_mm_ = memory.widening_mm;
    widened_at_mm_ = memory.widened_at_mm;
  }
  [[nodiscard]] SetupMemory memory() const noexcept { return {asked_, doubted_, told_, widening_mm_, widened_at_mm_}; }

  // Some window has told of it, right or wrong: not one of a scope at rest, nor one that nothing explains.
  [[nodiscard]] bool asked() const noexcept { return asked_; }
  [[nodiscard]] bool doubted() const noexcept { return doubted_; }
  // Of the newest window that tells anything; while doubted, of the newest that doubts.
  [[nodiscard]] const SetupVerdict& told() const noexcept { return told_; }
  // What is to be added to the deviation of each published position, RMS of the 3-D norm.
  [[nodiscard]] double widening_mm() const noexcept {
    return std::max(doubted_ ? told_.widening_mm : 0.0, widening_mm_);
  }
  // What a feature's own largest deviation may be, so that with what the set-up may be off by it is within `bound_mm`:
  // all of that may lie in the direction in which the feature is least certain. Below zero, so that none is, until the
  // set-up has been asked.
  [[nodiscard]] double within_mm(double bound_mm) const noexcept {
    if (!asked_) return -1.0;
    return std::sqrt(std::max(0.0, bound_mm * bound_mm - widening_mm() * widening_mm()));
  }
  [[nodiscard]] std::uint64_t judged() const noexcept { return judged_; }
  // Since the first frame; none: never.
  [[nodiscard]] std::optional<Duration> first_doubted() const noexcept { return first_doubted_; }

 private:
  static constexpr int kToBelieve = 3;
  static constexpr int kToForget = 3;
  static constexpr double kCertain = 2.0;  // as a multiple of what a doubt needs

  [[nodiscard]] static bool blame_alike(const SetupVerdict& a, const SetupVerdict& b) noexcept {
    for (std::size_t i = 0; i < a.blamed.size(); ++i) {
      if (a.blamed[i] && b.blamed[i]) return true;
    }
    return false;
  }

  SetupVerdict newest_;
  SetupVerdict told_;
  bool asked_ = false;
  bool doubted_ = false;
  int consistent_ = 0;  // windows since the last one that doubts
  int unknown_ = 0;     // windows in a row
  double widening_mm_ = 0.0;
  double widened_at_mm_ = 0.0;  // the surface's deviation in the window that it is of
  std::uint64_t judged_ = 0;
  std::optional<Duration> first_doubted_;
};

}  // namespace perimap

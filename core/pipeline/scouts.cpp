#include "core/pipeline/scouts.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstddef>

#include "core/bank/lanes.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr std::size_t kScouts = 12;
constexpr std::size_t kFewestFound = 8;  // of which a third may mislead
// What a shift leaves must be less than half of what it takes away.
constexpr double kLeastLeft_px = 1.0, kWorthIt = 0.5;

Vector2d predicted(const FeatureSlot& slot) noexcept { return slot.match.px - slot.off_px; }

bool can_scout(const FeatureSlot& slot, std::uint64_t frame_index) noexcept {
  return slot.state == SlotState::kMapped && slot.converged && !slot.shed && slot.in_view &&
         slot.last_found_frame + 1 == frame_index && kWorthIt * slot.pose_deviation_px >= kLeastLeft_px;
}

}  // namespace

bool choose_scouts(std::span<FeatureSlot> slots, std::uint64_t frame_index) noexcept {
  const auto able = static_cast<std::size_t>(
      std::count_if(slots.begin(), slots.end(), [=](const FeatureSlot& slot) { return can_scout(slot, frame_index); }));
  const bool any = able >= 2 * kScouts;
  std::size_t nth = 0, chosen = 0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    slots[i].is_scout = false;
    if (!any || !can_scout(slots[i], frame_index)) continue;
    // From groups of even and odd number by turns: those of one worker's groups alone would let the others wait.
    const bool is_turn = i / kLanes % 2 == chosen % 2;
    slots[i].is_scout = is_turn && chosen < kScouts && nth >= chosen * able / kScouts;
    chosen += slots[i].is_scout ? 1 : 0;
    ++nth;
  }
  return any;
}

CommonShift shift_of_scouts(std::span<const FeatureSlot> slots) noexcept {
  std::array<const FeatureSlot*, kScouts> found{};
  std::array<double, kScouts> values{};
  std::size_t count = 0;
  for (const FeatureSlot& slot : slots) {
    if (slot.is_scout && slot.match.state == MatchState::kFound && slot.match_agrees) found[count++] = &slot;
  }
  if (count < kFewestFound) return {};
  const auto middle = [&](const auto& value_of) {
    for (std::size_t i = 0; i < count; ++i) values[i] = value_of(*found[i]);
    return upper_median(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
  };
  // Least absolute differences, by reweighting: one that misleads pulls no harder for being far off.
  CommonShift shift;
  for (std::size_t i = 0; i < count; ++i) shift.centre_px += predicted(*found[i]) / static_cast<double>(count);
  const auto off_it = [&](const FeatureSlot& slot) { return (slot.off_px - shift.at(predicted(slot))).norm(); };
  // A pixel's deviation over that of a slope, squared: what few or crowded scouts do not tell is taken for small.
  constexpr double kSlope_px = 3.0;
  const Eigen::Matrix3d usual = Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal() * (1.0 / (kSlope_px * kSlope_px));
  Eigen::Matrix3d counted = usual;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d terms = shift.terms(predicted(*found[i]));
    counted += terms * terms.transpose();
  }
  shift.spread = counted.inverse();
  if (!shift.spread.allFinite()) return {};
  constexpr int kRounds = 6;
  constexpr double kExact_px = 0.5;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d normal = usual;
    Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      const double weight = round == 0 ? 1.0 : 1.0 / std::max(off_it(*found[i]), kExact_px);
      const Eigen::Vector3d terms = shift.terms(predicted(*found[i]));
      normal += weight * terms * terms.transpose();
      right += weight * terms * found[i]->off_px.transpose();
    }
    shift.coefficients = normal.ldlt().solve(right);
    if (!shift.coefficients.allFinite()) return {};
  }
  constexpr double kMost_px = 4.0, kOfMiddle = 2.0;
  shift.deviation_px = std::max(kLeastLeft_px, kOfMiddle * middle(off_it));
  const double replaced_px = middle([](const FeatureSlot& slot) { return slot.pose_deviation_px; });
  shift.known = shift.deviation_px <= std::min(kMost_px, kWorthIt * replaced_px);
  return shift;
}

}  // namespace perimap

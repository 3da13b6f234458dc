#include "core/phase/ventricular_evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace perimap {
namespace {

// Twice as large as usual, in another shape, early.
VentricularEvidence early_and_large() {
  VentricularEvidence evidence;
  evidence.log_area = std::log(2.0);
  evidence.log_kind_area = std::log(2.0);
  evidence.strangeness = 0.4;
  evidence.log_rr = std::log(0.65);
  return evidence;
}

TEST(VentricularEvidence, AnEarlyLargeComplexOfAnotherShapeIsVentricularAndAUsualOneIsNot) {
  EXPECT_GT(log_odds(early_and_large()), 4.0);
  EXPECT_LT(log_odds(VentricularEvidence{}), -6.0);
}

// In natural units of log odds, as fitted to the development records.
TEST(VentricularEvidence, IsWorthWhatTheRecordsSay) {
  const double usual = log_odds(VentricularEvidence{});
  EXPECT_NEAR(usual, -7.7, 0.5);
  struct {
    const char* name;
    std::function<void(VentricularEvidence&)> change;
    double log_odds;
  } const all[] = {
      {"twice the area", [](auto& e) { e.log_area = std::log(2.0); }, 0.9},
      {"of a kind of twice the area", [](auto& e) { e.log_kind_area = std::log(2.0); }, 3.7},
      {"of another shape", [](auto& e) { e.strangeness = 0.12; }, 6.9},
      {"of a shape that is like none", [](auto& e) { e.strangeness = 1.3; }, 6.9},
      {"half as like", [](auto& e) { e.strangeness = 0.05; }, 3.45},
      {"after two thirds of a cycle", [](auto& e) { e.log_rr = std::log(2.0 / 3.0); }, 3.7},
      {"after a cycle that was as short", [](auto& e) { e.log_rr_before = std::log(2.0 / 3.0); }, -2.1},
  };
  for (const auto& worth : all) {
    VentricularEvidence evidence;
    worth.change(evidence);
    EXPECT_NEAR(log_odds(evidence) - usual, worth.log_odds, 0.1 * std::abs(worth.log_odds)) << worth.name;
  }
}

// Of a triangle that rises by 1 in ten points and falls again.
TEST(VentricularEvidence, TheAreaIsWhatTheComplexCoversOnEitherSideOfTheLine) {
  QrsShape up;
  up.points = 20;
  for (int i = 0; i < 20; ++i) up.slope[static_cast<std::size_t>(i)] = i < 10 ? 0.1F : -0.1F;
  QrsShape down = up;
  for (float& slope : down.slope) slope = -slope;
  EXPECT_NEAR(area(up), 10.0, 1e-5);
  EXPECT_NEAR(area(down), 10.0, 1e-5);
  EXPECT_EQ(area(QrsShape{}), 0.0);
}

}  // namespace
}  // namespace perimap

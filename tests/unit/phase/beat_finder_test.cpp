#include "core/phase/beat_finder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace perimap {
namespace {

constexpr double kRate_hz = 250.0;
constexpr double kCycle_s = 0.8;

// One QRS complex and its T wave each cycle.
float lead_mV(double t_s) {
  const double since = std::remainder(t_s - 0.4, kCycle_s);
  const double qrs = since / 0.012;
  const double t_wave = (since - 0.28) / 0.045;
  return static_cast<float>(std::exp(-0.5 * qrs * qrs) + 0.25 * std::exp(-0.5 * t_wave * t_wave));
}

struct Found {
  std::vector<RPeak> beats;
  int interruptions = 0;
  std::size_t beats_before_interruption = 0;
};

template <class Value>
Found find(double duration_s, Value&& value) {
  const auto finder = std::make_unique<BeatFinder>();
  Found found;
  for (int i = 0; i < static_cast<int>(duration_s * kRate_hz); ++i) {
    const double t_s = i / kRate_hz;
    if (const auto beat = finder->push(Instant(from_seconds(t_s)), value(t_s))) found.beats.push_back(*beat);
    if (finder->take_interruption()) {
      ++found.interruptions;
      found.beats_before_interruption = found.beats.size();
    }
  }
  while (const auto beat = finder->flush()) found.beats.push_back(*beat);
  return found;
}

TEST(BeatFinder, ASignalThatBreaksOffIsToldOnce) {
  const Found found = find(40.0, [](double t_s) {
    return t_s > 20.0 && t_s < 22.2 ? std::numeric_limits<float>::quiet_NaN() : lead_mV(t_s);
  });
  EXPECT_EQ(found.interruptions, 1);
  EXPECT_EQ(find(40.0, lead_mV).interruptions, 0);
}

TEST(BeatFinder, TheBeatAfterAnInterruptionIsNoPause) {
  const Found found = find(40.0, [](double t_s) {
    return t_s > 20.0 && t_s < 22.2 ? std::numeric_limits<float>::quiet_NaN() : lead_mV(t_s);
  });
  ASSERT_GT(found.beats.size(), 40U);
  for (const RPeak& beat : found.beats) {
    EXPECT_EQ(beat.beat_class, BeatClass::kNormal) << to_seconds(beat.time.time_since_epoch());
  }
}

// The heart itself pauses, with the lead on.
TEST(BeatFinder, ABeatThatIsLateIsAPause) {
  const Found found =
      find(40.0, [](double t_s) { return t_s < 20.0 ? lead_mV(t_s) : lead_mV(std::max(t_s - 0.7 * kCycle_s, 20.0)); });
  int pauses = 0;
  for (const RPeak& beat : found.beats) pauses += beat.beat_class == BeatClass::kPause ? 1 : 0;
  EXPECT_EQ(pauses, 1);
  EXPECT_EQ(found.interruptions, 0);
}

TEST(BeatFinder, ALeadThatIsSaidToBeOffIsAnInterruption) {
  const auto finder = std::make_unique<BeatFinder>();
  for (int i = 0; i < 2500; ++i) {
    static_cast<void>(finder->push(Instant(from_seconds(i / kRate_hz)), lead_mV(i / kRate_hz)));
  }
  EXPECT_FALSE(finder->take_interruption());
  for (int i = 2500; i < 2600; ++i) finder->lead_off(Instant(from_seconds(i / kRate_hz)));
  EXPECT_EQ(finder->signal(), EcgSignal::kLeadOff);
  EXPECT_TRUE(finder->take_interruption());
  EXPECT_FALSE(finder->take_interruption());
}

}  // namespace
}  // namespace perimap

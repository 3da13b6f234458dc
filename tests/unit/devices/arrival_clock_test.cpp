#include "drivers/device/arrival_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kPeriod_ns = 4e6;  // 250 Hz
const Instant kStart(seconds(1000));

// A device whose clock is off by `drift`, behind a link that delays by a constant and an exponential part.
struct Device {
  double drift = 0.0;
  double mean_jitter_ns = 1e6;
  std::mt19937_64 random{7};

  Instant measured(std::int64_t count) const {
    return kStart + Duration(std::llround(static_cast<double>(count) * kPeriod_ns * (1.0 + drift)));
  }
  Instant arrival(std::int64_t count) {
    std::exponential_distribution<> jitter(1.0 / mean_jitter_ns);
    return measured(count) + Duration(std::llround(jitter(random)));
  }
};

double error_ms(const ArrivalClock& clock, const Device& device, std::int64_t count) {
  return 1e-6 * static_cast<double>((clock.stamp(count) - device.measured(count)).count());
}

TEST(ArrivalClock, FollowsADriftingDeviceBehindJitterToAFractionOfIt) {
  for (const double drift : {-300e-6, 0.0, 100e-6, 300e-6}) {
    Device device{drift};
    ArrivalClock clock({kPeriod_ns});
    double worst_ms = 0.0;
    for (std::int64_t i = 0; i < 250 * 60; ++i) {
      clock.observe(i, device.arrival(i));
      if (i > 250 * 5) worst_ms = std::max(worst_ms, std::abs(error_ms(clock, device, i)));
    }
    EXPECT_LT(worst_ms, 0.25) << drift;  // jitter: mean 1 ms, maximum about 10 ms
    EXPECT_NEAR(clock.period_ns(), kPeriod_ns * (1.0 + drift), kPeriod_ns * 30e-6);
  }
}

TEST(ArrivalClock, NeverStampsAfterTheArrival) {
  Device device{200e-6, 3e6};
  ArrivalClock clock({kPeriod_ns});
  for (std::int64_t i = 0; i < 5000; ++i) {
    const Instant arrival = device.arrival(i);
    clock.observe(i, arrival);
    ASSERT_LE(clock.stamp(i), arrival);
  }
}

TEST(ArrivalClock, SubtractsTheKnownTransportDelay) {
  ArrivalClock clock({kPeriod_ns, milliseconds(3)});
  clock.observe(0, kStart);
  EXPECT_EQ(clock.stamp(0), kStart - milliseconds(3));
}

TEST(ArrivalClock, AStallThatIsCaughtUpDoesNotMoveTheStamps) {
  Device device;
  ArrivalClock clock({kPeriod_ns});
  for (std::int64_t i = 0; i < 2500; ++i) clock.observe(i, device.arrival(i));
  // 300 ms in which nothing is read, then everything at once.
  const Instant late = device.measured(2575);
  for (std::int64_t i = 2500; i < 2575; ++i) clock.observe(i, late);
  EXPECT_LT(std::abs(error_ms(clock, device, 2574)), 0.25);
  for (std::int64_t i = 2575; i < 3500; ++i) clock.observe(i, device.arrival(i));
  EXPECT_LT(std::abs(error_ms(clock, device, 3499)), 0.25);
}

TEST(ArrivalClock, SamplesLostWithoutAWordAreTakenOverAsAStep) {
  Device device;
  ArrivalClock clock({kPeriod_ns});
  for (std::int64_t i = 0; i < 2500; ++i) clock.observe(i, device.arrival(i));
  // 50 samples are lost and not counted: from here on the count lags by 50.
  double worst_ms = 0.0;
  for (std::int64_t i = 2500; i < 5000; ++i) {
    clock.observe(i, device.arrival(i + 50));
    const double off = 1e-6 * static_cast<double>((clock.stamp(i) - device.measured(i + 50)).count());
    if (i > 2500 + 250) worst_ms = std::max(worst_ms, std::abs(off));
  }
  EXPECT_LT(worst_ms, 1.5);  // from one second after the loss
}

TEST(ArrivalClock, ACountThatGoesBackOrFarAheadStartsAnew) {
  ArrivalClock clock({kPeriod_ns});
  clock.observe(1000000, kStart);
  clock.observe(5, kStart + seconds(1));
  EXPECT_EQ(clock.stamp(5), kStart + seconds(1));
  clock.observe(std::int64_t{1} << 60, kStart + seconds(2));
  EXPECT_EQ(clock.stamp(std::int64_t{1} << 60), kStart + seconds(2));
}

TEST(ArrivalClock, TheFirstArrivalsMayBeLate) {
  // The first second was held back in a buffer and came at once.
  Device device;
  ArrivalClock clock({kPeriod_ns});
  const Instant late = device.measured(250);
  for (std::int64_t i = 0; i < 250; ++i) clock.observe(i, late);
  for (std::int64_t i = 250; i < 1000; ++i) clock.observe(i, device.arrival(i));
  EXPECT_LT(std::abs(error_ms(clock, device, 999)), 1.0);
}

TEST(ArrivalClock, TellsTheCountOfAnInstant) {
  ArrivalClock clock({kPeriod_ns});
  for (std::int64_t i = 0; i < 100; ++i) clock.observe(i, kStart + i * milliseconds(4));
  EXPECT_NEAR(clock.count_at(kStart + milliseconds(480)), 120.0, 1e-6);
  EXPECT_EQ(clock.lateness(99, kStart + milliseconds(400)), milliseconds(4));
}

}  // namespace
}  // namespace perimap

#include "core/phase/qrs_candidate.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>

#include "core/phase/ecg_filter.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr double kRate_hz = 500.0;
constexpr double kPeak_s = 1.0004;  // between two samples

double wave(double t_s, double sigma_s) {
  const double x = (t_s - kPeak_s) / sigma_s;
  return std::exp(-0.5 * x * x);
}

double qrs_mV(double t_s) { return wave(t_s, 0.012); }

// A complex in the middle of two seconds, as measured about the sample that is nearest to it.
struct Measured {
  explicit Measured(const std::function<double(double)>& value_mV, Polarity polarity = {}, double off_s = 0.0,
                    double noise_mV = 0.0, double rate_hz = kRate_hz) {
    const Duration period = from_seconds(1.0 / rate_hz);
    filter.restart(period);
    meter.set_period(period);
    for (int i = 0; i < static_cast<int>(1.4 * rate_hz); ++i) {
      filter.push(Instant(i * period), value_mV(i / rate_hz), false);
    }
    centre = static_cast<std::int64_t>(std::lround((kPeak_s + off_s) * rate_hz));
    candidate = meter.about_crest(centre + filter.energy_delay(), polarity, noise_mV);
  }

  CandidateSettings settings;
  EcgFilter filter;
  QrsMeter meter{settings, filter};
  std::int64_t centre = 0;
  QrsCandidate candidate;
};

double seconds(const QrsCandidate& candidate) { return to_seconds(candidate.time.time_since_epoch()); }

TEST(QrsMeter, TheTimeIsThatOfThePeakBetweenSamples) {
  for (const double sign : {1.0, -1.0}) {
    const Measured measured([&](double t_s) { return sign * qrs_mV(t_s); });
    EXPECT_NEAR(seconds(measured.candidate), kPeak_s, 2e-4);
    EXPECT_EQ(measured.candidate.points_up, sign > 0.0);
  }
}

TEST(QrsMeter, MeasuresGrowWithTheSignalAndItsShapeDoesNot) {
  const Measured one(qrs_mV);
  const Measured ten([](double t_s) { return 10.0 * qrs_mV(t_s); });
  EXPECT_NEAR(ten.candidate.energy, 10.0 * one.candidate.energy, 1e-9);
  EXPECT_NEAR(ten.candidate.sharpness, 10.0 * one.candidate.sharpness, 1e-9);
  EXPECT_NEAR(ten.candidate.slope, 10.0 * one.candidate.slope, 1e-9);
  EXPECT_NEAR(ten.candidate.upward, 10.0 * one.candidate.upward, 1e-9);
  EXPECT_NEAR(match(ten.candidate.shape, one.candidate.shape).correlation, 1.0, 1e-6);
  EXPECT_NEAR(match(ten.candidate.shape, one.candidate.shape).gain, 10.0, 1e-4);
}

TEST(QrsMeter, AnOffsetChangesNothing) {
  const Measured without(qrs_mV);
  const Measured with([](double t_s) { return 3.0 + qrs_mV(t_s); });
  EXPECT_NEAR(with.candidate.energy, without.candidate.energy, 1e-9);
  EXPECT_NEAR(with.candidate.upward, without.candidate.upward, 1e-9);
  EXPECT_NEAR(with.candidate.step, without.candidate.step, 1e-9);
}

// As high: a T wave has less energy and, beside it, hardly any sharpness.
TEST(QrsMeter, ABluntWaveIsLessSharpThanItIsLarge) {
  const Measured qrs(qrs_mV);
  const Measured t_wave([](double t_s) { return wave(t_s, 0.045); });
  EXPECT_NEAR(t_wave.candidate.upward, qrs.candidate.upward, 0.25);
  EXPECT_LT(t_wave.candidate.energy, 0.6 * qrs.candidate.energy);
  EXPECT_LT(t_wave.candidate.sharpness / t_wave.candidate.energy, 0.6 * qrs.candidate.sharpness / qrs.candidate.energy);
}

TEST(QrsMeter, ALineThatStaysAtAnotherLevelHasStepped) {
  const Measured beat(qrs_mV);
  EXPECT_LT(beat.candidate.step, 0.05);
  const Measured step([](double t_s) { return t_s > kPeak_s ? 2.0 : 0.0; });
  EXPECT_GT(step.candidate.step, 0.9);
}

TEST(QrsMeter, WhatIsTooFastForAHeartIsRough) {
  const Measured beat(qrs_mV);
  const Measured arc([](double t_s) { return qrs_mV(t_s) + std::sin(2.0 * 3.14159265 * 180.0 * t_s); });
  EXPECT_LT(beat.candidate.rough, 0.3 * beat.candidate.energy);
  EXPECT_GT(arc.candidate.rough, 0.5 * arc.candidate.energy);
}

TEST(QrsMeter, PointsTheWayTheBeatsDoUnlessTheOtherIsFarLarger) {
  const auto both = [](double down) { return [down](double t_s) { return qrs_mV(t_s) - down * qrs_mV(t_s - 0.03); }; };
  EXPECT_FALSE(Measured(both(1.5)).candidate.points_up);
  EXPECT_TRUE(Measured(both(1.5), {.known = true, .up = true}).candidate.points_up);
  EXPECT_FALSE(Measured(both(2.6), {.known = true, .up = true}).candidate.points_up);
}

// ---- how far each measure reaches

TEST(QrsMeter, TheShapeIsOfPointsFiveMillisecondsApartFromNinetyBeforeThePeakToFortyFiveAfter) {
  CandidateSettings settings;
  EcgFilter filter;
  filter.restart(milliseconds(1));
  QrsMeter meter{settings, filter};
  meter.set_period(milliseconds(1));
  EXPECT_EQ(meter.step(), 5);
  for (int i = 0; i < 1000; ++i) filter.push(Instant(i * milliseconds(1)), 0.0, false);
  EXPECT_EQ(meter.shape_at(500).points, 18 + 1 + 9);
  EXPECT_EQ(meter.points_after(), 9);
}

// The middle of a wide complex's energy may be so far from its peak; the T wave is farther.
TEST(QrsMeter, ThePeakIsSoughtWithinEightyMillisecondsOfTheEnergysMiddle) {
  EXPECT_NEAR(seconds(Measured(qrs_mV, {}, 0.072).candidate), kPeak_s, 1e-3);
  EXPECT_NEAR(seconds(Measured(qrs_mV, {}, -0.072).candidate), kPeak_s, 1e-3);
  EXPECT_GT(std::abs(seconds(Measured(qrs_mV, {}, 0.098).candidate) - kPeak_s), 5e-3);
}

// A second peak, higher, at so many seconds from where the shape fits.
TEST(QrsMeter, ThePeakOfAShapeThatFitsIsSoughtWithinFifteenMillisecondsOfIt) {
  const auto found = [](double apart_s) {
    const Measured measured([=](double t_s) { return wave(t_s, 0.004) + 1.3 * wave(t_s - apart_s, 0.004); });
    return seconds(measured.meter.about_fit(measured.centre, true, {}, 0.0)) - kPeak_s;
  };
  EXPECT_GT(found(0.0145), 0.008);
  EXPECT_LT(found(0.021), 0.004);
}

// The line changes to another level so long before the peak.
TEST(QrsMeter, TheBaselineIsOfTheStretchOfWhichTheComplexIsTheSmallerPart) {
  const auto height = [](double before_s) {
    return Measured([=](double t_s) { return qrs_mV(t_s) + (t_s > kPeak_s - before_s ? 1.0 : 0.0); }).candidate.upward;
  };
  EXPECT_GT(height(0.040), 1.6) << "most of 200 ms before is of the old level";
  EXPECT_LT(height(0.080), 1.1) << "and here of the new one";
}

TEST(QrsMeter, AStepIsAChangeOfLevelWithinTenthsOfASecondOfThePeak) {
  const auto step = [](double after_s) {
    return Measured([=](double t_s) { return qrs_mV(t_s) + (t_s > kPeak_s + after_s ? 1.0 : 0.0); }).candidate.step;
  };
  EXPECT_GT(step(0.082), 0.4);
  EXPECT_LT(step(0.118), 0.1);
}

// Of a parabola through noise of a deviation: that, over twice the curvature and the root of the sum of squares of the
// instants, which reach 10 ms to either side.
TEST(QrsMeter, TheDeviationIsThatOfAParabolasVertexInNoise) {
  const double noise_mV = 0.1;
  const double sigma_s = 0.030;
  const Measured measured([=](double t_s) { return wave(t_s, sigma_s); }, {}, 0.0, noise_mV);
  double squares_s2 = 0.0;
  for (int i = -5; i <= 5; ++i) squares_s2 += std::pow(i / kRate_hz, 2);
  const double curvature = 0.5 / (sigma_s * sigma_s);
  const double expected_s = noise_mV / (2.0 * curvature * std::sqrt(squares_s2));
  EXPECT_NEAR(to_seconds(measured.candidate.deviation), std::hypot(expected_s, 0.001), 0.2 * expected_s);
}

TEST(QrsMeter, WithoutNoiseTheDeviationIsThatOfCleanBeatsAndWithoutAVertexUniform) {
  EXPECT_NEAR(to_seconds(Measured(qrs_mV).candidate.deviation), 0.001, 1e-4);
  EXPECT_NEAR(to_seconds(Measured([](double t_s) { return t_s * t_s; }).candidate.deviation), 0.020, 1e-3);
  EXPECT_NEAR(to_seconds(Measured(qrs_mV, {}, 0.0, 100.0).candidate.deviation), 0.020, 1e-9) << "at most";
}

TEST(QrsMeter, AFitIsNoBeatWhereAnotherWaveOfTheComplexIsTwiceAsLarge) {
  const auto points = [](double down) {
    const Measured measured([=](double t_s) { return wave(t_s, 0.008) - down * wave(t_s - 0.045, 0.012); });
    return measured.meter.about_fit(measured.centre, true, {}, 0.0).shape.points;
  };
  EXPECT_GT(points(1.6), 0);
  EXPECT_EQ(points(2.4), 0);
}

// ---- other waves that may be the R peak

double after_peak_s(const QrsWave& wave) { return to_seconds(wave.time.time_since_epoch()) - kPeak_s; }

// Upward at the peak, and downward by so much so long after it.
QrsCandidate biphasic(double down, double apart_s) {
  const Measured measured([=](double t_s) { return wave(t_s, 0.008) - down * wave(t_s - apart_s, 0.008); });
  return measured.meter.about_fit(measured.centre, true, {}, 0.0);
}

TEST(QrsMeter, TheLargestWaveOfAComplexIsMeasuredWhereItIsNotThePeak) {
  for (const double apart_s : {-0.040, 0.030, 0.040}) {
    const QrsCandidate candidate = biphasic(1.4, apart_s);
    EXPECT_NEAR(candidate.larger.mV, -1.4, 0.2);
    EXPECT_NEAR(after_peak_s(candidate.larger), apart_s, 2e-3);
    EXPECT_NEAR(candidate.peak_mV, 1.0, 0.2);
  }
  EXPECT_EQ(biphasic(0.8, 0.030).larger.mV, 0.0) << "the peak is the largest";
  EXPECT_EQ(biphasic(1.4, 0.053).larger.mV, 0.0) << "that is another complex's";
}

// In the mean of 8 ms: of a wave that is no wider there is less.
TEST(QrsMeter, AWaveIsAsHighAsItsMeanOfEightMilliseconds) {
  const Measured measured([](double t_s) { return wave(t_s, 0.006); }, {}, 0.0, 0.0, 1000.0);
  double mean = 0.0;
  for (int i = -4; i <= 4; ++i) mean += wave(kPeak_s + 1e-3 * i, 0.006) / 9.0;
  EXPECT_NEAR(measured.candidate.peak_mV, mean, 0.03);
}

TEST(QrsMeter, WhereThePeakPointsTheOtherWayAWaveThatPointsAsTheBeatsDoIsMeasured) {
  const Polarity up{.known = true, .up = true};
  const auto upright = [&](double at_s, bool peak_up) {
    const double sign = peak_up ? 1.0 : -1.0;
    const Measured measured([=](double t_s) { return 2.6 * sign * wave(t_s, 0.012) + wave(t_s - at_s, 0.008); }, up);
    return measured.candidate.upright;
  };
  for (const double at_s : {-0.105, -0.070, 0.040}) {
    EXPECT_NEAR(upright(at_s, false).mV, 1.0, 0.25);
    EXPECT_NEAR(after_peak_s(upright(at_s, false)), at_s, 3e-3);
  }
  EXPECT_LT(upright(-0.122, false).mV, 0.3);
  EXPECT_EQ(upright(-0.070, true).mV, 0.0) << "the peak is one itself";
}

}  // namespace
}  // namespace perimap

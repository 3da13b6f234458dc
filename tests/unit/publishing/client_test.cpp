// The header that navigation software evaluates a surface model with, against the pipeline's own composer.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/law_choice.hpp"
#include "core/pipeline/surface_composer.hpp"
#include "daemon/publishing/model_moment.hpp"
#include "daemon/publishing/wire_model.hpp"
#include "perimap_client.hpp"

namespace perimap {
namespace {

using client::PredictedSurface;
using client::Refusal;
using std::chrono::milliseconds;

constexpr BasisLayout kLayout{8, 2};
constexpr Duration kValidity = milliseconds(700);

Instant at_ms(double ms) {
  return Instant(std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms)));
}

// Beats whose intervals are no round numbers, so that no boundary falls on a round instant; the last comes early when
// told.
CardiacClock clock_with(PhaseLaw law, double early_ms = 0.0) {
  CardiacClockSettings settings;
  settings.law.law = law;
  CardiacClockTracker tracker(settings);
  double ms = 1000.123;
  for (int beat = 0; beat < 40; ++beat) {
    tracker.on_r_peak({at_ms(ms), at_ms(ms + 60), 1.0, milliseconds(1)});
    ms += 803.7 + 31.0 * std::sin(0.7 * beat) - (beat == 38 ? early_ms : 0.0);
  }
  return tracker.clock();
}

RespiratoryClock breath_at(Instant now) {
  RespiratoryClock clock;
  clock.state = RespirationState::kLocked;
  clock.corrected = true;
  clock.time = now - milliseconds(371);
  clock.phase_rad = 2.9;
  clock.rate_rad_per_s = 1.613;
  clock.phase_variance_rad2 = 0.004;
  clock.covariance_rad2_per_s = 0.0007;
  clock.rate_variance_rad2_per_s2 = 0.0002;
  clock.slope_mm_per_rad = 3.1;
  return clock;
}

// Moves in every harmonic and axis, by less in the higher ones, as hearts do.
ShardSnapshot shard_of(const BasisLayout& layout, std::uint32_t first_id) {
  ShardSnapshot shard;
  shard.any = true;
  shard.frame_sequence = 100;
  for (std::uint32_t id = first_id; id < first_id + 5; ++id) {
    FeatureSnapshot feature;
    feature.id = id;
    feature.state = FeatureState::kConverged;
    feature.x = StateVector::Zero(layout.state_size());
    for (Eigen::Index i = 0; i < feature.x.size(); ++i) {
      const double k = 1.0 + static_cast<double>(i % layout.size() % layout.cardiac_harmonics);
      feature.x(i) = 7.0 / (k * k) * std::sin(1.3 * static_cast<double>(i) + id);
    }
    feature.covariances_W_mm2.fill(Matrix3d::Zero());
    feature.largest_deviation_mm = 0.2 + 0.01 * id;
    shard.features.push_back(feature);
  }
  return shard;
}

// One moment as the wire has it, and what the composer makes of the same.
class Moment {
 public:
  explicit Moment(const CardiacClock& clock, std::optional<Instant> at = {}, bool breathes = true)
      : shards_{shard_of(layout(breathes), 1), shard_of(layout(breathes), 20)}, view_{&shards_[0], &shards_[1]} {
    moment_.snapshots = view_;
    moment_.layout = layout(breathes);
    moment_.clock = clock;
    moment_.now = at.value_or(clock.anchor() + milliseconds(133));
    if (breathes) moment_.respiration = breath_at(moment_.now);
    moment_.footing.mapped = true;
    moment_.utc_minus_monotonic = std::chrono::hours(1000);
    moment_.validity = kValidity;
  }

  [[nodiscard]] Instant now() const { return moment_.now; }
  ModelMoment& moment() { return moment_; }
  const perimap_SurfaceModel& model() { return wire_.fill(moment_); }

  // No frame, so that its covariance is the bound that the wire carries.
  SurfaceSample composed_at(Instant t) {
    ComposerSettings settings;
    settings.layout = moment_.layout;
    settings.maximum_features = 10;
    SurfaceComposer composer(settings);
    return composer.compose({100, t - milliseconds(50), t, true}, moment_.clock, moment_.respiration, view_);
  }

 private:
  static BasisLayout layout(bool breathes) { return breathes ? kLayout : BasisLayout{kLayout.cardiac_harmonics, 0}; }

  std::array<ShardSnapshot, 2> shards_;
  std::array<const ShardSnapshot*, 2> view_;
  ModelMoment moment_;
  WireModel wire_{{"theatre 3", ReleaseStream::kFrame, "tracker"}};
};

PredictedSurface predicted(const perimap_SurfaceModel& model, Instant t, client::Acceptance acceptance = {}) {
  PredictedSurface surface;
  client::predict(model, to_ns(t), model.time_ns, acceptance, surface);
  return surface;
}

void expect_equal(const PredictedSurface& there, const SurfaceSample& here, double tolerance) {
  ASSERT_EQ(there.features.size(), here.features.size());
  for (std::size_t i = 0; i < here.features.size(); ++i) {
    const client::PredictedFeature& a = there.features[i];
    const SurfaceFeature& b = here.features[i];
    EXPECT_EQ(a.id, b.id);
    const Matrix3d& P = b.covariance_W_mm2;
    const double upper[6] = {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
    for (std::size_t j = 0; j < 6; ++j) EXPECT_NEAR(a.covariance_W_mm2[j], upper[j], 100 * tolerance);
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      EXPECT_NEAR(a.position_W_mm[k], b.p_WF_mm(axis), tolerance);
      EXPECT_NEAR(a.velocity_W_mm_per_s[k], b.velocity_W_mm_per_s(axis), 1000 * tolerance);
    }
  }
}

// From one second back to the end of its validity; the cycle ends in between, and the one after is predicted.
void expect_equal_at_all_horizons(Moment& moment, double tolerance) {
  const perimap_SurfaceModel& model = moment.model();
  for (int ms = -1000; ms <= 700; ms += 17) {
    const Instant t = moment.now() + milliseconds(ms);
    SCOPED_TRACE(ms);
    const PredictedSurface there = predicted(model, t, {.degraded = true});
    ASSERT_EQ(there.refusal, Refusal::kNone) << describe(there);
    expect_equal(there, moment.composed_at(t), tolerance);
  }
}

TEST(Client, PredictsWhatTheComposerWouldPublishWithOnePhase) {
  for (const PhaseLaw law : {PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked}) {
    Moment moment(clock_with(law), {}, false);
    // Times are whole nanoseconds on the wire: those that a law makes of others are rounded there.
    expect_equal_at_all_horizons(moment, law == PhaseLaw::kLinear ? 1e-9 : 1e-6);
  }
}

TEST(Client, PredictsWhatTheComposerWouldPublishWithABreathAsWell) {
  for (const PhaseLaw law : {PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked}) {
    Moment moment(clock_with(law));
    expect_equal_at_all_horizons(moment, 1e-6);
  }
}

TEST(Client, KnowsACycleThatIsTooShortForItsLaw) {
  for (const PhaseLaw law : {PhaseLaw::kWarped, PhaseLaw::kTimeLocked}) {
    Moment moment(clock_with(law, 390.0));
    const perimap_SurfaceModel& model = moment.model();
    const perimap_CardiacCycle* before = model.cardiac_cycles._buffer;
    while (before->begin_time_ns + before->length_ns <= to_ns(moment.moment().clock.anchor()) - 1) ++before;
    ASSERT_TRUE(before->stretches);
    ASSERT_TRUE(before->measured);
    ASSERT_GT(before->irregularity_ns, 0);
    // What is left of this cycle for diastole is passed through at metres a second.
    expect_equal_at_all_horizons(moment, 3e-6);
  }
}

TEST(Client, KnowsHowMuchTheLawIsInDoubt) {
  for (const PhaseLaw law : kPhaseLaws) {
    const CardiacClock clock = clock_with(law);
    Moment doubted(clock.with_law({law_even_at(law, Seconds(0.9)), {0.2, 0.5, 0.3}}));
    Moment known(clock.with_law({law_even_at(law, Seconds(0.9))}));
    expect_equal_at_all_horizons(doubted, 1e-6);
    const PredictedSurface surface = predicted(doubted.model(), doubted.now(), {.degraded = true});
    EXPECT_GT(surface.cardiac_phase_deviation_rad,
              predicted(known.model(), known.now()).cardiac_phase_deviation_rad + 1e-3);
    EXPECT_EQ(surface.reason, perimap_SURFACE_REASON_LAW_UNDECIDED);
    EXPECT_EQ(predicted(doubted.model(), doubted.now()).refusal, Refusal::kDegraded);
  }
}

TEST(Client, LeavesOutABreathThatIsNotKnown) {
  Moment moment(clock_with(PhaseLaw::kLinear));
  moment.moment().respiration = {};
  moment.moment().respiration.state = RespirationState::kSearching;
  moment.moment().respiration.unknown_displacement_mm = 5.0;
  moment.moment().footing.breath_doubtful = true;
  expect_equal_at_all_horizons(moment, 1e-9);
  const PredictedSurface surface = predicted(moment.model(), moment.now(), {.degraded = true});
  EXPECT_EQ(surface.reason, perimap_SURFACE_REASON_RESPIRATION_UNKNOWN);
  EXPECT_GT(surface.features[0].covariance_W_mm2[0], 25.0);
  EXPECT_EQ(surface.features[0].state, perimap_FEATURE_CONVERGING);
}

TEST(Client, RefusesWhatTheModelIsNotGoodFor) {
  Moment moment(clock_with(PhaseLaw::kLinear));
  const perimap_SurfaceModel& model = moment.model();
  EXPECT_EQ(predicted(model, moment.now() + kValidity).refusal, Refusal::kNone);
  EXPECT_EQ(predicted(model, moment.now() + kValidity + Duration(1)).refusal, Refusal::kBeyondValidity);
  EXPECT_EQ(predicted(model, from_ns(model.valid_from_ns)).refusal, Refusal::kNone);
  EXPECT_LT(from_ns(model.valid_from_ns), moment.now() - std::chrono::seconds(1));
  EXPECT_EQ(predicted(model, from_ns(model.valid_from_ns - 1)).refusal, Refusal::kBeforeValidity);
  for (const std::int64_t t : {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_TRUE(predicted(model, from_ns(t)).features.empty());
  }
}

TEST(Client, RefusesAStaleModelForAnyInstant) {
  Moment moment(clock_with(PhaseLaw::kLinear));
  const perimap_SurfaceModel& model = moment.model();
  PredictedSurface surface;
  ASSERT_TRUE(client::predict(model, model.time_ns, model.valid_until_ns, {}, surface));
  ASSERT_FALSE(surface.features.empty());
  EXPECT_FALSE(client::predict(model, model.time_ns, model.valid_until_ns + 1, {.degraded = true}, surface));
  EXPECT_EQ(surface.refusal, Refusal::kStale);
  EXPECT_TRUE(surface.features.empty()) << "nothing of the last answer is left";
}

TEST(Client, RefusesADegradedSurfaceUnlessAskedForIt) {
  Moment moment(clock_with(PhaseLaw::kLinear));
  moment.moment().footing.pose_missing = true;
  const PredictedSurface refused = predicted(moment.model(), moment.now());
  EXPECT_EQ(refused.refusal, Refusal::kDegraded);
  EXPECT_EQ(refused.reason, perimap_SURFACE_REASON_POSE_MISSING);
  EXPECT_STREQ(describe(refused), "no pose of the scope");
  const PredictedSurface taken = predicted(moment.model(), moment.now(), {.degraded = true});
  EXPECT_EQ(taken.refusal, Refusal::kNone);
  EXPECT_EQ(taken.state, perimap_SURFACE_DEGRADED);
}

TEST(Client, RefusesAnInvalidSurfaceWhateverIsAccepted) {
  Moment nothing_mapped(clock_with(PhaseLaw::kLinear));
  nothing_mapped.moment().footing.mapped = false;
  EXPECT_EQ(predicted(nothing_mapped.model(), nothing_mapped.now(), {.degraded = true}).refusal, Refusal::kInvalid);

  const CardiacClock clock = clock_with(PhaseLaw::kLinear);
  Moment lost(clock, clock.lost_from() + Duration(1));
  const PredictedSurface surface = predicted(lost.model(), lost.now(), {.degraded = true});
  EXPECT_EQ(surface.refusal, Refusal::kInvalid);
  EXPECT_EQ(surface.reason, perimap_SURFACE_REASON_PHASE_LOST);
  EXPECT_EQ(lost.model().features._buffer[0].state, perimap_FEATURE_INVALID);
}

TEST(Client, SaysItselfThatABeatWasDueAndEndsWhereThePhaseIsLost) {
  const CardiacClock clock = clock_with(PhaseLaw::kLinear);
  Moment moment(clock, clock.expected_until() - milliseconds(10));
  const perimap_SurfaceModel& model = moment.model();
  ASSERT_EQ(model.state, perimap_SURFACE_GOOD);
  EXPECT_EQ(predicted(model, clock.expected_until()).refusal, Refusal::kNone);
  const PredictedSurface after = predicted(model, clock.expected_until() + Duration(1));
  EXPECT_EQ(after.refusal, Refusal::kDegraded);
  EXPECT_EQ(after.reason, perimap_SURFACE_REASON_PHASE_FREE_RUNNING);
  EXPECT_EQ(moment.composed_at(clock.expected_until() + Duration(1)).reason, SurfaceReason::kPhaseFreeRunning);

  Moment late(clock, clock.lost_from() - milliseconds(10));
  const PredictedSurface refused = predicted(late.model(), clock.lost_from() + Duration(1), {.degraded = true});
  EXPECT_EQ(refused.refusal, Refusal::kBeyondValidity);
}

TEST(Client, RefusesNumbersThatMakeNoSurface) {
  Moment moment(clock_with(PhaseLaw::kLinear));
  std::vector<perimap_SurfaceModel> wrong(6, moment.model());
  perimap_ModelFeature short_of_coefficients = wrong[0].features._buffer[0];
  short_of_coefficients.coefficients_W_mm._length -= 1;
  wrong[0].features = {1, 1, &short_of_coefficients, false};
  perimap_ModelFeature no_number = wrong[1].features._buffer[0];
  double nan = std::numeric_limits<double>::quiet_NaN();
  no_number.largest_deviation_mm = nan;
  wrong[1].features = {1, 1, &no_number, false};
  wrong[2].cardiac_harmonics = std::numeric_limits<std::uint32_t>::max();
  wrong[3].cardiac_clock.law = static_cast<perimap_PhaseLaw>(3);
  wrong[4].cardiac_cycles._length = 0;
  wrong[5].cardiac_clock.law = perimap_PHASE_LAW_WARPED;
  wrong[5].cardiac_clock.systole_fraction = nan;
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    const PredictedSurface surface = predicted(wrong[i], moment.now());
    EXPECT_EQ(surface.refusal, Refusal::kMalformed) << i;
    EXPECT_TRUE(surface.features.empty()) << i;
  }
  // An older perimapd says nothing of states and validity; the wire then has zeros there.
  const perimap_SurfaceModel of_old{};
  PredictedSurface surface;
  EXPECT_FALSE(client::predict(of_old, to_ns(moment.now()), to_ns(moment.now()), {.degraded = true}, surface));
}

TEST(Client, KnowsTheModelsClockFromUtc) {
  Moment moment(clock_with(PhaseLaw::kLinear));
  const perimap_SurfaceModel& model = moment.model();
  EXPECT_EQ(client::monotonic_of_utc(model, model.time_utc_ns + 5), model.time_ns + 5);
  EXPECT_EQ(model.time_utc_ns - model.time_ns, to_ns(Instant(std::chrono::hours(1000))));
}

}  // namespace
}  // namespace perimap

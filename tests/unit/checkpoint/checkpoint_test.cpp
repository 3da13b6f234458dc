#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "daemon/checkpoint/checkpoint_file.hpp"
#include "daemon/checkpoint/recent_ecg.hpp"
#include "daemon/checkpoint/warm_restart.hpp"
#include "tests/unit/checkpoint/samples.hpp"
#include "tests/unit/damage/damage.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr std::size_t kHeader = 16;

using test::checkpoint_sample;
using test::feature_sample;
using test::file_of;
using test::respiration_sample;
using test::setup_sample;

TEST(CheckpointFile, IsReadBackAsItWasWritten) {
  const auto read = parse_checkpoint(file_of(checkpoint_sample()));
  ASSERT_TRUE(read) << read.error().message;
  const Checkpoint written = checkpoint_sample();
  EXPECT_EQ(read->set_up, written.set_up);
  EXPECT_EQ(read->boot, written.boot);
  EXPECT_EQ(read->saved, written.saved);
  EXPECT_EQ(read->utc_ns, written.utc_ns);
  EXPECT_EQ(read->suspended, written.suspended);
  EXPECT_EQ(read->memory.last_capture, written.memory.last_capture);
  EXPECT_EQ(read->memory.frame_period, written.memory.frame_period);
  ASSERT_EQ(read->memory.ecg.size(), 2U);
  EXPECT_EQ(read->memory.ecg[1].mV, written.memory.ecg[1].mV);
  EXPECT_FALSE(read->memory.ecg[0].has_second);
  EXPECT_TRUE(read->memory.ecg[1].has_second);
  EXPECT_TRUE(read->memory.ecg[1].second_off);
  EXPECT_EQ(read->memory.ecg[1].second_mV, written.memory.ecg[1].second_mV);
  EXPECT_EQ(read->memory.ecg[1].first_sample_time, written.memory.ecg[1].first_sample_time);
  const RespirationMemory& r = read->memory.respiration;
  const RespirationMemory s = respiration_sample();
  EXPECT_EQ(r.found, s.found);
  for (int k = 0; k < kBreathHarmonics; ++k) {
    EXPECT_EQ(r.wave.a[k], s.wave.a[k]);
    EXPECT_EQ(r.wave.b[k], s.wave.b[k]);
  }
  EXPECT_EQ(r.clock.state, s.clock.state);
  EXPECT_EQ(r.clock.suspected, s.clock.suspected);
  EXPECT_EQ(r.clock.time, s.clock.time);
  EXPECT_EQ(r.clock.phase_rad, s.clock.phase_rad);
  EXPECT_EQ(r.clock.rate_rad_per_s, s.clock.rate_rad_per_s);
  EXPECT_EQ(r.clock.phase_variance_rad2, s.clock.phase_variance_rad2);
  EXPECT_EQ(r.clock.covariance_rad2_per_s, s.clock.covariance_rad2_per_s);
  EXPECT_EQ(r.clock.rate_variance_rad2_per_s2, s.clock.rate_variance_rad2_per_s2);
  EXPECT_EQ(r.offset_known, s.offset_known);
  const LawMemory& law = read->memory.law;
  EXPECT_EQ(law.law, written.memory.law.law);
  EXPECT_EQ(law.usual, written.memory.law.usual);
  EXPECT_EQ(law.cycles, written.memory.law.cycles);
  EXPECT_EQ(law.squares, written.memory.law.squares);
  EXPECT_EQ(law.log_likelihoods, written.memory.law.log_likelihoods);
  EXPECT_EQ(r.offset_rad, s.offset_rad);
  const SetupMemory& setup = read->memory.setup;
  const SetupMemory kept = setup_sample();
  EXPECT_EQ(setup.asked, kept.asked);
  EXPECT_EQ(setup.doubted, kept.doubted);
  EXPECT_EQ(setup.widening_mm, kept.widening_mm);
  EXPECT_EQ(setup.widened_at_mm, kept.widened_at_mm);
  EXPECT_EQ(setup.told.state, kept.told.state);
  EXPECT_EQ(setup.told.blamed, kept.told.blamed);
  EXPECT_EQ(setup.told.deviation, kept.told.deviation);
  EXPECT_EQ(setup.told.uncertainty, kept.told.uncertainty);
  EXPECT_EQ(setup.told.blamed_deviation, kept.told.blamed_deviation);
  EXPECT_EQ(setup.told.blamed_uncertainty, kept.told.blamed_uncertainty);
  EXPECT_EQ(setup.told.surface_mm, kept.told.surface_mm);
  EXPECT_EQ(setup.told.surface_deviation_mm, kept.told.surface_deviation_mm);
  EXPECT_EQ(setup.told.widening_mm, kept.told.widening_mm);
  ASSERT_EQ(read->memory.features.size(), 2U);
  const FeatureMemory& f = read->memory.features[1];
  const FeatureMemory g = feature_sample(2);
  EXPECT_EQ(f.id, g.id);
  EXPECT_EQ(f.first_observed, g.first_observed);
  EXPECT_EQ(f.first_observed_px, g.first_observed_px);
  EXPECT_EQ(f.last_observed, g.last_observed);
  EXPECT_EQ(std::memcmp(&f.patch.levels[2].value, &g.patch.levels[2].value, sizeof g.patch.levels[2].value), 0);
  EXPECT_EQ(f.patch_state.px, g.patch_state.px);
  EXPECT_EQ(f.patch_state.gain, g.patch_state.gain);
  EXPECT_EQ(f.updates, g.updates);
  EXPECT_EQ(f.converged, g.converged);
  EXPECT_EQ(f.breathing, g.breathing);
  EXPECT_EQ(f.largest_deviation_mm, g.largest_deviation_mm);
  EXPECT_EQ(f.estimate.x, g.estimate.x);
  EXPECT_EQ(f.estimate.P, g.estimate.P);
}

TEST(CheckpointFile, HoldsNoFeatureToo) {
  const auto read = parse_checkpoint(file_of(checkpoint_sample(), 0));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->memory.features.empty());
}

TEST(CheckpointFile, AnyPartOfOneIsRefused) {
  const std::string whole = file_of(checkpoint_sample());
  for (std::size_t size = 0; size < whole.size(); size += size < 600 ? 1 : 997) {
    EXPECT_FALSE(parse_checkpoint(whole.substr(0, size))) << size;
    const std::string_view body = std::string_view(whole).substr(std::min(size, kHeader));
    EXPECT_FALSE(parse_checkpoint_body(body.substr(0, size - std::min(size, kHeader)))) << size;
  }
  EXPECT_FALSE(parse_checkpoint(whole + "x"));
}

TEST(CheckpointFile, AnotherFormatIsRefusedByName) {
  std::string old = file_of(checkpoint_sample());
  old[8] = 1;  // the least byte of the format
  const auto read = parse_checkpoint(old);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("expected format 8; it is of format 1"));
}

TEST(CheckpointFile, AChangedByteIsNoticed) {
  const std::string whole = file_of(checkpoint_sample());
  for (std::size_t at = 0; at < whole.size(); at += 101) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    EXPECT_FALSE(parse_checkpoint(changed)) << at;
  }
}

TEST(CheckpointFile, BitFlipsAndCutsAreNeverTakenForWhole) {
  const std::string whole = file_of(checkpoint_sample());
  test::Damage damage;
  for (int trial = 0; trial < test::Damage::kCopies; ++trial) {
    EXPECT_FALSE(parse_checkpoint(damage.copy_of(whole))) << trial;
  }
}

struct Unsound {
  const char* name;
  void (*spoil)(FeatureMemory&);
  const char* expected;
};

class UnsoundFeature : public testing::TestWithParam<Unsound> {};

TEST_P(UnsoundFeature, IsRefusedAndNamed) {
  FeatureMemory f = feature_sample(1);
  GetParam().spoil(f);
  const std::vector<std::string> features{serialize_feature(f)};
  const auto read = parse_checkpoint(serialize(checkpoint_sample(), features));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().expected));
  EXPECT_THAT(read.error().message, HasSubstr("byte "));
}

void set_byte(bool& flag, unsigned char byte) { std::memcpy(&flag, &byte, 1); }

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    Checkpoint, UnsoundFeature,
    testing::Values(Unsound{"Side", [](FeatureMemory& f) { f.patch.levels[0].side = 1000; }, "template"},
                    Unsound{"Offset", [](FeatureMemory& f) { f.patch.levels[1].offset_x = 3.0; }, "template"},
                    Unsound{"OffsetNan", [](FeatureMemory& f) { f.patch.levels[1].offset_y = kNan; }, "template"},
                    Unsound{"Flag", [](FeatureMemory& f) { set_byte(f.patch.levels[2].usable, 7); }, "template"},
                    Unsound{"Sum", [](FeatureMemory& f) { f.patch.levels[0].sum_squares = kNan; }, "template"},
                    Unsound{"Inverse", [](FeatureMemory& f) { f.patch.affine_inverse[5] = kNan; }, "template"},
                    Unsound{"Place", [](FeatureMemory& f) { f.patch_state.px.x() = kNan; }, "looked"},
                    Unsound{"Updates", [](FeatureMemory& f) { f.updates = -1; }, "figures"},
                    Unsound{"Number", [](FeatureMemory& f) { f.id = 0; }, "figures"},
                    Unsound{"Coefficient", [](FeatureMemory& f) { f.estimate.x(3) = kNan; }, "coefficient"},
                    Unsound{"Covariance", [](FeatureMemory& f) { f.estimate.P(4, 1) = kNan; }, "covariance"},
                    Unsound{"Variance", [](FeatureMemory& f) { f.estimate.P(4, 4) = -1.0; }, "variance"}),
    [](const auto& param) { return param.param.name; });

struct UnsoundLawMemory {
  const char* name;
  void (*spoil)(LawMemory&);
  const char* expected;
};

class UnsoundLaw : public testing::TestWithParam<UnsoundLawMemory> {};

TEST_P(UnsoundLaw, IsRefusedAndNamed) {
  Checkpoint c = checkpoint_sample();
  GetParam().spoil(c.memory.law);
  const auto read = parse_checkpoint(file_of(c));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().expected));
  EXPECT_THAT(read.error().message, HasSubstr("byte "));
}

INSTANTIATE_TEST_SUITE_P(
    Checkpoint, UnsoundLaw,
    testing::Values(UnsoundLawMemory{"Law", [](LawMemory& m) { m.law = static_cast<PhaseLaw>(3); },
                                     "law of the motion"},
                    UnsoundLawMemory{"Length", [](LawMemory& m) { m.usual = Seconds(-0.1); }, "usual length"},
                    UnsoundLawMemory{"LengthNan", [](LawMemory& m) { m.usual = Seconds(kNan); }, "usual length"},
                    UnsoundLawMemory{"Cycles", [](LawMemory& m) { m.cycles = -1.0; }, "cycles weighed"},
                    UnsoundLawMemory{"Scatter", [](LawMemory& m) { m.squares[1] = -1.0; }, "scatter"},
                    UnsoundLawMemory{"Likelihood", [](LawMemory& m) { m.log_likelihoods[2] = kNan; }, "likelihood"}),
    [](const auto& param) { return param.param.name; });

struct UnsoundSetupMemory {
  const char* name;
  void (*spoil)(SetupMemory&);
  const char* expected;
};

class UnsoundSetup : public testing::TestWithParam<UnsoundSetupMemory> {};

TEST_P(UnsoundSetup, IsRefusedAndNamed) {
  Checkpoint c = checkpoint_sample();
  GetParam().spoil(c.memory.setup);
  const auto read = parse_checkpoint(file_of(c));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().expected));
  EXPECT_THAT(read.error().message, HasSubstr("byte "));
}

INSTANTIATE_TEST_SUITE_P(
    Checkpoint, UnsoundSetup,
    testing::Values(
        UnsoundSetupMemory{"State", [](SetupMemory& m) { m.told.state = static_cast<SetupState>(4); },
                           "believed of the set-up"},
        UnsoundSetupMemory{"DoubtedWithoutADoubt", [](SetupMemory& m) { m.told.state = SetupState::kConsistent; },
                           "believed of the set-up"},
        UnsoundSetupMemory{"DoubtedUnasked", [](SetupMemory& m) { m.asked = false; }, "believed of the set-up"},
        UnsoundSetupMemory{"Widening", [](SetupMemory& m) { m.widening_mm = -0.5; }, "may be off by"},
        UnsoundSetupMemory{"WideningNan", [](SetupMemory& m) { m.widening_mm = kNan; }, "may be off by"},
        UnsoundSetupMemory{"Number", [](SetupMemory& m) { m.told.blamed_deviation(9) = kNan; }, "number of the set-up"},
        UnsoundSetupMemory{"Surface", [](SetupMemory& m) { m.told.surface_deviation_mm = -1.0; },
                           "well that was known"}),
    [](const auto& param) { return param.param.name; });

struct UnsoundBreath {
  const char* name;
  void (*spoil)(RespirationMemory&);
  const char* expected;
};

class UnsoundRespiration : public testing::TestWithParam<UnsoundBreath> {};

TEST_P(UnsoundRespiration, IsRefusedAndNamed) {
  Checkpoint c = checkpoint_sample();
  GetParam().spoil(c.memory.respiration);
  const auto read = parse_checkpoint(file_of(c));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().expected));
  EXPECT_THAT(read.error().message, HasSubstr("byte "));
}

INSTANTIATE_TEST_SUITE_P(
    Checkpoint, UnsoundRespiration,
    testing::Values(
        UnsoundBreath{"Wave", [](RespirationMemory& r) { r.wave.b[1].y() = kNan; }, "displaces"},
        UnsoundBreath{"State", [](RespirationMemory& r) { r.clock.state = static_cast<RespirationState>(9); },
                      "known of breathing"},
        UnsoundBreath{"LockedOnNothing", [](RespirationMemory& r) { r.found = false; }, "known of breathing"},
        UnsoundBreath{"InAFeatureAlone",
                      [](RespirationMemory& r) {
                        r.found = false;
                        r.clock.state = RespirationState::kSearching;
                      },
                      "no breathing in a feature"},
        UnsoundBreath{"Future", [](RespirationMemory& r) { r.clock.time = from_ns(9'000'000'001); },
                      "before it was saved"},
        UnsoundBreath{"Never", [](RespirationMemory& r) { r.clock.time = Instant::min(); }, "known"},
        UnsoundBreath{"Phase", [](RespirationMemory& r) { r.clock.phase_rad = kNan; }, "phase and rate"},
        UnsoundBreath{"Variance", [](RespirationMemory& r) { r.clock.phase_variance_rad2 = -1.0; }, "covariance"},
        UnsoundBreath{"Covariance", [](RespirationMemory& r) { r.clock.covariance_rad2_per_s = 1e-4; }, "covariance"},
        UnsoundBreath{"Offset", [](RespirationMemory& r) { r.offset_rad = kNan; }, "channel"}),
    [](const auto& param) { return param.param.name; });

TEST(WarmRestart, GoesOnFromTheSameSetUpInTheSameBoot) {
  const auto memory = usable_memory(
      *parse_checkpoint(file_of(checkpoint_sample())), checkpoint_sample().set_up,
      {"boot", from_ns(12'000'000'000), checkpoint_sample().utc_ns, checkpoint_sample().suspended}, seconds(10));
  ASSERT_TRUE(memory) << memory.error().message;
  EXPECT_EQ(memory->features.size(), 2U);
  EXPECT_EQ(memory->ecg.size(), 2U);
  EXPECT_EQ(memory->respiration.clock.state, RespirationState::kLocked);
}

TEST(WarmRestart, InAnotherBootTheMapAloneCountsAndItsInstantsMove) {
  Checkpoint c = *parse_checkpoint(file_of(checkpoint_sample()));
  const Duration since_observed = c.saved - c.memory.features[0].last_observed;
  const Now now{"another", from_ns(2'000'000'000), c.utc_ns + 5'000'000'000};
  const auto memory = usable_memory(c, c.set_up, now, seconds(10));
  ASSERT_TRUE(memory) << memory.error().message;
  EXPECT_TRUE(memory->ecg.empty());
  EXPECT_EQ(memory->frame_period, Duration(0));
  EXPECT_TRUE(memory->respiration.found);
  EXPECT_EQ(memory->respiration.clock.state, RespirationState::kSearching);
  EXPECT_EQ(memory->features[0].last_observed, now.monotonic - seconds(5) - since_observed);
  EXPECT_EQ(memory->last_capture, now.monotonic - seconds(5) - (c.saved - c.memory.last_capture));
}

// The monotonic clock tells of two seconds, in which the heart has beaten for seven.
TEST(WarmRestart, AfterTheMachineHasSleptTheMapAloneCountsAndItsInstantsMove) {
  const Checkpoint c = *parse_checkpoint(file_of(checkpoint_sample()));
  const Now now{"boot", c.saved + seconds(2), c.utc_ns, c.suspended + seconds(5)};
  const auto memory = usable_memory(c, c.set_up, now, seconds(10));
  ASSERT_TRUE(memory) << memory.error().message;
  EXPECT_TRUE(memory->ecg.empty());
  EXPECT_EQ(memory->frame_period, Duration(0));
  EXPECT_EQ(memory->respiration.clock.state, RespirationState::kSearching);
  EXPECT_EQ(memory->features[0].last_observed, c.memory.features[0].last_observed - seconds(5));
  EXPECT_EQ(memory->last_capture, c.memory.last_capture - seconds(5));
}

TEST(WarmRestart, AsLongAsTheMachineSleptTheCheckpointAges) {
  const Checkpoint c = checkpoint_sample();
  const Now now{"boot", c.saved + seconds(2), c.utc_ns, c.suspended + seconds(9)};
  const auto memory = usable_memory(c, c.set_up, now, seconds(10));
  ASSERT_FALSE(memory);
  EXPECT_THAT(memory.error().message, HasSubstr("11 s old"));
}

TEST(WarmRestart, AnotherSetUpIsRefusedWithTheReason) {
  const Now now{"boot", from_ns(9'500'000'000), checkpoint_sample().utc_ns, checkpoint_sample().suspended};
  const auto reason = [&now](std::string perimap::SetUp::*part) {
    perimap::SetUp other = checkpoint_sample().set_up;
    other.*part = "different";
    const auto memory = usable_memory(checkpoint_sample(), other, now, seconds(10));
    return memory ? std::string("accepted") : memory.error().message;
  };
  EXPECT_THAT(reason(&perimap::SetUp::camera), HasSubstr("another camera"));
  EXPECT_THAT(reason(&perimap::SetUp::hand_eye), HasSubstr("another hand-eye"));
  EXPECT_THAT(reason(&perimap::SetUp::times), HasSubstr("another time offset"));
  EXPECT_THAT(reason(&perimap::SetUp::patient_frame), HasSubstr("another patient's frame"));
  EXPECT_THAT(reason(&perimap::SetUp::estimator), HasSubstr("another estimator"));
}

TEST(WarmRestart, WithAnotherTimeOffsetOrDelayTheSetUpIsAnother) {
  const perimap::SetUp as_it_was = set_up_of(Configuration{}, {});
  Configuration configuration;
  configuration.tracker.time_offset = std::chrono::milliseconds(20);
  EXPECT_NE(set_up_of(configuration, {}), as_it_was);
  configuration = {};
  configuration.camera.delay = std::chrono::milliseconds(33);
  EXPECT_NE(set_up_of(configuration, {}), as_it_was);
}

TEST(WarmRestart, InAnotherPrecisionTheSetUpIsTheSame) {
  PipelineSettings pipeline;
  const perimap::SetUp in_double = set_up_of(Configuration{}, pipeline);
  pipeline.estimator.precision = Precision::kSingle;
  EXPECT_EQ(set_up_of(Configuration{}, pipeline), in_double);
  pipeline.estimator.layout.cardiac_harmonics += 1;
  EXPECT_NE(set_up_of(Configuration{}, pipeline), in_double);
}

TEST(WarmRestart, WhatIsTooOldOrOfTheFutureIsRefusedWithTheReason) {
  const perimap::SetUp set_up = checkpoint_sample().set_up;
  const std::int64_t utc_ns = checkpoint_sample().utc_ns;
  const Duration suspended = checkpoint_sample().suspended;
  for (const Now& now :
       {Now{"boot", from_ns(20'000'000'000), utc_ns, suspended}, Now{"boot", from_ns(1), utc_ns, suspended},
        Now{"another", from_ns(1), utc_ns + 11'000'000'000}, Now{"another", from_ns(1), utc_ns - 1},
        Now{"", from_ns(1), utc_ns + 11'000'000'000}}) {
    const auto memory = usable_memory(checkpoint_sample(), set_up, now, seconds(10));
    ASSERT_FALSE(memory) << now.boot;
    EXPECT_THAT(memory.error().message, HasSubstr("s old"));
  }
}

TEST(ReplaceFile, ReplacesAWholeFileAndLeavesTheOldOneWhenItCannot) {
  std::string folder = (fs::temp_directory_path() / "perimap-checkpoint-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const fs::path file = fs::path(folder) / "checkpoint";
  ASSERT_TRUE(replace_file(file, "first"));
  ASSERT_TRUE(replace_file(file, "second one"));
  std::string text;
  std::getline(std::ifstream(file), text);
  EXPECT_EQ(text, "second one");
  // Something in the way of the part that is written first.
  fs::create_directory(file.string() + ".part");
  const auto failed = replace_file(file, "third");
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr(file.string()));
  std::getline(std::ifstream(file), text);
  EXPECT_EQ(text, "second one");
  fs::remove_all(folder);
}

TEST(RemoveFile, TakesAwayTheFileAndWhatAnInterruptedWriteHasLeftBesideIt) {
  std::string folder = (fs::temp_directory_path() / "perimap-checkpoint-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const fs::path file = fs::path(folder) / "checkpoint";
  ASSERT_TRUE(replace_file(file, "a patient's"));
  EXPECT_EQ(fs::status(file).permissions(), fs::perms(0600));
  std::ofstream(file.string() + ".part") << "the same patient's, half";
  std::ofstream(fs::path(folder) / "checkpoint.other") << "another's";
  ASSERT_TRUE(remove_file(file));
  EXPECT_FALSE(fs::exists(file));
  EXPECT_FALSE(fs::exists(file.string() + ".part"));
  EXPECT_TRUE(fs::exists(fs::path(folder) / "checkpoint.other"));
  EXPECT_TRUE(remove_file(file)) << "where there is none";
  fs::create_directory(file);
  std::ofstream(file.string() + ".part") << "half";
  const auto failed = remove_file(file);
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr(file.string() + ": cannot be removed"));
  EXPECT_FALSE(fs::exists(file.string() + ".part")) << "all the same";
  fs::remove_all(folder);
}

// A block of half a second.
EcgBlock block_at(Instant first) {
  EcgBlock block;
  block.first_sample_time = first;
  block.sample_period = std::chrono::milliseconds(50);
  block.count = 10;
  return block;
}

TEST(RecentEcg, KeepsTheLastMinuteThatWasHeard) {
  RecentEcg ecg;
  Instant t(seconds(10));
  for (int i = 0; i < 200; ++i, t += std::chrono::milliseconds(500)) ecg.add(block_at(t));
  ASSERT_EQ(ecg.blocks().size(), 120U);
  EXPECT_EQ(ecg.blocks().back().first_sample_time, t - std::chrono::milliseconds(500));
  EXPECT_EQ(ecg.blocks().front().first_sample_time, t - seconds(60));
}

TEST(RecentEcg, CountsNoGapsSoThatARhythmFromBeforeManyOfThemStays) {
  RecentEcg ecg;
  Instant t(seconds(10));
  for (int i = 0; i < 60; ++i, t += std::chrono::milliseconds(500)) ecg.add(block_at(t));
  for (int i = 0; i < 50; ++i, t += seconds(2)) ecg.add(block_at(t));
  ASSERT_EQ(ecg.blocks().size(), 110U) << "100 s of gaps and the half minute before them";
  EXPECT_EQ(ecg.blocks().front().first_sample_time, Instant(seconds(10)));
}

TEST(RecentEcg, BlocksWithoutSamplesTakeNoRoom) {
  RecentEcg ecg;
  EcgBlock empty = block_at(Instant(seconds(1)));
  empty.count = 0;
  for (int i = 0; i < 1000; ++i) ecg.add(empty);
  EXPECT_TRUE(ecg.blocks().empty());
  ecg.add(block_at(Instant(seconds(2))));
  ecg.clear();
  EXPECT_TRUE(ecg.blocks().empty());
}

}  // namespace
}  // namespace perimap

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
#include "daemon/checkpoint/warm_restart.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr int kStateSize = 9;
constexpr std::size_t kHeader = 16;

FeatureMemory feature(std::uint32_t id) {
  FeatureMemory f;
  f.id = id;
  f.first_observed = from_ns(1'000'000'007);
  f.first_observed_px = {12.25, -3.5};
  f.last_observed = from_ns(5'000'000'011);
  for (std::size_t l = 0; l < f.patch.levels.size(); ++l) {
    f.patch.levels[l].usable = true;
    f.patch.levels[l].side = PatchTemplate::kSide[l];
    f.patch.levels[l].offset_x = 0.25;
    f.patch.levels[l].value[3] = static_cast<std::int16_t>(-7 - static_cast<int>(l));
  }
  f.patch_state.px = {100.5, 200.25};
  f.patch_state.gain = 1.125;
  f.updates = 77;
  f.converged = true;
  f.largest_deviation_mm = 0.5;
  f.estimate.x = StateVector::LinSpaced(kStateSize, -1.0, 1.0);
  f.estimate.P = StateMatrix::Identity(kStateSize, kStateSize);
  f.estimate.P(2, 1) = f.estimate.P(1, 2) = 0.125;
  return f;
}

Checkpoint checkpoint() {
  Checkpoint c;
  c.set_up = {"camera", "hand-eye", "frame", "estimator"};
  c.boot = "boot";
  c.saved = from_ns(9'000'000'000);
  c.utc_ns = 1'700'000'000'000'000'000;
  c.memory.last_capture = from_ns(8'900'000'000);
  c.memory.last_frame_sequence = 267;
  c.memory.frame_period = std::chrono::milliseconds(33);
  EcgBlock block;
  block.first_sample_time = from_ns(8'000'000'000);
  block.sample_period = std::chrono::milliseconds(4);
  block.count = 3;
  block.mV = {0.5F, -0.25F, 1.5F};
  c.memory.ecg = {block, block};
  return c;
}

std::string file_of(const Checkpoint& c, int features = 2) {
  std::vector<std::string> serialized;
  for (int i = 0; i < features; ++i)
    serialized.push_back(serialize_feature(feature(static_cast<std::uint32_t>(i + 1))));
  return serialize(c, serialized);
}

TEST(CheckpointFile, IsReadBackAsItWasWritten) {
  const auto read = parse_checkpoint(file_of(checkpoint()));
  ASSERT_TRUE(read) << read.error().message;
  const Checkpoint written = checkpoint();
  EXPECT_EQ(read->set_up, written.set_up);
  EXPECT_EQ(read->boot, written.boot);
  EXPECT_EQ(read->saved, written.saved);
  EXPECT_EQ(read->utc_ns, written.utc_ns);
  EXPECT_EQ(read->memory.last_capture, written.memory.last_capture);
  EXPECT_EQ(read->memory.last_frame_sequence, written.memory.last_frame_sequence);
  EXPECT_EQ(read->memory.frame_period, written.memory.frame_period);
  ASSERT_EQ(read->memory.ecg.size(), 2U);
  EXPECT_EQ(read->memory.ecg[1].mV, written.memory.ecg[1].mV);
  EXPECT_EQ(read->memory.ecg[1].first_sample_time, written.memory.ecg[1].first_sample_time);
  ASSERT_EQ(read->memory.features.size(), 2U);
  const FeatureMemory& f = read->memory.features[1];
  const FeatureMemory g = feature(2);
  EXPECT_EQ(f.id, g.id);
  EXPECT_EQ(f.first_observed, g.first_observed);
  EXPECT_EQ(f.first_observed_px, g.first_observed_px);
  EXPECT_EQ(f.last_observed, g.last_observed);
  EXPECT_EQ(std::memcmp(&f.patch.levels[2].value, &g.patch.levels[2].value, sizeof g.patch.levels[2].value), 0);
  EXPECT_EQ(f.patch_state.px, g.patch_state.px);
  EXPECT_EQ(f.patch_state.gain, g.patch_state.gain);
  EXPECT_EQ(f.updates, g.updates);
  EXPECT_EQ(f.converged, g.converged);
  EXPECT_EQ(f.largest_deviation_mm, g.largest_deviation_mm);
  EXPECT_EQ(f.estimate.x, g.estimate.x);
  EXPECT_EQ(f.estimate.P, g.estimate.P);
}

TEST(CheckpointFile, HoldsNoFeatureToo) {
  const auto read = parse_checkpoint(file_of(checkpoint(), 0));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->memory.features.empty());
}

TEST(CheckpointFile, AnyPartOfOneIsRefused) {
  const std::string whole = file_of(checkpoint());
  for (std::size_t size = 0; size < whole.size(); size += size < 600 ? 1 : 997) {
    EXPECT_FALSE(parse_checkpoint(whole.substr(0, size))) << size;
    const std::string_view body = std::string_view(whole).substr(std::min(size, kHeader));
    EXPECT_FALSE(parse_checkpoint_body(body.substr(0, size - std::min(size, kHeader)))) << size;
  }
  EXPECT_FALSE(parse_checkpoint(whole + "x"));
}

TEST(CheckpointFile, AChangedByteIsNoticed) {
  const std::string whole = file_of(checkpoint());
  for (std::size_t at = 0; at < whole.size(); at += 101) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    EXPECT_FALSE(parse_checkpoint(changed)) << at;
  }
}

struct Unsound {
  const char* name;
  void (*spoil)(FeatureMemory&);
  const char* expected;
};

class UnsoundFeature : public testing::TestWithParam<Unsound> {};

TEST_P(UnsoundFeature, IsRefusedAndNamed) {
  FeatureMemory f = feature(1);
  GetParam().spoil(f);
  const std::vector<std::string> features{serialize_feature(f)};
  const auto read = parse_checkpoint(serialize(checkpoint(), features));
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

TEST(WarmRestart, GoesOnFromTheSameSetUpInTheSameBoot) {
  const auto memory = usable_memory(*parse_checkpoint(file_of(checkpoint())), checkpoint().set_up,
                                    {"boot", from_ns(12'000'000'000), checkpoint().utc_ns}, seconds(10));
  ASSERT_TRUE(memory) << memory.error().message;
  EXPECT_EQ(memory->features.size(), 2U);
  EXPECT_EQ(memory->ecg.size(), 2U);
}

TEST(WarmRestart, InAnotherBootTheMapAloneCountsAndItsInstantsMove) {
  Checkpoint c = *parse_checkpoint(file_of(checkpoint()));
  const Duration since_observed = c.saved - c.memory.features[0].last_observed;
  const Now now{"another", from_ns(2'000'000'000), c.utc_ns + 5'000'000'000};
  const auto memory = usable_memory(c, c.set_up, now, seconds(10));
  ASSERT_TRUE(memory) << memory.error().message;
  EXPECT_TRUE(memory->ecg.empty());
  EXPECT_EQ(memory->frame_period, Duration(0));
  EXPECT_EQ(memory->features[0].last_observed, now.monotonic - seconds(5) - since_observed);
}

TEST(WarmRestart, AnotherSetUpIsRefusedWithTheReason) {
  const Now now{"boot", from_ns(9'500'000'000), checkpoint().utc_ns};
  const auto reason = [&now](std::string perimap::SetUp::*part) {
    perimap::SetUp other = checkpoint().set_up;
    other.*part = "different";
    const auto memory = usable_memory(checkpoint(), other, now, seconds(10));
    return memory ? std::string("accepted") : memory.error().message;
  };
  EXPECT_THAT(reason(&perimap::SetUp::camera), HasSubstr("another camera"));
  EXPECT_THAT(reason(&perimap::SetUp::hand_eye), HasSubstr("another hand-eye"));
  EXPECT_THAT(reason(&perimap::SetUp::patient_frame), HasSubstr("another patient's frame"));
  EXPECT_THAT(reason(&perimap::SetUp::estimator), HasSubstr("another estimator"));
}

TEST(WarmRestart, WhatIsTooOldOrOfTheFutureIsRefusedWithTheReason) {
  const perimap::SetUp set_up = checkpoint().set_up;
  const std::int64_t utc_ns = checkpoint().utc_ns;
  for (const Now& now : {Now{"boot", from_ns(20'000'000'000), utc_ns}, Now{"boot", from_ns(1), utc_ns},
                         Now{"another", from_ns(1), utc_ns + 11'000'000'000}, Now{"another", from_ns(1), utc_ns - 1},
                         Now{"", from_ns(1), utc_ns + 11'000'000'000}}) {
    const auto memory = usable_memory(checkpoint(), set_up, now, seconds(10));
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

}  // namespace
}  // namespace perimap

#include "tests/unit/checkpoint/samples.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace perimap::test {
namespace {

constexpr int kStateSize = 9;

}  // namespace

FeatureMemory feature_sample(std::uint32_t id) {
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
  f.breathing = true;
  f.largest_deviation_mm = 0.5;
  f.estimate.x = StateVector::LinSpaced(kStateSize, -1.0, 1.0);
  f.estimate.P = StateMatrix::Identity(kStateSize, kStateSize);
  f.estimate.P(2, 1) = f.estimate.P(1, 2) = 0.125;
  return f;
}

RespirationMemory respiration_sample() {
  RespirationMemory r;
  r.found = true;
  r.wave.a[0] = {1.0, -2.0, 3.0};
  r.wave.b[1] = {0.25, 0.5, -0.125};
  r.clock.state = RespirationState::kLocked;
  r.clock.time = from_ns(8'950'000'000);
  r.clock.phase_rad = -2.5;
  r.clock.rate_rad_per_s = 1.6;
  r.clock.phase_variance_rad2 = 1e-4;
  r.clock.covariance_rad2_per_s = -2e-5;
  r.clock.rate_variance_rad2_per_s2 = 1e-5;
  r.offset_known = true;
  r.offset_rad = 0.75;
  return r;
}

SetupMemory setup_sample() {
  SetupMemory setup;
  setup.asked = setup.doubted = true;
  setup.widening_mm = 0.75;
  setup.widened_at_mm = 1.25;
  setup.told.state = SetupState::kDoubted;
  setup.told.blamed[index_of(SetupPart::kFocalLength)] = true;
  setup.told.deviation = SetupVector::LinSpaced(1.0, 10.0);
  setup.told.uncertainty = SetupVector::LinSpaced(11.0, 20.0);
  setup.told.blamed_deviation = SetupVector::LinSpaced(21.0, 30.0);
  setup.told.blamed_uncertainty = SetupVector::LinSpaced(31.0, 40.0);
  setup.told.surface_mm = 2.5;
  setup.told.surface_deviation_mm = 0.5;
  setup.told.widening_mm = 2.25;
  return setup;
}

Checkpoint checkpoint_sample() {
  Checkpoint c;
  c.set_up = {"camera", "hand-eye", "times", "frame", "estimator"};
  c.boot = "boot";
  c.saved = from_ns(9'000'000'000);
  c.utc_ns = 1'700'000'000'000'000'000;
  c.suspended = std::chrono::minutes(3);
  c.memory.last_capture = from_ns(8'900'000'000);
  c.memory.frame_period = std::chrono::milliseconds(33);
  EcgBlock block;
  block.first_sample_time = from_ns(8'000'000'000);
  block.sample_period = std::chrono::milliseconds(4);
  block.count = 3;
  block.mV = {0.5F, -0.25F, 1.5F};
  EcgBlock two = block;
  two.has_second = true;
  two.second_off = true;
  two.second_mV = {-1.0F, 2.0F, -3.0F};
  c.memory.ecg = {block, two};
  c.memory.respiration = respiration_sample();
  c.memory.law = {PhaseLaw::kWarped, Seconds(0.8), 12.5, {40.0, 12.0, 20.0}, {-9.0, -3.0, -6.0}};
  c.memory.setup = setup_sample();
  return c;
}

std::string file_of(const Checkpoint& c, int features) {
  std::vector<std::string> serialized;
  for (int i = 0; i < features; ++i)
    serialized.push_back(serialize_feature(feature_sample(static_cast<std::uint32_t>(i + 1))));
  return serialize(c, serialized);
}

}  // namespace perimap::test

// Tests of the bank run once on every instruction set that the machine has.
#pragma once

#include <gtest/gtest.h>

#include "core/bank/feature_bank.hpp"
#include "core/estimation/observation.hpp"

namespace perimap::test {

class OnEveryTarget : public testing::TestWithParam<SimdTarget> {
 protected:
  template <class Real = double>
  FeatureBank<Real> bank(const BasisLayout& layout, int features) const {
    return FeatureBank<Real>({.layout = layout, .features = features, .target = GetParam()});
  }
};

inline std::string target_name(const testing::TestParamInfo<SimdTarget>& info) { return simd_target_name(info.param); }

// A sweep for one observation and its update.
template <class Real, class Model>
LaneOutcomes<Real> learn(FeatureBank<Real>& bank, int feature, const Observation& observation, const Model& model,
                         const UpdateSettings& settings = {}) {
  SweepPhases<Real> phases;
  phases.add_learnt(observation.b, Basis());
  bank.sweep(feature / kLanes, phases);
  LaneObservations<Real> measured;
  measured.set(feature % kLanes, observation.z, observation.R);
  LaneOutcomes<Real> outcomes;
  bank.update(feature / kLanes, phases, 0, observation.X_CW, model, measured, settings, outcomes);
  return outcomes;
}

template <class Real>
FeatureEstimate estimate_of(const FeatureBank<Real>& bank, int feature) {
  FeatureEstimate estimate;
  bank.get(feature, estimate);
  return estimate;
}

}  // namespace perimap::test

#include "core/pipeline/map_bank.hpp"

#include <cstddef>
#include <utility>

namespace perimap {
namespace {

template <class From, class To, std::size_t N>
void convert(const From (&from)[N], To (&to)[N]) noexcept {
  for (std::size_t i = 0; i < N; ++i) to[i] = static_cast<To>(from[i]);
}

template <class From, class To, std::size_t N, std::size_t M>
void convert(const From (&from)[N][M], To (&to)[N][M]) noexcept {
  for (std::size_t i = 0; i < N; ++i) convert(from[i], to[i]);
}

void convert(const LaneMotions<float>& from, LaneMotions<double>& to) noexcept {
  to.valid = from.valid;
  convert(from.position, to.position);
  convert(from.velocity, to.velocity);
  convert(from.covariance, to.covariance);
}

void convert(const LaneObservations<double>& from, LaneObservations<float>& to) noexcept {
  to.measured = from.measured;
  convert(from.z, to.z);
  convert(from.R, to.R);
}

void convert(const LaneOutcomes<float>& from, LaneOutcomes<double>& to) noexcept {
  to.considered = from.considered;
  to.accepted = from.accepted;
  convert(from.status, to.status);
  convert(from.iterations, to.iterations);
  convert(from.map_cost, to.map_cost);
  convert(from.innovation, to.innovation);
  convert(from.normalised_innovation_squared, to.normalised_innovation_squared);
}

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

// As std::visit of a variant of two that always holds one of them: it has nothing to throw.
template <class Banks, class Function>
void with(Banks& banks, const Function& function) noexcept {
  if (auto* const first = std::get_if<0>(&banks)) {
    function(*first);
  } else {
    function(*std::get_if<1>(&banks));
  }
}

}  // namespace

MapBank::Banks MapBank::make(const BankSettings& settings, Precision precision) {
  if (precision == Precision::kDouble) return Double{FeatureBank<double>(settings)};
  FeatureBank<float> bank(settings);
  const auto groups = static_cast<std::size_t>(bank.groups());
  return Single{std::move(bank), std::vector<SweepPhases<float>>(groups)};
}

MapBank::MapBank(const BankSettings& settings, Precision precision)
    : banks_(make(settings, precision)),
      layout_(settings.layout),
      groups_(std::visit([](const auto& held) { return held.bank.groups(); }, banks_)) {}

void MapBank::set(int feature, const FeatureEstimate& estimate) noexcept {
  with(banks_, [&](auto& held) { held.bank.set(feature, estimate); });
}

void MapBank::clear(int feature) noexcept {
  with(banks_, [&](auto& held) { held.bank.clear(feature); });
}

void MapBank::get(int feature, FeatureEstimate& estimate) const noexcept {
  with(banks_, [&](const auto& held) { held.bank.get(feature, estimate); });
}

void MapBank::get(int feature, StateVector& x) const noexcept {
  with(banks_, [&](const auto& held) { held.bank.get(feature, x); });
}

void MapBank::diffuse(int feature, double deviation_mm) noexcept {
  with(banks_, [&](auto& held) { held.bank.diffuse(feature, deviation_mm); });
}

void MapBank::sweep(int group, const SweepPhases<double>& phases) noexcept {
  with(banks_, Overloaded{[&](Double& held) { held.bank.sweep(group, phases); },
                          [&](Single& held) {
                            held.swept[static_cast<std::size_t>(group)].assign(phases);
                            held.bank.sweep(group, held.phases(group));
                          }});
}

void MapBank::motion(int group, const SweepPhases<double>& phases, int k, LaneMotions<double>& motions) noexcept {
  with(banks_, Overloaded{[&](Double& held) { held.bank.motion(group, phases, k, motions); },
                          [&](Single& held) {
                            LaneMotions<float> single;
                            held.bank.motion(group, held.phases(group), k, single);
                            convert(single, motions);
                          }});
}

void MapBank::motion_near(int group, const SweepPhases<double>& phases, int k, const SweepPhase<double>& at,
                          LaneMotions<double>& motions) noexcept {
  with(banks_, Overloaded{[&](Double& held) { held.bank.motion_near(group, phases, k, at, motions); },
                          [&](Single& held) {
                            SweepPhase<float> single_at;
                            single_at.assign(at);
                            LaneMotions<float> single;
                            held.bank.motion_near(group, held.phases(group), k, single_at, single);
                            convert(single, motions);
                          }});
}

void MapBank::position_gain(int feature, const SweepPhases<double>& phases, int k, PositionGain& M) noexcept {
  with(banks_,
       Overloaded{[&](Double& held) { held.bank.position_gain(feature, phases, k, M); },
                  [&](Single& held) { held.bank.position_gain(feature, held.phases(feature / kLanes), k, M); }});
}

void MapBank::update(int group, const SweepPhases<double>& phases, int k, const Pose& X_CW, const PixelModel& model,
                     const LaneObservations<double>& observations, const UpdateSettings& settings,
                     LaneOutcomes<double>& outcomes) noexcept {
  with(banks_,
       Overloaded{
           [&](Double& held) { held.bank.update(group, phases, k, X_CW, model, observations, settings, outcomes); },
           [&](Single& held) {
             LaneObservations<float> single_observations;
             convert(observations, single_observations);
             LaneOutcomes<float> single;
             held.bank.update(group, held.phases(group), k, X_CW, model, single_observations, settings, single);
             convert(single, outcomes);
           }});
}

}  // namespace perimap

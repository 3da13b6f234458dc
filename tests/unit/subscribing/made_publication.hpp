// What a perimapd publishes, made up: positions that a test can compute by itself.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "core/time/instant.hpp"
#include "drivers/recording/cdr.hpp"

extern "C" {
#include "perimap.h"
#include "perimap_mesh.h"
}

namespace perimap::test {

// A heart that beats at whole seconds of the clock. The samples borrow its memory.
class MadePublication {
 public:
  static constexpr std::int64_t kUtcMinusMonotonic_ns = 1'795'000'000'123'456'789;
  static constexpr std::size_t kFeatures = 4;  // the last one is invalid
  static constexpr std::size_t kVertices = 5;  // the first one is uncertain
  static constexpr double kFeatureDeviation_mm = 0.5;

  MadePublication() {
    for (std::size_t i = 0; i < kFeatures; ++i) {
      features_[i].id = static_cast<std::uint32_t>(10 + i);
      features_[i].state = i == 3 ? perimap_FEATURE_INVALID : static_cast<perimap_FeatureState>(1 + i);
      for (const int diagonal : {0, 3, 5}) features_[i].covariance_W_mm2[diagonal] = 0.01;
      features_[i].covariance_W_mm2[3] = kFeatureDeviation_mm * kFeatureDeviation_mm;
    }
    // Axis, coefficient (constant, cosine, minus sine), vertex.
    for (std::size_t v = 0; v < kVertices; ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) coefficients_[(axis * 3) * kVertices + v] = base(v)[axis];
      coefficients_[7 * kVertices + v] = 2.0F;
      for (const std::size_t diagonal : {0U, 3U, 5U}) covariances_[diagonal * kVertices + v] = 0.04F;
    }
  }

  static double phase_at(Instant t) {
    const std::int64_t within_ns = to_ns(t) % 1'000'000'000;
    return 2.0 * std::numbers::pi * 1e-9 * static_cast<double>(within_ns);
  }
  static std::array<double, 3> feature_at(std::size_t i, Instant t) {
    const auto x = static_cast<double>(i);
    return {10.0 * x, -5.0 * x, 100.0 + 3.0 * std::cos(phase_at(t))};
  }
  static std::array<double, 3> vertex_at(std::size_t v, Instant t) {
    const auto at = base(v);
    return {at[0], at[1], at[2] + 2.0 * std::cos(phase_at(t))};
  }
  static constexpr std::array<double, 3> kCamera_mm = {1.0, -2.0, 30.0};
  // A quarter turn about z: x of the camera is y of the world.
  static constexpr std::array<double, 4> kCamera_wxyz = {0.70710678118654757, 0.0, 0.0, 0.70710678118654757};

  // Good, with the camera's pose; a test makes of it what it wants.
  perimap_Surface& surface_at(Instant release, std::uint64_t sequence) {
    surface_ = {};
    name(surface_);
    std::copy_n("tracker", 8, surface_.frame_id);
    surface_.state = perimap_SURFACE_GOOD;
    surface_.sample_sequence = surface_.frame_sequence = sequence;
    surface_.capture_time_ns = to_ns(release) - 50'000'000;
    surface_.release_time_ns = surface_.valid_time_ns = to_ns(release);
    surface_.valid_until_ns = to_ns(release) + 200'000'000;
    surface_.release_utc_ns = to_ns(release) + kUtcMinusMonotonic_ns;
    surface_.cardiac_phase_rad = phase_at(release);
    for (std::size_t i = 0; i < kFeatures; ++i) {
      const auto p = feature_at(i, release);
      std::copy(p.begin(), p.end(), features_[i].position_W_mm);
    }
    surface_.features = {kFeatures, kFeatures, features_.data(), false};
    surface_.camera_pose_known = true;
    std::copy(kCamera_mm.begin(), kCamera_mm.end(), surface_.translation_WC_mm);
    std::copy(kCamera_wxyz.begin(), kCamera_wxyz.end(), surface_.rotation_WC_wxyz);
    return surface_;
  }

  perimap_SurfaceModel& model_at(Instant now, std::uint64_t sequence) {
    model_ = {};
    name(model_);
    model_.sample_sequence = sequence;
    model_.state = perimap_SURFACE_GOOD;
    model_.cardiac_harmonics = 1;
    model_.cardiac_clock.state = perimap_PHASE_LOCKED;
    model_.cardiac_clock.law = perimap_PHASE_LAW_LINEAR;
    const std::int64_t beat_ns = to_ns(now) / 1'000'000'000 * 1'000'000'000;
    for (std::size_t i = 0; i < cycles_.size(); ++i) {
      cycles_[i] = {};
      cycles_[i].begin_time_ns = beat_ns + (static_cast<std::int64_t>(i) - 2) * 1'000'000'000;
      cycles_[i].length_ns = 1'000'000'000;
    }
    model_.cardiac_cycles = {static_cast<std::uint32_t>(cycles_.size()), static_cast<std::uint32_t>(cycles_.size()),
                             cycles_.data(), false};
    model_.time_ns = to_ns(now);
    model_.time_utc_ns = to_ns(now) + kUtcMinusMonotonic_ns;
    model_.valid_from_ns = cycles_.front().begin_time_ns;
    model_.valid_until_ns = model_.expected_until_ns = cycles_.back().begin_time_ns + 999'999'999;
    for (std::size_t i = 0; i < kFeatures; ++i) {
      auto& feature = model_features_[i];
      feature = {};
      feature.id = features_[i].id;
      feature.state = features_[i].state;
      feature.largest_deviation_mm = kFeatureDeviation_mm;
      auto& x = model_coefficients_[i];
      x = {10.0 * static_cast<double>(i), 0, 0, -5.0 * static_cast<double>(i), 0, 0, 100.0, 3.0, 0};
      feature.coefficients_W_mm = {static_cast<std::uint32_t>(x.size()), static_cast<std::uint32_t>(x.size()), x.data(),
                                   false};
    }
    model_.features = {kFeatures, kFeatures, model_features_.data(), false};
    return model_;
  }

  perimap_SurfaceMesh& mesh_at(Instant now, std::uint64_t sequence) {
    mesh_ = {};
    std::copy_n("made", 5, mesh_.source);
    mesh_.run_id[0] = run_;
    mesh_.sample_sequence = sequence;
    mesh_.time_ns = to_ns(now);
    mesh_.time_utc_ns = to_ns(now) + kUtcMinusMonotonic_ns;
    mesh_.valid_until_ns = to_ns(now) + 5'000'000'000;
    mesh_.state = perimap_MESH_THERE;
    mesh_.phase_law = perimap_PHASE_LAW_LINEAR;
    mesh_.cardiac_harmonics = 1;
    mesh_.vertex_states = {kVertices, kVertices, vertex_states_.data(), false};
    mesh_.coefficients_W_mm = {static_cast<std::uint32_t>(coefficients_.size()),
                               static_cast<std::uint32_t>(coefficients_.size()), coefficients_.data(), false};
    mesh_.covariances_W_mm2 = {static_cast<std::uint32_t>(covariances_.size()),
                               static_cast<std::uint32_t>(covariances_.size()), covariances_.data(), false};
    mesh_.triangles = {static_cast<std::uint32_t>(triangles_.size()), static_cast<std::uint32_t>(triangles_.size()),
                       triangles_.data(), false};
    return mesh_;
  }

  void restart() { ++run_; }

 private:
  static std::array<float, 3> base(std::size_t v) {
    const auto i = static_cast<float>(v);
    return {8.0F * (v % 2 == 0 ? 0.0F : 1.0F), 6.0F * i, 90.0F + i};
  }

  template <class T>
  void name(T& sample) const {
    std::copy_n("made", 5, sample.source);
    std::copy_n("frame", 6, sample.stream);
    sample.run_id[0] = run_;
  }

  std::uint8_t run_ = 1;
  std::array<perimap_SurfaceFeature, kFeatures> features_{};
  std::array<perimap_ModelFeature, kFeatures> model_features_{};
  std::array<std::array<double, 9>, kFeatures> model_coefficients_{};
  std::array<perimap_CardiacCycle, 6> cycles_{};
  std::array<std::uint8_t, kVertices> vertex_states_{perimap_VERTEX_UNCERTAIN};
  std::array<float, 9 * kVertices> coefficients_{};
  std::array<float, 6 * kVertices> covariances_{};
  std::array<std::uint32_t, 6> triangles_{1, 2, 3, 2, 4, 3};
  perimap_Surface surface_{};
  perimap_SurfaceModel model_{};
  perimap_SurfaceMesh mesh_{};
};

// One that owns what it has.
template <class T>
Sample<T> owned(const T& sample) {
  return std::move(*deserialize<T>(*CdrSerializer().serialize(sample)));
}

}  // namespace perimap::test

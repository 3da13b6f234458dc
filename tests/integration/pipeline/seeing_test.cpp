// What the pipeline sees of a heart at 1280x720 while an instrument comes and goes, highlights and smoke wander, the
// picture is blurred by motion and the scope sweeps about: do converged features that return to view come back, and is
// what passes the gate where the feature is?
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/simulated/simulated_session.hpp"

namespace perimap {
namespace {

struct Silent final : Publication {
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
};

constexpr double kPatch_px = 14;  // a patch with its margin must be in view
constexpr int kAwayFrames = 5;    // out of view so long, a feature has left
constexpr int kBackFrames = 15;   // 0.5 s
constexpr double kOff_px = 3;

SimulationSettings hard_to_see(Look look) {
  SimulationSettings settings;
  settings.look = look;
  settings.width = 1280;
  settings.height = 720;
  settings.duration = std::chrono::seconds(30);
  settings.scope_sweep = 4;
  settings.exposure_share = 0.5;
  settings.instrument = true;
  settings.glints = 12;
  settings.smoke = 1;
  return settings;
}

// One frame's truth, made once for all that look.
struct TrueFrame {
  TrueFrame(const Simulation& simulation, std::size_t index)
      : frame(simulation.frames()[index]), surface(simulation.truth().view(frame.X_WC, frame.stamp.capture)) {}

  const Simulation::Frame& frame;
  SurfaceView surface;
};

// A feature by the material point that it was first seen on.
struct Watched {
  SurfacePoint point;
  bool converged = false;
  int away = 0;             // frames out of view in a row
  int back = 0;             // frames since it returned; 0 when it is not being waited for
  bool seen_again = false;  // since it returned
};

struct Figures {
  int returned = 0, reacquired = 0;
  int gated = 0, off = 0;
  int gated_by_last_view = 0, off_by_last_view = 0;
  int frames = 0, frames_short_of_features = 0;
  int least_live = 1 << 30;
  std::vector<double> errors_px;   // of gated matches
  std::vector<double> normalised;  // their squares under the match's own covariance, over 2
};

class Watch {
 public:
  Watch(const Simulation& simulation, const Pipeline& pipeline) : simulation_(simulation), pipeline_(pipeline) {}

  void look(const TrueFrame& now) {
    std::map<std::uint32_t, const FeatureSlot*> slots;
    int live = 0;
    for (const FeatureSlot& slot : pipeline_.slots()) {
      if (slot.state == SlotState::kEmpty) continue;
      ++live;
      slots[slot.id] = &slot;
      if (slot.state == SlotState::kMapped && !watched_.contains(slot.id)) begin(slot);
    }
    constexpr std::uint64_t kSettled = 150;
    if (now.frame.stamp.sequence >= kSettled) {
      ++figures.frames;
      figures.least_live = std::min(figures.least_live, live);
      if (verbose() && 10 * live < 9 * static_cast<int>(pipeline_.slots().size())) {
        std::printf("short: frame %d, %d live\n", static_cast<int>(now.frame.stamp.sequence), live);
      }
      figures.frames_short_of_features += 10 * live < 9 * static_cast<int>(pipeline_.slots().size()) ? 1 : 0;
    }
    for (auto& [id, feature] : watched_) {
      const auto slot = slots.find(id);
      look(feature, slot == slots.end() ? nullptr : slot->second, now);
    }
    std::erase_if(watched_, [&](const auto& entry) { return !slots.contains(entry.first) && !entry.second.converged; });
  }

  Figures figures;

 private:
  void begin(const FeatureSlot& slot) {
    const auto X_WC = simulation_.truth().camera_pose(slot.first_observed);
    if (!X_WC) return;
    const auto point =
        simulation_.truth().first_hit(*X_WC, simulation_.lens().ray(slot.first_observed_px), slot.first_observed);
    if (point) watched_[slot.id].point = *point;
  }

  void look(Watched& feature, const FeatureSlot* slot, const TrueFrame& now) {
    const Vector3d p_W = simulation_.truth().position(feature.point, now.frame.stamp.capture);
    const Vector3d p_C = now.frame.X_WC.inverse() * p_W;
    const Vector2d px = p_C.z() > 1 ? simulation_.lens().project(p_C) : Vector2d::Constant(-1e6);
    const bool found = slot != nullptr && slot->match_agrees && slot->state == SlotState::kMapped;
    const bool near = found && (slot->match.px - px).norm() <= kOff_px;
    if (found) {
      const Vector2d e = slot->match.px - px;
      ++figures.gated;
      figures.off += near ? 0 : 1;
      figures.gated_by_last_view += slot->seen_by_last_view ? 1 : 0;
      figures.off_by_last_view += slot->seen_by_last_view && !near ? 1 : 0;
      figures.errors_px.push_back(e.norm());
      figures.normalised.push_back(0.5 * e.dot(slot->match.covariance_px2.inverse() * e));
      if (!near && verbose()) {
        std::printf(
            "off: frame %d id %u by %.1f, %.1f px at %.0f, %.0f correlation %.3f by last view %d converged %d visible "
            "%d\n",
            static_cast<int>(now.frame.stamp.sequence), slot->id, e.x(), e.y(), px.x(), px.y(), slot->match.correlation,
            static_cast<int>(slot->seen_by_last_view), static_cast<int>(slot->converged),
            static_cast<int>(is_visible(px, p_C, now)));
      }
    }
    if (slot != nullptr && slot->state == SlotState::kMapped && slot->converged && near) feature.converged = true;
    if (!feature.converged) return;

    if (!is_visible(px, p_C, now)) {
      ++feature.away;
      feature.back = 0;
      return;
    }
    if (feature.away >= kAwayFrames) {
      feature.back = 1;
      feature.seen_again = false;
    }
    feature.away = 0;
    if (feature.back == 0) return;
    feature.seen_again = feature.seen_again || near;
    if (feature.back++ < kBackFrames) return;
    ++figures.returned;
    figures.reacquired += feature.seen_again ? 1 : 0;
    if (!feature.seen_again && verbose()) {
      std::printf("not back: frame %d %s at %.0f, %.0f match %d correlation %.3f\n",
                  static_cast<int>(now.frame.stamp.sequence), slot == nullptr ? "given up" : "there", px.x(), px.y(),
                  slot == nullptr ? -1 : static_cast<int>(slot->match.state),
                  slot == nullptr ? 0 : slot->match.correlation);
    }
    feature.back = 0;
    // Given up, it is counted once.
    if (slot == nullptr) feature.converged = false;
  }

  [[nodiscard]] bool is_visible(const Vector2d& px, const Vector3d& p_C, const TrueFrame& now) const {
    const SimulationSettings& settings = simulation_.settings();
    if (px.x() < kPatch_px || px.y() < kPatch_px || px.x() > settings.width - kPatch_px ||
        px.y() > settings.height - kPatch_px) {
      return false;
    }
    const Duration since_start = now.frame.stamp.capture - simulation_.start();
    if (simulation_.obstacles().instrument_covers(px, since_start, kPatch_px)) return false;
    const auto hit = now.surface.first_hit(p_C);
    constexpr double kSamePlace_mm = 1;
    return hit &&
           (simulation_.truth().position(*hit, now.frame.stamp.capture) - now.frame.X_WC * p_C).norm() < kSamePlace_mm;
  }

  static bool verbose() { return std::getenv("PERIMAP_SEEING_VERBOSE") != nullptr; }

  const Simulation& simulation_;
  const Pipeline& pipeline_;
  std::map<std::uint32_t, Watched> watched_;
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// As many features as one picture takes, so that those that are missing are missing in it.
PipelineSettings settings_for(const Simulation& simulation, const TrackerNoise& noise) {
  PipelineSettings settings = test::settings_for(simulation, noise);
  settings.features.maximum = 120;
  return settings;
}

// A pipeline with a tracker of this noise, and what it sees.
class Session {
 public:
  Session(const Simulation& simulation, const TrackerNoise& noise)
      : simulation_(simulation),
        noise_(noise),
        pipeline_(settings_for(simulation, noise)),
        runtime_(pipeline_, Identity{}, Duration(0), publication_),
        watch_(simulation, pipeline_) {}

  // truth: of the frames that wait to be mapped, by their number.
  void deliver(const Simulation::Arrival& arrival, const FrameEvent& frame, std::map<std::uint64_t, TrueFrame>& truth) {
    test::deliver(runtime_, simulation_, arrival, frame, noise_);
    if (pipeline_.counters().frames.get() == mapped_) return;
    const auto now = truth.try_emplace(mapped_, simulation_, mapped_).first;
    watch_.look(now->second);
    ++mapped_;
  }

  void check() {
    const Figures& f = watch_.figures;
    const auto percent = [](int part, int whole) { return 100.0 * part / std::max(whole, 1); };
    std::printf(
        "tracker %.1f mm: %d of %d returns re-acquired within 0.5 s (%.1f %%); %d of %d gated matches off by more than "
        "3 px (%.2f %%); least %d live features of %zu, below 90 %% in %d of %d frames\n",
        noise_.position_rms_mm, f.reacquired, f.returned, percent(f.reacquired, f.returned), f.off, f.gated,
        percent(f.off, f.gated), f.least_live, pipeline_.slots().size(), f.frames_short_of_features, f.frames);
    std::printf(
        "  of them by last views: %d of %d\n"
        "  error of gated matches: median %.3f px, 95 %% %.3f px; its square over the match's covariance: median "
        "%.2f (0.69 is calibrated)\n",
        f.off_by_last_view, f.gated_by_last_view, quantile(f.errors_px, 0.5), quantile(f.errors_px, 0.95),
        quantile(f.normalised, 0.5));
    EXPECT_GE(f.returned, 50);
    EXPECT_GE(f.gated, 10'000);
    // The goals are 95 %, 0.5 % and nine tenths; the second is missed (docs/evidence/vision.md). The bounds of the
    // latter two leave room for one feature that follows another point for the whole session, 0.7 % of all matches, and
    // for a frame of bad luck.
    EXPECT_GE(f.reacquired, 0.95 * f.returned);
    EXPECT_LT(f.off, 0.01 * f.gated);
    EXPECT_LT(f.frames_short_of_features, 0.02 * f.frames);
    EXPECT_GE(f.least_live, 0.85 * static_cast<double>(pipeline_.slots().size()));
  }

 private:
  const Simulation& simulation_;
  TrackerNoise noise_;
  Pipeline pipeline_;
  Silent publication_;
  LockstepRuntime runtime_;
  Watch watch_;
  std::uint64_t mapped_ = 0;
};

class Seeing : public testing::TestWithParam<Look> {};

TEST_P(Seeing, FeaturesThatReturnToViewComeBackAndWhatPassesTheGateIsThere) {
  const Simulation simulation = test::simulation_of(hard_to_see(GetParam()));
  constexpr double kHalfDegree = 0.5 * std::numbers::pi / 180;
  Session exact(simulation, {});
  Session noisy(simulation, {1.4, kHalfDegree});
  // The pictures are rendered once for both.
  std::map<std::uint64_t, TrueFrame> truth;
  test::for_each_arrival(simulation, [&](const Simulation::Arrival& arrival, const FrameEvent& frame) {
    while (truth.size() > 8) truth.erase(truth.begin());
    exact.deliver(arrival, frame, truth);
    noisy.deliver(arrival, frame, truth);
  });
  exact.check();
  noisy.check();
}

INSTANTIATE_TEST_SUITE_P(Looks, Seeing, testing::Values(Look::kRendered, Look::kTissue),
                         [](const auto& look) { return std::string(name_of(look.param)); });

}  // namespace
}  // namespace perimap

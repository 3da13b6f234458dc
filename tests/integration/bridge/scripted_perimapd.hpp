// Publishes what a test says, at 20 surfaces a second, each with a tool, and remembers what it was.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "core/time/instant.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/writer.hpp"
#include "made_publication.hpp"
#include "made_tool.hpp"

namespace perimap::test {

// The words of its tool: where the sample of the same instant has come before the surface is taken, and, as far as they
// are always the same, where that of the surface before is evaluated 50 ms later or more.
inline constexpr const char* kToolNow = "instrument/probe 3.0 +- 0.2 mm, -10 mm/s";
inline constexpr const char* kToolBefore = "instrument/probe 2.";

class ScriptedPerimapd {
 public:
  // How a surface differs from a good one.
  struct Act {
    perimap_SurfaceState state = perimap_SURFACE_GOOD;
    perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
    bool camera = true;
    bool silent = false;
  };

  void open(int domain) {
    auto participant = dds::Participant::create(domain);
    ASSERT_TRUE(participant) << participant.error().message;
    participant_ = std::make_unique<dds::Participant>(std::move(*participant));
    auto surfaces = dds::Writer<perimap_Surface>::create(*participant_);
    auto models = dds::Writer<perimap_SurfaceModel>::create(*participant_);
    auto meshes = dds::Writer<perimap_SurfaceMesh>::create(*participant_);
    auto tools = dds::Writer<perimap_ToolDistance>::create(*participant_);
    ASSERT_TRUE(surfaces && models && meshes && tools);
    thread_ = std::thread([this, s = std::move(*surfaces), m = std::move(*models), n = std::move(*meshes),
                           t = std::move(*tools)]() mutable { publish(s, m, n, t); });
  }
  ~ScriptedPerimapd() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }

  void play(const Act& act) {
    const std::lock_guard lock(mutex_);
    act_ = act;
  }
  // That was published for an instant of UTC; none: nothing was. libopenigtlink adds up a stamp of 32 halves of halves
  // of a second, each rounded down to ns.
  [[nodiscard]] std::optional<Act> published_for(std::int64_t valid_utc_ns) const {
    const std::lock_guard lock(mutex_);
    const auto next = published_.lower_bound(valid_utc_ns - kRounded_ns);
    if (next == published_.end() || next->first > valid_utc_ns + kRounded_ns) return std::nullopt;
    return next->second;
  }

 private:
  static constexpr std::int64_t kRounded_ns = 50;

  void publish(dds::Writer<perimap_Surface>& surfaces, dds::Writer<perimap_SurfaceModel>& models,
               dds::Writer<perimap_SurfaceMesh>& meshes, dds::Writer<perimap_ToolDistance>& tools) {
    MadePublication made;
    for (std::uint64_t i = 1; !stopping_; ++i) {
      const Instant release = MonotonicClock::now();
      const Act act = [this] {
        const std::lock_guard lock(mutex_);
        return act_;
      }();
      if (!act.silent) {
        const bool model = i % 10 != 1 || models.write(made.model_at(release, i)) >= 0;
        const bool mesh = i % 20 != 1 || meshes.write(made.mesh_at(release, i)) >= 0;
        EXPECT_TRUE(model && mesh);
        perimap_Surface& surface = made.surface_at(release, i);
        surface.state = act.state;
        surface.reason = act.reason;
        surface.camera_pose_known = act.camera;
        {
          const std::lock_guard lock(mutex_);
          published_[to_ns(release) + MadePublication::kUtcMinusMonotonic_ns] = act;
        }
        EXPECT_GE(surfaces.write(surface), 0);
        EXPECT_GE(tools.write(made_tool(to_ns(release), "instrument/probe", i)), 0);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::unique_ptr<dds::Participant> participant_;
  mutable std::mutex mutex_;
  Act act_;
  std::map<std::int64_t, Act> published_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace perimap::test

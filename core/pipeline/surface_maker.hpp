// Housekeeping: makes the continuous surface through the mapped features, and its mesh, on a thread of its own.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/periodic/basis.hpp"
#include "core/phase/phase_law.hpp"
#include "core/realtime/background_round.hpp"
#include "core/realtime/counter.hpp"
#include "core/surface/model_mesh.hpp"
#include "core/surface/periodic_surface.hpp"
#include "core/surface/surface_mesh.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What a surface is made of. The mapper fills it, and no number of it is read before it has handed it over.
struct SurfaceJob {
  std::uint64_t number = 0;  // of the jobs of this run, from 1
  std::vector<SurfaceEvidence> evidence;
  Vector3d camera_W_mm = Vector3d::Zero();  // where the camera has been in the mean
  PhaseLaw law{};
  double setup_variance_mm2 = 0.0;  // per axis: what all positions have in common, so it is none of the evidence's
  bool anew = false;                // nothing of an earlier surface holds: another heart, another law
  Instant capture;                  // of the newest frame that it knows of
  std::uint64_t frame_sequence = 0;
};

// What came of a job.
struct MadeSurface {
  std::uint64_t number = 0;
  PhaseLaw law{};
  Instant capture;
  std::uint64_t frame_sequence = 0;
  std::optional<PeriodicSurface> surface;  // without a value: refused
  SurfaceRefusal refusal;
  SurfaceMesh mesh;
  bool of_model = false;  // the mesh has the vertices of a preoperative model
};

// Of new features, since start. Written by the mapper thread.
struct StartsOnSurface {
  Counter begun;          // by few matches and the surface through the others
  Counter contradicting;  // its matches are not of that: an instrument, a reflection; it starts alone
};

// The mapper thread asks and adopts; one job at a time. serve() is the housekeeping thread's; newest() may be called by
// any thread that is not of the real-time path.
class SurfaceMaker {
 public:
  // `model`: what the mesh has for its topology; without one it is of about `vertices` of its own.
  SurfaceMaker(const BasisLayout& layout, std::size_t features, std::size_t vertices, bool lockstep,
               std::shared_ptr<const OrganModel> model = nullptr);

  // Mapper: the job to fill; null while one is under way. Its vector has room for all features.
  [[nodiscard]] SurfaceJob* job() noexcept;
  // Mapper: hands over the job that job() gave.
  void request() noexcept;
  // Mapper: takes what was made, from when on newest() gives it. False while it is not there; in lockstep it waits.
  bool adopt() noexcept;
  // Mapper: what was adopted last is a surface, not a refusal, and has not been withdrawn.
  [[nodiscard]] bool there() const noexcept;
  // Mapper: all that was asked for so far is not to be used.
  void withdraw() noexcept;

  [[nodiscard]] StartsOnSurface& starts() noexcept { return starts_; }

  // Until dismiss().
  void serve();
  void dismiss() noexcept;

  // The last that was adopted; null when there is none, or it was withdrawn.
  [[nodiscard]] std::shared_ptr<const MadeSurface> newest();
  // Something was adopted before, and has been withdrawn since.
  [[nodiscard]] bool withdrawn() const noexcept;

 private:
  void make();

  BasisLayout layout_;
  std::size_t vertices_;
  std::shared_ptr<const OrganModel> model_;
  StartsOnSurface starts_;
  BackgroundRound hand_over_;
  SurfaceJob job_;     // handed over: the maker's while one is under way
  bool made_ = false;  // likewise: a surface came of it
  // Up to which number the surfaces are adopted and withdrawn. Relaxed: each is a message by itself, the surfaces are
  // guarded by the mutex.
  std::atomic<std::uint64_t> adopted_{0};
  std::atomic<std::uint64_t> withdrawn_{0};

  // The maker's own.
  SurfaceKernels kernels_;
  std::uint64_t fits_ = 0;

  std::mutex mutex_;  // never the mapper's
  std::shared_ptr<const MadeSurface> waiting_;
  std::shared_ptr<const MadeSurface> current_;
};

}  // namespace perimap

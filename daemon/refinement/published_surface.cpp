#include "daemon/refinement/published_surface.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <perimap_mesh_client.hpp>
#include <utility>

#include "core/periodic/basis.hpp"
#include "core/registration/surface_points.hpp"
#include "core/surface/surface_mesh.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

// Of a sample whose lengths and numbers the client has found sound.
SurfaceMesh surface_mesh(const perimap_SurfaceMesh& sample) {
  SurfaceMesh mesh;
  mesh.layout = {static_cast<int>(sample.cardiac_harmonics), static_cast<int>(sample.respiratory_harmonics)};
  const auto V = static_cast<Eigen::Index>(sample.vertex_states._length);
  const Eigen::Index B = mesh.layout.size();
  mesh.coefficients_W_mm.resize(3 * V, B);
  mesh.covariances_W_mm2.resize(6, V);
  for (Eigen::Index v = 0; v < V; ++v) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (Eigen::Index j = 0; j < B; ++j) {
        mesh.coefficients_W_mm(3 * v + axis, j) =
            static_cast<double>(sample.coefficients_W_mm._buffer[(axis * B + j) * V + v]);
      }
    }
    for (Eigen::Index e = 0; e < 6; ++e) {
      mesh.covariances_W_mm2(e, v) = static_cast<double>(sample.covariances_W_mm2._buffer[e * V + v]);
    }
  }
  for (std::uint32_t i = 0; i + 2 < sample.triangles._length; i += 3) {
    const std::uint32_t* corners = sample.triangles._buffer + i;
    mesh.triangles.push_back({corners[0], corners[1], corners[2]});
  }
  return mesh;
}

// The phase at that share of a cycle, of the newest one at which mesh and model can be moved together.
std::optional<client::PredictedSurface> phase_at_share(const perimap_SurfaceMesh& mesh,
                                                       const perimap_SurfaceModel& model, double share,
                                                       client::PredictedMesh& moved) {
  for (const bool measured : {true, false}) {
    for (std::uint32_t i = model.cardiac_cycles._length; i-- > 0;) {
      const perimap_CardiacCycle& cycle = model.cardiac_cycles._buffer[i];
      if (cycle.measured != measured || cycle.length_ns <= 0) continue;
      const auto since_ns = static_cast<std::int64_t>(share * static_cast<double>(cycle.length_ns - 1));
      // Unsigned: whatever the numbers are, the sum is one.
      const auto t_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(cycle.begin_time_ns) +
                                                  static_cast<std::uint64_t>(since_ns));
      client::PredictedSurface phase;
      if (client::predict(model, t_ns, t_ns, {true}, phase) &&
          client::predict(mesh, model, t_ns, t_ns, {true}, moved)) {
        return phase;
      }
    }
  }
  return std::nullopt;
}

class SurfaceSearch {
 public:
  explicit SurfaceSearch(double share) : share_(share) {}

  void use(const RecordingReader& reader, const RecordedMessage& message) {
    if (message.channel == channels::kSurfaceMesh) {
      auto mesh = reader.decode<perimap_SurfaceMesh>(message);
      if (!mesh) return;
      ++meshes_;
      if ((*mesh)->state == perimap_MESH_NONE) why_ = client::describe_mesh_reason((*mesh)->reason);
      mesh_ = std::move(*mesh);
      arrival_ = message.arrival;
      try_both();
    } else if (message.channel == channels::kSurfaceModel) {
      auto model = reader.decode<perimap_SurfaceModel>(message);
      if (!model) return;
      model_ = std::move(*model);
      try_both();
    }
  }

  [[nodiscard]] Expected<PublishedSurface> result(const std::string& recording, Instant begin) && {
    if (found_) {
      found_->since_begin_s = to_seconds(found_at_ - begin);
      return *std::move(found_);
    }
    if (meshes_ == 0) {
      return fail(
          fmt::format("{}: no surface was recorded; expected what perimapd publishes (perimap watch --record, or "
                      "perimap replay --lockstep --samples FILE)",
                      recording));
    }
    return fail(fmt::format("{}: it has no surface to register to: {}", recording, why_));
  }

 private:
  void try_both() {
    if (!mesh_ || !model_ || (*mesh_)->state != perimap_MESH_THERE) return;
    const auto phase = phase_at_share(**mesh_, **model_, share_, moved_);
    if (!phase) {
      why_ = moved_.refusal == client::MeshRefusal::kNone ? "no cycle of the heart is known" : client::describe(moved_);
      return;
    }
    const SurfaceMesh mesh = surface_mesh(**mesh_);
    if (!mesh.layout.valid()) return;
    PublishedSurface found;
    found.points = points_at(mesh, phase->cardiac_phase_rad);
    found.features = (*mesh_)->features;
    found.feature_spacing_mm = feature_spacing_mm(mesh, found.features);
    found.common_share = common_share_of((*mesh_)->leave_one_out_nees);
    found.phase_rad = phase->cardiac_phase_rad;
    found.breath_known = (*mesh_)->respiratory_harmonics > 0;
    found_ = std::move(found);
    found_at_ = arrival_;
  }

  double share_;
  std::optional<Sample<perimap_SurfaceMesh>> mesh_;
  std::optional<Sample<perimap_SurfaceModel>> model_;
  Instant arrival_;
  client::PredictedMesh moved_;
  std::size_t meshes_ = 0;
  std::string why_ = "the phases of the heart were not recorded (surface_model)";
  std::optional<PublishedSurface> found_;
  Instant found_at_;
};

}  // namespace

Expected<PublishedSurface> read_published_surface(const std::string& recording, double cycle_share) {
  auto reader = RecordingReader::open(recording, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  const auto times = reader->times();
  SurfaceSearch search(cycle_share);
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    search.use(*reader, **message);
  }
  return std::move(search).result(recording, times ? times->first : Instant{});
}

}  // namespace perimap

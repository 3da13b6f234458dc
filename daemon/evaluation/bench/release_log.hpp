// Between the runtime and DDS: when each surface was due, ready and written.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/pipeline/release_stream.hpp"
#include "daemon/publishing/publication.hpp"

namespace perimap::bench {

struct LoggedRelease {
  std::uint64_t sequence = 0;
  Instant capture;
  Instant deadline;
  Instant ready;    // composed, just before the write
  Instant written;  // the write has returned
  std::uint32_t features = 0;
};

// Hands everything on to `next`, which must outlive it, and logs one stream's surfaces. Nothing is allocated while it
// logs.
class ReleaseLog final : public Publication {
 public:
  ReleaseLog(Publication& next, ReleaseStream stream, std::size_t capacity);

  void surface(const perimap_Surface& sample) override;
  void surface_model(const perimap_SurfaceModel& model) override { next_.surface_model(model); }
  void surface_mesh(const perimap_SurfaceMesh& mesh) override { next_.surface_mesh(mesh); }
  void tool(const perimap_ToolDistance& distance) override { next_.tool(distance); }
  void phase(const perimap_Phase& phase) override { next_.phase(phase); }
  void status(const perimap_Status& status) override { next_.status(status); }

  // Any thread: the newest deadline and its distance from the one before; 0 while there are none.
  [[nodiscard]] std::int64_t newest_deadline_ns() const noexcept {
    return deadline_ns_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::int64_t period_ns() const noexcept { return period_ns_.load(std::memory_order_relaxed); }

  // After the publisher's thread has ended: in order, as many as the capacity allows.
  [[nodiscard]] std::span<const LoggedRelease> releases() const noexcept { return releases_; }

 private:
  Publication& next_;
  std::string_view stream_;
  std::vector<LoggedRelease> releases_;
  // Relaxed: a reader needs either as a hint of where the next release is, nothing else with it.
  std::atomic<std::int64_t> deadline_ns_{0};
  std::atomic<std::int64_t> period_ns_{0};
};

}  // namespace perimap::bench

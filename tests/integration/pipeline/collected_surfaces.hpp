// What was published, kept for a test to look at.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/pipeline/release_stream.hpp"
#include "daemon/publishing/publication.hpp"

namespace perimap::test {

struct CollectedSurface {
  perimap_Surface head{};  // its sequence is empty
  std::vector<perimap_SurfaceFeature> features;
};

class CollectedSurfaces final : public Publication {
 public:
  void surface(const perimap_Surface& sample) override {
    CollectedSurface kept{sample, {sample.features._buffer, sample.features._buffer + sample.features._length}};
    kept.head.features = {};
    all_.push_back(std::move(kept));
  }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  // After every thread that publishes has ended.
  [[nodiscard]] std::vector<CollectedSurface> of(ReleaseStream stream) const {
    std::vector<CollectedSurface> some;
    for (const CollectedSurface& surface : all_) {
      if (surface.head.stream == name_of(stream)) some.push_back(surface);
    }
    return some;
  }

 private:
  std::vector<CollectedSurface> all_;
};

}  // namespace perimap::test

// What is published, told to the black box as well.
#pragma once

#include "daemon/black_box/black_box.hpp"
#include "daemon/publishing/publication.hpp"

namespace perimap::black_box {

// Both must outlive it. The other publication comes first: nothing is late because of the black box.
class BlackBoxPublication final : public Publication {
 public:
  BlackBoxPublication(Publication& first, BlackBox& box) : first_(first), box_(box) {}

  void surface(const perimap_Surface& sample) override {
    first_.surface(sample);
    box_.surface(sample);
  }
  void surface_model(const perimap_SurfaceModel& model) override { first_.surface_model(model); }
  void surface_mesh(const perimap_SurfaceMesh& mesh) override { first_.surface_mesh(mesh); }
  void tool(const perimap_ToolDistance& distance) override { first_.tool(distance); }
  void phase(const perimap_Phase& phase) override {
    first_.phase(phase);
    box_.phase(phase);
  }
  void status(const perimap_Status& status) override {
    first_.status(status);
    box_.status(status);
  }
  [[nodiscard]] bool another_publisher() const noexcept override { return first_.another_publisher(); }

 private:
  Publication& first_;
  BlackBox& box_;
};

}  // namespace perimap::black_box

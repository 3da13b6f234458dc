// Where what is published goes.
#pragma once

#include <perimap.h>
#include <perimap_mesh.h>
#include <perimap_tool.h>

#include "core/time/instant.hpp"

namespace perimap {

// surface() is called by the publisher thread, tool() by the thread that tells of tools, the others by the status
// thread; in virtual time one thread calls all.
class Publication {
 public:
  Publication() = default;
  Publication(const Publication&) = delete;
  Publication& operator=(const Publication&) = delete;
  virtual ~Publication() = default;

  virtual void surface(const perimap_Surface& sample) = 0;
  virtual void surface_model(const perimap_SurfaceModel& model) = 0;
  virtual void surface_mesh(const perimap_SurfaceMesh& /*mesh*/) {}
  virtual void tool(const perimap_ToolDistance& /*distance*/) {}
  virtual void phase(const perimap_Phase& phase) = 0;
  virtual void status(const perimap_Status& status) = 0;

  // Another program publishes under this one's name. Any thread but the real-time ones.
  [[nodiscard]] virtual bool another_publisher() const noexcept { return false; }
};

}  // namespace perimap

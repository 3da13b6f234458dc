// Ownership of one Cyclone DDS entity.
#pragma once

#include <dds/dds.h>

#include <utility>

namespace perimap::dds {

// Deletes its entity, and with it the entity's children. An entity handle is positive; 0 is none.
class Entity {
 public:
  Entity() = default;
  explicit Entity(dds_entity_t handle) noexcept : handle_(handle) {}
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    if (this != &other) {
      reset();
      handle_ = std::exchange(other.handle_, 0);
    }
    return *this;
  }
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  ~Entity() { reset(); }

  [[nodiscard]] dds_entity_t get() const noexcept { return handle_; }

 private:
  void reset() noexcept {
    if (handle_ > 0) {
      dds_delete(handle_);
    }
    handle_ = 0;
  }

  dds_entity_t handle_ = 0;
};

}  // namespace perimap::dds

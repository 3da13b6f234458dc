// Waiting for data of several readers, or for another thread's word to stop.
#pragma once

#include "core/error/expected.hpp"
#include "daemon/dds/entity.hpp"
#include "daemon/dds/participant.hpp"

namespace perimap::dds {

// There is no wait with a time limit: Cyclone DDS 0.10 counts relative waits on the wall clock, so that a step of the
// clock stretches them. Time limits belong to another thread, which calls stop().
class WaitSet {
 public:
  [[nodiscard]] static Expected<WaitSet> create(const Participant& participant);

  // The condition must outlive the wait set or its last wait.
  [[nodiscard]] Expected<void> attach(dds_entity_t condition);

  // Until an attached condition holds (true) or stop() was called (false). An error also ends the wait with false.
  [[nodiscard]] bool wait() noexcept;

  // Ends this and every later wait. From any thread.
  void stop() noexcept;

 private:
  WaitSet(Entity guard, Entity set) noexcept : guard_(std::move(guard)), set_(std::move(set)) {}

  Entity guard_;
  Entity set_;
};

}  // namespace perimap::dds

#include "daemon/dds/wait_set.hpp"

#include <fmt/format.h>

namespace perimap::dds {

Expected<WaitSet> WaitSet::create(const Participant& participant) {
  Entity guard(dds_create_guardcondition(participant.handle()));
  Entity set(dds_create_waitset(participant.handle()));
  for (const dds_entity_t handle : {guard.get(), set.get()}) {
    if (handle < 0) {
      return fail(fmt::format("DDS: cannot create a wait set: {}", dds_strretcode(handle)));
    }
  }
  WaitSet wait_set(std::move(guard), std::move(set));
  return wait_set.attach(wait_set.guard_.get()).map([&] { return std::move(wait_set); });
}

Expected<void> WaitSet::attach(dds_entity_t condition) {
  const dds_return_t result = dds_waitset_attach(set_.get(), condition, 0);
  if (result < 0) {
    return fail(fmt::format("DDS: cannot attach to a wait set: {}", dds_strretcode(result)));
  }
  return {};
}

bool WaitSet::wait() noexcept {
  const dds_return_t result = dds_waitset_wait(set_.get(), nullptr, 0, DDS_INFINITY);
  bool stopped = false;
  return result >= 0 && dds_read_guardcondition(guard_.get(), &stopped) >= 0 && !stopped;
}

void WaitSet::stop() noexcept { dds_set_guardcondition(guard_.get(), true); }

}  // namespace perimap::dds

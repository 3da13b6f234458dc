#include "daemon/setup/recorded_relation.hpp"

#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/recorded_poses.hpp"

namespace perimap {

Expected<HeldRelation> relation_in_recording(const std::string& recording) {
  const auto sensor = read_recorded_poses(recording, kScopeTool);
  if (!sensor) return tl::unexpected(sensor.error());
  const auto second = read_recorded_poses(recording, kSecondSensorTool);
  if (!second) {
    return fail(second.error().message + "; as tracker.second_sensor of the configuration it is recorded");
  }
  auto relation = held_relation(*sensor, *second);
  if (!relation) return fail(recording + ": " + relation.error().message);
  return relation;
}

}  // namespace perimap

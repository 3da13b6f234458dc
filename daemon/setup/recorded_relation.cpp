#include "daemon/setup/recorded_relation.hpp"

#include "daemon/config/tracked_tools.hpp"
#include "daemon/setup/recorded_poses.hpp"

namespace perimap {

Expected<HeldRelation> relation_in_recording(const std::string& recording) {
  const auto sensor = read_recorded_poses(recording, kScopeTool);
  if (!sensor) return tl::unexpected(sensor.error());
  if (const auto has = has_recorded_poses(recording, kSecondSensorTool); !has || !*has) {
    return fail(has ? recording + ": has no second sensor: name it as tracker.second_sensor, and record again"
                    : has.error().message);
  }
  const auto second = read_recorded_poses(recording, kSecondSensorTool);
  if (!second) return tl::unexpected(second.error());
  auto relation = held_relation(*sensor, *second);
  if (!relation) return fail(recording + ": " + relation.error().message);
  return relation;
}

}  // namespace perimap

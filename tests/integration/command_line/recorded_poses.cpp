// Writes a recording's valid poses X_WS, each a line: translation, mm, and unit quaternion wxyz.
// recorded_poses RECORDING
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdio>
#include <span>
#include <string_view>
#include <variant>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"

int main(int argc, char** argv) {
  using namespace perimap;
  const std::span arguments(argv, static_cast<std::size_t>(argc));
  if (arguments.size() != 2) return 2;
  const auto refuse = [](const Error& error) {
    fmt::print(stderr, "{}\n", error.message);
    return 1;
  };
  constexpr std::array<std::string_view, 1> kPoses{channels::kTrackerPose};
  auto reader = ReplayReader::open(arguments[1], ReadMode::kStrict, kPoses);
  if (!reader) return refuse(reader.error());
  for (;;) {
    const auto event = reader->next();
    if (!event) return refuse(event.error());
    if (!*event) return 0;
    const auto* sample = std::get_if<TrackerSample>(&**event);
    if (sample == nullptr || sample->state != ToolState::kOk) continue;
    const Eigen::Quaterniond q(sample->X_WS.R);
    const Vector3d& t = sample->X_WS.t;
    fmt::print("{:.4f} {:.4f} {:.4f} {:.6f} {:.6f} {:.6f} {:.6f}\n", t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
  }
}

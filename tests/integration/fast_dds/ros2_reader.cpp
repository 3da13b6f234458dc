// ros2_reader DOMAIN SECONDS: reads what perimap bridge ros2 publishes by eProsima Fast DDS, with types that fastddsgen
// made of idl/ros2/ros2.idl, until it has seen all of it, and holds it against the heart that scripted_publisher makes:
// z of each feature is 100 + 3 cos(phase) mm, and x and y are its own.
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>

#include "fast_reader.hpp"
#include "ros2PubSubTypes.h"

namespace {

using perimap::test::expect;
using Points = sensor_msgs::msg::dds_::PointCloud2_;
using Marker = visualization_msgs::msg::dds_::Marker_;
using Transforms = tf2_msgs::msg::dds_::TFMessage_;
using Diagnostics = diagnostic_msgs::msg::dds_::DiagnosticArray_;

bool judge_points(const Points& cloud) {
  if (cloud.width() == 0) return false;
  expect(cloud.header().frame_id() == "tracker", "frame of the points");
  expect(cloud.fields().size() == 6 && cloud.fields()[3].name() == "deviation", "fields of the points");
  expect(cloud.data().size() == std::size_t{3} * 24 && cloud.point_step() == 24, "bytes of the points");
  float z0 = 0.0F;
  for (std::size_t i = 0; i < cloud.data().size() / 24; ++i) {
    float xyz[4];
    std::memcpy(xyz, cloud.data().data() + 24 * i, sizeof xyz);
    if (i == 0) z0 = xyz[2];
    expect(std::abs(xyz[0] - 0.01F * static_cast<float>(i)) < 1e-7F, "x of a feature");
    expect(std::abs(xyz[1] + 0.005F * static_cast<float>(i)) < 1e-7F, "y of a feature");
    expect(xyz[2] > 0.0969F && xyz[2] < 0.1031F && xyz[2] == z0, "z of a feature");
    expect(std::abs(xyz[3] - 0.0005F) < 1e-8F, "deviation of a feature");
  }
  return true;
}

bool judge_marker(const Marker& marker) {
  if (marker.action() != 0) return false;
  expect(marker.type() == 11 && marker.ns() == "perimap", "kind of the mesh");
  expect(marker.points().size() == 6 && marker.colors().size() == 6, "corners of the mesh");
  expect(std::abs(marker.pose().orientation().w() - 1.0) < 1e-15, "pose of the mesh");
  return true;
}

bool judge_transforms(const Transforms& told) {
  expect(told.transforms().size() == 1 && told.transforms()[0].child_frame_id() == "perimap_camera", "camera");
  expect(std::abs(told.transforms()[0].transform().translation().z() - 0.03) < 1e-12, "place of the camera");
  expect(std::abs(told.transforms()[0].transform().rotation().w() - std::sqrt(0.5)) < 1e-9, "turn of the camera");
  return true;
}

bool judge_diagnostics(const Diagnostics& told) {
  const auto& status = told.status().at(0);
  expect(status.name() == "perimap: surface", "name of the diagnostics");
  return status.level() == 0 && status.message() == "may be used" && status.values().at(0).value() == "good";
}

}  // namespace

int main(int argc, char** argv) {
  using namespace perimap::test;
  if (argc != 3) {
    std::fputs("usage: ros2_reader DOMAIN SECONDS\n", stderr);
    return 2;
  }
  FastDomain domain(std::atoi(argv[1]));
  const FastReader<Points, sensor_msgs::msg::dds_::PointCloud2_PubSubType> points(domain, "rt/perimap/points",
                                                                                  judge_points);
  const FastReader<Marker, visualization_msgs::msg::dds_::Marker_PubSubType> marker(domain, "rt/perimap/mesh",
                                                                                    judge_marker);
  const FastReader<Transforms, tf2_msgs::msg::dds_::TFMessage_PubSubType> transforms(domain, "rt/tf", judge_transforms);
  const FastReader<Diagnostics, diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType> diagnostics(
      domain, "rt/diagnostics", judge_diagnostics);
  // What is good is said once a second, for the eight seconds that it is.
  const bool right = wait_for(std::atoi(argv[2]), [&] {
    return points.content() >= 20 && marker.content() >= 20 && transforms.content() >= 20 && diagnostics.content() >= 5;
  });
  std::printf("Fast DDS read %d point clouds, %d meshes, %d transforms, %d good diagnostics; wrong: %d\n",
              points.content(), marker.content(), transforms.content(), diagnostics.content(), wrong.load());
  std::fflush(stdout);
  std::_Exit(right ? 0 : 1);  // what Fast DDS still runs needs no end
}

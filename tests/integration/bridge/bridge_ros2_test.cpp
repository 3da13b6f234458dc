// `perimap bridge ros2` between a scripted perimapd and readers in ROS 2's domain: what is received is what was
// published, value by value, and an invalid surface clears it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <span>

#include "bridge_test.hpp"
#include "daemon/bridge/ros2/ros2_types.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;
using test::MadePublication;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;

// Hands each sample of a topic to a function, until that is content.
template <class T>
class RosReader {
 public:
  RosReader(const dds::Participant& participant, const char* topic, const dds_topic_descriptor_t& descriptor) {
    topic_ = dds_create_topic(participant.handle(), &descriptor, topic, nullptr, nullptr);
    // As ROS 2 reads: reliable and volatile, the last ten.
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
    reader_ = dds_create_reader(participant.handle(), topic_, qos, nullptr);
    dds_delete_qos(qos);
    EXPECT_GT(reader_, 0) << dds_strretcode(reader_);
  }
  RosReader(const RosReader&) = delete;
  RosReader& operator=(const RosReader&) = delete;
  ~RosReader() {
    dds_delete(reader_);
    dds_delete(topic_);
  }

  template <class Content>
  [[nodiscard]] bool until(Content content, Duration patience = 2min) {
    for (const Instant give_up = MonotonicClock::now() + patience; MonotonicClock::now() < give_up;) {
      void* sample = nullptr;
      dds_sample_info_t info;
      if (dds_take(reader_, &sample, &info, 1, 1) <= 0) {
        std::this_thread::sleep_for(5ms);
        continue;
      }
      const bool done = info.valid_data && content(*static_cast<const T*>(sample));
      dds_return_loan(reader_, &sample, 1);
      if (done) return true;
    }
    return false;
  }

 private:
  dds_entity_t topic_ = 0, reader_ = 0;
};

struct PointFeature {
  float x, y, z, deviation;
  std::uint32_t id;
  std::uint8_t state;
};

std::int64_t utc_ns(const Ros2Header& header) {
  return std::int64_t{header.stamp.sec} * 1'000'000'000 + header.stamp.nanosec;
}

class BridgeRos2 : public test::BridgeTest {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(BridgeTest::SetUp());
    ros_domain_ = domain_ + 100;
    auto ros = dds::Participant::create(ros_domain_);
    ASSERT_TRUE(ros) << ros.error().message;
    ros_.emplace(std::move(*ros));
    program_->start(
        {"bridge", "ros2", "--domain", std::to_string(domain_), "--ros-domain", std::to_string(ros_domain_)});
    ASSERT_THAT(program_->first_line(), HasSubstr("ROS 2 domain " + std::to_string(ros_domain_))) << program_->said();
  }

  // Reads points until some have come, each held against what was published for the instant of its stamp.
  void expect_points(RosReader<Ros2Points>& points) {
    EXPECT_TRUE(points.until([this](const Ros2Points& cloud) {
      if (cloud.width == 0) return false;
      EXPECT_EQ(cloud.fields._length, 6U);
      EXPECT_STREQ(cloud.fields._buffer[4].name, "id");
      EXPECT_EQ(cloud.fields._buffer[4].offset, 16U);
      EXPECT_EQ(cloud.height * cloud.width, 3U);  // the fourth feature is invalid
      EXPECT_EQ(cloud.data._length, cloud.width * cloud.point_step);
      const Instant valid = from_ns(utc_ns(cloud.header) - MadePublication::kUtcMinusMonotonic_ns);
      EXPECT_TRUE(perimapd_.published_for(utc_ns(cloud.header)));
      for (std::size_t i = 0; i < cloud.width; ++i) {
        PointFeature feature{};
        std::memcpy(&feature, cloud.data._buffer + i * cloud.point_step, 21);
        const auto expected = MadePublication::feature_at(i, valid);
        EXPECT_NEAR(feature.x, 1e-3 * expected[0], 1e-8);
        EXPECT_NEAR(feature.y, 1e-3 * expected[1], 1e-8);
        EXPECT_NEAR(feature.z, 1e-3 * expected[2], 1e-8);
        EXPECT_NEAR(feature.deviation, 1e-3 * MadePublication::kFeatureDeviation_mm, 1e-9);
        EXPECT_EQ(feature.id, 10 + i);
        EXPECT_EQ(feature.state, 1 + i);
      }
      return true;
    }));
  }

  int ros_domain_ = 0;
  std::optional<dds::Participant> ros_;
};

TEST_F(BridgeRos2, WhatIsReceivedIsWhatWasPublishedAndAnInvalidSurfaceClearsIt) {
  RosReader<Ros2Points> points(*ros_, "rt/perimap/points", sensor_msgs_msg_dds__PointCloud2__desc);
  RosReader<Ros2Marker> meshes(*ros_, "rt/perimap/mesh", visualization_msgs_msg_dds__Marker__desc);
  RosReader<Ros2Marker> tools(*ros_, "rt/perimap/tools", visualization_msgs_msg_dds__Marker__desc);
  RosReader<Ros2Transforms> transforms(*ros_, "rt/tf", tf2_msgs_msg_dds__TFMessage__desc);
  RosReader<Ros2Diagnostics> diagnostics(*ros_, "rt/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc);
  std::string words, tool;
  std::map<std::string, std::string> values;
  const auto until_level = [&](int level) {
    return diagnostics.until([&](const Ros2Diagnostics& told) {
      const auto& status = told.status._buffer[0];
      if (told.status._length < 1 || status.level != level) return false;
      tool = told.status._length > 1 ? told.status._buffer[1].message : "";
      EXPECT_STREQ(status.name, "perimap: surface");
      words = status.message;
      for (const auto& [key, value] : std::span(status.values._buffer, status.values._length)) values[key] = value;
      return true;
    });
  };
  ASSERT_TRUE(until_level(3));
  EXPECT_THAT(words, HasSubstr("no surface has come yet"));

  perimapd_.open(domain_);
  ASSERT_TRUE(until_level(0));
  EXPECT_EQ(values["state"], "good");
  EXPECT_EQ(values["converged"], "1");
  // A tool is told of when it has been heard for a second.
  for (int i = 0; i < 5 && tool.empty(); ++i) ASSERT_TRUE(until_level(0));
  EXPECT_THAT(tool, AnyOf(HasSubstr(test::kToolNow), HasSubstr(test::kToolBefore)));
  expect_points(points);
  ASSERT_TRUE(meshes.until([](const Ros2Marker& mesh) {
    if (mesh.action != 0) return false;
    EXPECT_EQ(mesh.type, 11);
    EXPECT_STREQ(mesh.header.frame_id, "tracker");
    EXPECT_EQ(mesh.points._length, 6U);  // two triangles
    EXPECT_EQ(mesh.colors._length, 6U);
    EXPECT_EQ(mesh.lifetime.nanosec, 200'000'000U);
    const Instant valid = from_ns(utc_ns(mesh.header) - MadePublication::kUtcMinusMonotonic_ns);
    const std::size_t corners[] = {1, 2, 3, 2, 4, 3};
    for (std::size_t k = 0; k < 6; ++k) {
      const auto expected = MadePublication::vertex_at(corners[k], valid);
      EXPECT_NEAR(mesh.points._buffer[k].z, 1e-3 * expected[2], 1e-7);
    }
    return true;
  }));
  ASSERT_TRUE(tools.until([](const Ros2Marker& tips) {
    if (tips.action != 0) return false;
    EXPECT_EQ(tips.type, 7);
    EXPECT_EQ(tips.points._length, 1U);
    EXPECT_NEAR(tips.points._buffer[0].z, 0.097, 1e-12);
    EXPECT_EQ(tips.lifetime.nanosec, 200'000'000U);
    return true;
  }));
  ASSERT_TRUE(transforms.until([](const Ros2Transforms& told) {
    EXPECT_EQ(told.transforms._length, 1U);
    const auto& camera = told.transforms._buffer[0];
    EXPECT_STREQ(camera.header.frame_id, "tracker");
    EXPECT_STREQ(camera.child_frame_id, "perimap_camera");
    EXPECT_NEAR(camera.transform.translation.z, 0.03, 1e-12);
    EXPECT_NEAR(camera.transform.rotation.z, std::sqrt(0.5), 1e-9);
    EXPECT_NEAR(camera.transform.rotation.w, std::sqrt(0.5), 1e-9);
    return true;
  }));

  perimapd_.play({perimap_SURFACE_INVALID, perimap_SURFACE_REASON_PHASE_LOST});
  ASSERT_TRUE(until_level(2));
  EXPECT_THAT(words, HasSubstr("no heart beat for too long"));
  EXPECT_EQ(values["features"], "0");
  const auto empty = [](const Ros2Points& cloud) { return cloud.width == 0 && cloud.data._length == 0; };
  ASSERT_TRUE(points.until(empty));
  for (auto* markers : {&meshes, &tools}) {
    ASSERT_TRUE(
        markers->until([](const Ros2Marker& marker) { return marker.action == 3 && marker.points._length == 0; }));
  }
  EXPECT_EQ(tool, "instrument/probe: the surface is not good");

  perimapd_.play({});
  ASSERT_TRUE(until_level(0));
  expect_points(points);
  perimapd_.play({.silent = true});
  ASSERT_TRUE(until_level(3));
  EXPECT_THAT(words, HasSubstr("nothing comes from perimapd"));
  ASSERT_TRUE(points.until(empty));

  perimapd_.play({});
  expect_points(points);
  program_->interrupt();
  ASSERT_TRUE(diagnostics.until([](const Ros2Diagnostics& told) {
    return std::string(told.status._buffer[0].message).find("has ended") != std::string::npos;
  }));
  ASSERT_TRUE(points.until(empty));
  EXPECT_EQ(program_->ended(), 0);
}

}  // namespace
}  // namespace perimap

// What leaves by OpenIGTLink, unpacked by libopenigtlink as a client does.
#include "daemon/bridge/igtl/igtl_messages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "igtl_receiver.hpp"

namespace perimap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Subject = IgtlOutgoing::Subject;

ShownSurface good() {
  ShownSurface shown;
  shown.state = perimap_SURFACE_GOOD;
  shown.valid = from_ns(5'123'456'789);
  shown.capture = shown.valid - std::chrono::milliseconds(50);
  shown.utc_minus_monotonic = std::chrono::seconds(1'795'000'000);
  shown.X_WC = Pose{so3_exp(Vector3d(0.3, -0.4, 0.5)), Vector3d(10, -20, 30)};
  shown.features = {{3, perimap_FEATURE_CONVERGED, {1, 2, 3}, 0.25}, {9, perimap_FEATURE_CONVERGING, {4, 5, 6}, 1.5}};
  return shown;
}

test::IgtlReceived points_in(const IgtlOutgoing& message, Subject subject) {
  EXPECT_EQ(message.subject, subject);
  const auto polydata = test::IgtlReceiver::unpacked<igtl::PolyDataMessage>(*message.bytes);
  test::IgtlReceived got;
  got.device = polydata->GetDeviceName();
  auto stamp = igtl::TimeStamp::New();
  polydata->GetTimeStamp(stamp);
  got.utc_ns = std::int64_t{1'000'000'000} * stamp->GetSecond() + stamp->GetNanosecond();
  test::IgtlReceiver::take_surface(polydata, got);
  return got;
}

test::IgtlReceived surface_in(const IgtlOutgoing& message) { return points_in(message, Subject::kSurface); }

TEST(IgtlMessages, AMeshIsItsVerticesTrianglesAndDeviations) {
  ShownSurface shown = good();
  shown.mesh = {{{0, 0, 90}, {8, 0, 91}, {8, 6, 92.5}, {0, 6, 93}}, {0.1, 0.2, 0.3, 0.4}, {{0, 1, 2}, {0, 2, 3}}};
  const auto got = surface_in(pack_surface(shown));
  EXPECT_EQ(got.device, "PerimapSurface");
  EXPECT_NEAR(static_cast<double>(got.utc_ns - 1'795'000'005'123'456'789), 0.0, 50.0);  // the library rounds
  ASSERT_EQ(got.points.size(), 4U);
  EXPECT_THAT(got.points[2], ElementsAre(8.0F, 6.0F, 92.5F));
  EXPECT_THAT(got.triangles, ElementsAre(std::array<std::uint32_t, 3>{0, 1, 2}, std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_THAT(got.vertices, IsEmpty());
  EXPECT_THAT(got.scalars.at("deviation_mm"), ElementsAre(0.1F, 0.2F, 0.3F, 0.4F));
  EXPECT_EQ(got.scalars.size(), 1U);
}

TEST(IgtlMessages, WithoutAMeshConvergedFeaturesAreVertices) {
  ShownSurface shown = good();
  shown.features.push_back({12, perimap_FEATURE_CONVERGED, {7, 8, 9}, 0.5});
  shown.features.push_back({13, perimap_FEATURE_INCONSISTENT, {0, 0, 0}, 0.5});
  const auto got = surface_in(pack_surface(shown));
  ASSERT_EQ(got.points.size(), 2U);  // converging and inconsistent ones are not for others
  EXPECT_THAT(got.points[0], ElementsAre(1.0F, 2.0F, 3.0F));
  EXPECT_THAT(got.points[1], ElementsAre(7.0F, 8.0F, 9.0F));
  EXPECT_THAT(got.triangles, IsEmpty());
  EXPECT_THAT(got.vertices, ElementsAre(0U, 1U));
  EXPECT_THAT(got.scalars.at("deviation_mm"), ElementsAre(0.25F, 0.5F));
  shown.features = {{9, perimap_FEATURE_CONVERGING, {4, 5, 6}, 1.5}};
  EXPECT_THAT(surface_in(pack_surface(shown)).points, IsEmpty());
}

TEST(IgtlMessages, AnotherSourceIsAnotherState) {
  ShownSurface shown = good(), other = good();
  shown.source = "left";
  other.source = "right";
  EXPECT_FALSE(surface_state_of(shown) == surface_state_of(other));
  EXPECT_THAT(surface_state_of(shown).words, HasSubstr("source left"));
}

TEST(IgtlMessages, OfNothingAllArraysAreEmpty) {
  for (const IgtlOutgoing& message : {pack_surface(ShownSurface()), pack_no_surface()}) {
    // Counts and sizes of five arrays; the library itself would leave what was in its memory.
    EXPECT_EQ(message.bytes->substr(58), std::string(40, '\0'));
    const auto got = surface_in(message);
    EXPECT_THAT(got.points, IsEmpty());
    EXPECT_THAT(got.triangles, IsEmpty());
    EXPECT_THAT(got.vertices, IsEmpty());
    EXPECT_THAT(got.scalars, IsEmpty());
    EXPECT_EQ(got.utc_ns, 0);
  }
}

TEST(IgtlMessages, TheCameraIsATransformInMm) {
  const ShownSurface shown = good();
  const auto message = pack_camera(shown);
  EXPECT_EQ(message.subject, Subject::kCamera);
  const auto transform = test::IgtlReceiver::unpacked<igtl::TransformMessage>(*message.bytes);
  EXPECT_STREQ(transform->GetDeviceName(), "PerimapCamera");
  igtl::Matrix4x4 matrix;
  transform->GetMatrix(matrix);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) EXPECT_NEAR(matrix[row][column], shown.X_WC->R(row, column), 1e-6);
    EXPECT_NEAR(matrix[row][3], shown.X_WC->t(row), 1e-5);
  }
  auto stamp = igtl::TimeStamp::New();
  transform->GetTimeStamp(stamp);
  EXPECT_EQ(stamp->GetSecond(), 1'795'000'005U);
  EXPECT_NEAR(stamp->GetNanosecond(), 73'456'789.0, 50.0);  // the library rounds
}

ShownTool probe() {
  ShownTool tool;
  tool.name = "instrument/probe";
  tool.at.refusal = client::ToolRefusal::kNone;
  tool.at.state = perimap_TOOL_GOOD;
  tool.at.distance_mm = 3.25;
  tool.at.deviation_mm = 0.5;
  tool.at.rate_mm_per_s = -7.0;
  tool.at.tip_known = true;
  tool.at.tip_W_mm = {1, 2, 3};
  return tool;
}

TEST(IgtlMessages, ToolsAreVerticesAndLinesOfWords) {
  ShownSurface shown = good();
  shown.tools = {probe(), probe(), probe()};
  shown.tools[1].name = "pointer";
  shown.tools[1].at = {};
  shown.tools[1].at.refusal = client::ToolRefusal::kPublisher;
  shown.tools[1].at.reason = perimap_TOOL_REASON_NOT_SEEN;
  shown.tools[2].name = "instrument/hook";
  shown.tools[2].at.touches = true;
  const auto got = points_in(pack_tools(shown), Subject::kTools);
  EXPECT_EQ(got.device, "PerimapTools");
  ASSERT_EQ(got.points.size(), 2U);  // nobody knows where the pointer is
  EXPECT_THAT(got.points[0], ElementsAre(1.0F, 2.0F, 3.0F));
  EXPECT_THAT(got.vertices, ElementsAre(0U, 1U));
  EXPECT_THAT(got.scalars.at("line"), ElementsAre(0.0F, 2.0F));
  EXPECT_THAT(got.scalars.at("distance_mm"), ElementsAre(3.25F, 3.25F));
  EXPECT_THAT(got.scalars.at("deviation_mm"), ElementsAre(0.5F, 0.5F));
  EXPECT_THAT(got.scalars.at("touches"), ElementsAre(0.0F, 1.0F));
  const auto text = test::IgtlReceiver::unpacked<igtl::StringMessage>(*pack_tool_words(shown).bytes);
  EXPECT_STREQ(text->GetString(),
               "instrument/probe 3.2 +- 0.5 mm, -7 mm/s\npointer: the tracker does not see it\n"
               "instrument/hook TOUCHES, 3.2 +- 0.5 mm, -7 mm/s");
}

TEST(IgtlMessages, WithoutToolsVerticesAndWordsAreEmpty) {
  EXPECT_THAT(points_in(pack_tools({}), Subject::kTools).points, IsEmpty());
  EXPECT_STREQ(test::IgtlReceiver::unpacked<igtl::StringMessage>(*pack_tool_words({}).bytes)->GetString(), "");
}

TEST(IgtlMessages, AStateIsACodeAWordAndASentence) {
  ShownSurface shown = good();
  shown.reason = perimap_SURFACE_REASON_POSE_MISSING;
  struct Row {
    perimap_SurfaceState state;
    int code;
    const char* name;
    const char* may;
  };
  for (const Row& row :
       {Row{perimap_SURFACE_GOOD, igtl::StatusMessage::STATUS_OK, "good", "may be used"},
        Row{perimap_SURFACE_DEGRADED, igtl::StatusMessage::STATUS_NOT_READY, "degraded", "use with care"},
        Row{perimap_SURFACE_INVALID, igtl::StatusMessage::STATUS_DISABLED, "invalid", "use no position"}}) {
    shown.state = row.state;
    shown.why = row.state == perimap_SURFACE_GOOD ? "" : "no pose of the scope";
    const auto message = pack_state(Subject::kSurfaceStatus, surface_state_of(shown));
    const auto status = test::IgtlReceiver::unpacked<igtl::StatusMessage>(*message.bytes);
    EXPECT_STREQ(status->GetDeviceName(), "PerimapSurface");
    EXPECT_EQ(status->GetCode(), row.code);
    EXPECT_EQ(status->GetSubCode(), perimap_SURFACE_REASON_POSE_MISSING);
    EXPECT_STREQ(status->GetErrorName(), row.name);
    EXPECT_THAT(status->GetStatusString(), HasSubstr(row.may));
    EXPECT_THAT(status->GetStatusString(), HasSubstr(shown.why));
  }
}

TEST(IgtlMessages, AnUnknownPoseOfTheCameraIsAState) {
  ShownSurface shown = good();
  EXPECT_EQ(camera_state_of(shown).code, IgtlState::Code::kOk);
  shown.X_WC.reset();
  const auto message = pack_state(Subject::kCameraStatus, camera_state_of(shown));
  const auto status = test::IgtlReceiver::unpacked<igtl::StatusMessage>(*message.bytes);
  EXPECT_STREQ(status->GetDeviceName(), "PerimapCamera");
  EXPECT_EQ(status->GetCode(), igtl::StatusMessage::STATUS_NOT_FOUND);
}

}  // namespace
}  // namespace perimap

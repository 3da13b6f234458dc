#include "drivers/camera/v4l2_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/transport/camera_endpoint.hpp"
#include "tests/unit/camera/fake_v4l2_node.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::FakeCamera;
using test::FakeFrame;
using test::FakeV4l2Node;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Grab = V4l2Stream::Grab;

V4l2Settings settings() {
  V4l2Settings s;
  s.path = "/dev/video9";
  return s;
}

Expected<std::unique_ptr<V4l2Stream>> open(FakeCamera& camera, const V4l2Settings& wanted = settings()) {
  return V4l2Stream::open(std::make_unique<FakeV4l2Node>(camera), wanted);
}

std::string error_of(FakeCamera& camera, const V4l2Settings& wanted = settings()) {
  const auto stream = open(camera, wanted);
  return stream ? "opened" : stream.error().message;
}

TEST(CameraEndpoint, IsANodeOrAVideoFile) {
  EXPECT_EQ(parse_camera_endpoint("v4l2:/dev/video0").value(), CameraEndpoint(V4l2Endpoint{"/dev/video0"}));
  EXPECT_EQ(parse_camera_endpoint("video:heart.mkv").value(), CameraEndpoint(VideoEndpoint{"heart.mkv"}));
  for (const char* wrong : {"", "/dev/video0", "v4l2:", "v4l2:video0", "video:", "usb:1"}) {
    EXPECT_FALSE(parse_camera_endpoint(wrong)) << wrong;
  }
  EXPECT_EQ(format_camera_endpoint(V4l2Endpoint{"/dev/video0"}), "v4l2:/dev/video0");
}

TEST(MidExposure, FollowsWhatTheStampStandsFor) {
  const Instant stamp{seconds(100)};
  const auto at = [&](StampSource source, Duration exposure, Duration period, Duration delay) {
    return mid_exposure(stamp, source, exposure, period, delay) - stamp;
  };
  EXPECT_EQ(at(StampSource::kStartOfExposure, milliseconds(8), milliseconds(20), Duration(0)), milliseconds(4));
  EXPECT_EQ(at(StampSource::kEndOfFrame, milliseconds(8), milliseconds(20), Duration(0)), milliseconds(-24));
  EXPECT_EQ(at(StampSource::kEndOfFrame, Duration(0), Duration(0), milliseconds(40)), milliseconds(-40));
}

TEST(FrameCount, GoesOnOverGapsWrapsAndOpenings) {
  FrameCount count;
  EXPECT_EQ(count.next(0xFFFFFFFEU), 1U);
  EXPECT_EQ(count.gap(), 0U);
  EXPECT_EQ(count.next(1), 4U);  // the driver's count went over its end
  EXPECT_EQ(count.gap(), 2U);
  count.reopen();
  EXPECT_EQ(count.next(7), 5U);
  EXPECT_EQ(count.gap(), 0U);
  // A driver that does not count.
  EXPECT_EQ(count.next(0), 6U);
  EXPECT_EQ(count.next(0), 7U);
  EXPECT_EQ(count.gap(), 0U);
}

TEST(V4l2Stream, TakesTheFormatWithColourThatNeedsTheLeastWork) {
  FakeCamera camera;
  camera.formats = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_UYVY};
  const auto stream = open(camera);
  ASSERT_TRUE(stream) << stream.error().message;
  EXPECT_EQ((*stream)->frame().format, PixelFormat::kUyvy);
  EXPECT_THAT(camera.tried_formats, ElementsAre(V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_UYVY));
  EXPECT_THAT((*stream)->identity(), AllOf(HasSubstr("Fake (fake)"), HasSubstr("uyvy 640x480 at 30.00 Hz")));
}

TEST(V4l2Stream, PassesOverAFormatThatIsMuchSlowerThanAnother) {
  FakeCamera camera;
  camera.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
  camera.offered_periods = {{V4L2_PIX_FMT_YUYV, {{1, 5}}}, {V4L2_PIX_FMT_MJPEG, {{1, 15}, {1, 30}}}};
  auto wanted = settings();
  EXPECT_EQ(open(camera, wanted).value()->frame().format, PixelFormat::kMjpg);
  wanted.frame_rate_hz = 30;
  EXPECT_EQ(open(camera, wanted).value()->frame().format, PixelFormat::kMjpg);
  wanted.frame_rate_hz = 0;
  wanted.format = PixelFormat::kYuyv;  // as asked
  EXPECT_EQ(open(camera, wanted).value()->frame().format, PixelFormat::kYuyv);
  wanted.format.reset();
  camera.offered_periods[V4L2_PIX_FMT_YUYV] = {{1, 28}, {1, 5}};
  EXPECT_EQ(open(camera, wanted).value()->frame().format, PixelFormat::kYuyv);
  wanted.frame_rate_hz = 30;  // which 28 is not
  EXPECT_EQ(open(camera, wanted).value()->frame().format, PixelFormat::kMjpg);
}

TEST(V4l2Stream, GivesFramesWithTheirStampAndRowsAsTheDriverHasThem) {
  FakeCamera camera;
  camera.padding = 64;
  camera.controls[V4L2_CID_EXPOSURE_AUTO] = V4L2_EXPOSURE_MANUAL;  // 15.6 ms
  FakeFrame end_of_frame{.sequence = 5, .age = milliseconds(3), .fill = 7};
  FakeFrame start{.sequence = 6,
                  .flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
                  .age = milliseconds(30)};
  camera.frames = {end_of_frame, start};
  auto wanted = settings();
  wanted.delay = milliseconds(2);
  auto stream = open(camera, wanted).value();
  const Interrupt interrupt;
  ASSERT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kFrame);
  const CameraFrame& frame = stream->frame();
  EXPECT_EQ(frame.stamp.sequence, 5U);
  EXPECT_EQ(frame.stride, 2U * 640 + 64);
  EXPECT_EQ(frame.bytes.size(), frame.stride * 480);
  EXPECT_EQ(frame.bytes[0], std::byte{7});
  // A stamp of 3 ms ago, a period of 33.3 ms before it, half of 15.6 ms of exposure, 2 ms of delay.
  const Duration before = frame.stamp.arrival - frame.stamp.capture;
  EXPECT_GE(before, microseconds(46'100));
  EXPECT_LE(before, microseconds(46'200) + seconds(1));
  ASSERT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kFrame);
  EXPECT_GE(stream->frame().stamp.arrival - stream->frame().stamp.capture, microseconds(24'100));
  EXPECT_LT(stream->frame().stamp.arrival - stream->frame().stamp.capture, microseconds(46'100));
  EXPECT_THAT(camera.misuse, IsEmpty());
}

TEST(V4l2Stream, GivesEveryBufferBackAndStopsWhenItEnds) {
  FakeCamera camera;
  for (std::uint32_t i = 0; i < 50; ++i) camera.frames.push_back({.sequence = i});
  auto stream = open(camera).value();
  const Interrupt interrupt;
  for (int i = 0; i < 50; ++i) ASSERT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kFrame);
  stream.reset();
  EXPECT_EQ(camera.streams_off, 1);
  EXPECT_EQ(camera.mapped, 4);
  EXPECT_EQ(camera.unmapped, 4);
  EXPECT_THAT(camera.misuse, IsEmpty());
}

TEST(V4l2Stream, CallsDamagedWhatIsNoPicture) {
  struct Case {
    const char* name;
    FakeFrame frame;
  };
  const Case cases[] = {
      {"the error flag", {.flags = V4L2_BUF_FLAG_ERROR | V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC}},
      {"too few bytes", {.bytesused = 640 * 480 * 2 - 1}},
      {"no bytes", {.bytesused = 0}},
      {"more bytes than the buffer has", {.bytesused = 1U << 30U}},
      {"a stamp in the future", {.age = -seconds(1)}},
      {"a stamp of another clock", {.age = std::chrono::hours(-24 * 365)}},
      {"a stamp long past", {.age = seconds(3)}},
  };
  const Interrupt interrupt;
  for (const Case& c : cases) {
    FakeCamera camera;
    camera.frames = {c.frame, {}};
    auto stream = open(camera).value();
    EXPECT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kDamaged) << c.name;
    EXPECT_STRNE(stream->damage(), "") << c.name;
    EXPECT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kFrame) << c.name;
    EXPECT_THAT(camera.misuse, IsEmpty()) << c.name;
  }
}

TEST(V4l2Stream, AFrameThatCameBeforeItWasExposedIsNoneAndTheDelayIsDoubted) {
  FakeCamera camera;
  camera.frames = {{.age = milliseconds(3)}};
  auto wanted = settings();
  wanted.delay = -milliseconds(100);
  auto stream = open(camera, wanted).value();
  const Interrupt interrupt;
  EXPECT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kDamaged);
  EXPECT_THAT(stream->damage(), HasSubstr("camera.delay_ms"));
}

TEST(V4l2Stream, WaitsOnWhenABufferWasNotThereAfterAll) {
  FakeCamera camera;
  camera.frames = {{.error = EAGAIN}, {}};
  auto stream = open(camera).value();
  const Interrupt interrupt;
  EXPECT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kNothing);
  EXPECT_EQ(stream->next(seconds(1), interrupt).value(), Grab::kFrame);
}

TEST(V4l2Stream, EndsWhenTheDeviceGoesOrItsSignalChanges) {
  const Interrupt interrupt;
  struct Case {
    FakeFrame frame;
    const char* reason;
  };
  for (const Case& c : {Case{{.error = ENODEV}, "the device has gone"}, Case{{.error = EIO}, "no more frames"},
                        Case{{.error = EAGAIN, .ready = V4l2Node::Ready::kError}, "its driver has stopped"},
                        Case{{.error = ENODEV, .ready = V4l2Node::Ready::kError}, "the device has gone"},
                        Case{{.ready = V4l2Node::Ready::kEvent}, "signal at its input changed"}}) {
    FakeCamera camera;
    camera.frames = {c.frame};
    auto stream = open(camera).value();
    const auto got = stream->next(seconds(1), interrupt);
    ASSERT_FALSE(got);
    EXPECT_THAT(got.error().message, AllOf(HasSubstr("/dev/video9"), HasSubstr(c.reason)));
  }
}

TEST(V4l2Stream, SaysWhatTheCameraGivesInsteadOfWhatWasAsked) {
  FakeCamera camera;
  auto wanted = settings();
  wanted.width = 1920;
  wanted.height = 1080;
  EXPECT_THAT(error_of(camera, wanted), HasSubstr("gives 640x480 instead of 1920x1080; it has 640x480"));
  wanted = settings();
  wanted.format = PixelFormat::kGrey;
  EXPECT_THAT(error_of(camera, wanted), HasSubstr("does not give mono8; it offers YUYV, MJPG"));
  camera.formats = {V4L2_PIX_FMT_RGB24};
  EXPECT_THAT(error_of(camera), HasSubstr("any format perimap takes; it offers RGB3"));
  camera = {};
  camera.field = V4L2_FIELD_INTERLACED;
  EXPECT_THAT(error_of(camera), HasSubstr("interlaced"));
  camera = {};
  wanted = settings();
  wanted.frame_rate_hz = 60.0;
  EXPECT_THAT(error_of(camera, wanted), HasSubstr("gives 30 frames/s instead of 60"));
  camera.period = {1, 60};
  EXPECT_EQ(error_of(camera, wanted), "opened");
}

TEST(V4l2Stream, SaysWhyItCannotBeOpened) {
  struct Case {
    void (*spoil)(FakeCamera&);
    const char* reason;
  };
  const Case cases[] = {
      {[](FakeCamera& c) { c.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING; }, "not a camera"},
      {[](FakeCamera& c) { c.capabilities = V4L2_CAP_VIDEO_CAPTURE; }, "cannot stream"},
      {[](FakeCamera& c) { c.capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING; }, "several planes"},
      {[](FakeCamera& c) { c.errors[VIDIOC_QUERYCAP] = ENOTTY; }, "not a video device"},
      {[](FakeCamera& c) { c.errors[VIDIOC_S_FMT] = EBUSY; }, "in use by another program"},
      {[](FakeCamera& c) { c.dv_timings_error = ENOLINK; }, "no signal"},
      {[](FakeCamera& c) { c.dv_timings_error = ENOLCK; }, "not stable"},
      {[](FakeCamera& c) { c.dv_timings_error = ERANGE; }, "cannot take"},
      {[](FakeCamera& c) { c.most_buffers = 1; }, "1 buffers only"},
      {[](FakeCamera& c) { c.streamon_error = ENOSPC; }, "bandwidth"},
      {[](FakeCamera& c) { c.errors[VIDIOC_REQBUFS] = ENODEV; }, "has gone"},
      {[](FakeCamera& c) { c.padding = static_cast<std::uint32_t>(-4); }, "bytes a row"},
  };
  for (const Case& c : cases) {
    FakeCamera camera;
    c.spoil(camera);
    EXPECT_THAT(error_of(camera), HasSubstr(c.reason));
    EXPECT_EQ(camera.mapped, camera.unmapped) << c.reason;
  }
}

TEST(V4l2Stream, SetsTheControlsAndSaysWhichThereAreNot) {
  FakeCamera camera;
  auto wanted = settings();
  wanted.exposure_ms = 5.0;
  ASSERT_EQ(error_of(camera, wanted), "opened");
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 50);
  wanted.exposure_ms = 600.0;
  EXPECT_THAT(error_of(camera, wanted), HasSubstr("camera.exposure_ms is out of its range"));
  wanted = settings();
  wanted.gain = 3;
  EXPECT_THAT(error_of(camera, wanted), HasSubstr("leave camera.gain out"));
}

TEST(V4l2Stream, TakesTheRateOfADigitalInputFromItsSignal) {
  FakeCamera camera;
  camera.dv_timings_error = 0;
  camera.errors[VIDIOC_G_PARM] = ENOTTY;
  const auto stream = open(camera);
  ASSERT_TRUE(stream) << stream.error().message;
  EXPECT_NEAR(to_seconds((*stream)->period()), 1.0 / 60.0, 1e-6);  // 2200 x 1125 pixels at 148.5 MHz
}

// ---- opened again and again

struct Seen {
  std::vector<std::uint64_t> sequences;
  DeviceHealth health;
};

// Serves the camera until `frames` have come; openings after the first find `later`.
void serve(FakeCamera& first, FakeCamera& later, std::size_t frames, Seen& seen, int refused = 0) {
  Interrupt interrupt;
  int openings = 0;
  const V4l2Opener opener = [&](const std::string& path) -> Expected<std::unique_ptr<V4l2Node>> {
    const int opening = openings++;
    if (opening > 0 && opening <= refused) return fail(path + ": no such device");
    return std::make_unique<FakeV4l2Node>(opening == 0 ? first : later);
  };
  const CameraSink sink = [&](const CameraFrame& frame) {
    seen.sequences.push_back(frame.stamp.sequence);
    if (seen.sequences.size() == frames) interrupt.request();
  };
  serve_v4l2_camera(settings(), sink, seen.health, interrupt, opener);
}

TEST(V4l2Camera, CountsWhatTheDriverLostAndWhatCameDamaged) {
  FakeCamera camera;
  camera.frames = {{.sequence = 3}, {.sequence = 4}, {.sequence = 7}, {.sequence = 8, .bytesused = 1}, {.sequence = 9}};
  Seen seen;
  serve(camera, camera, 4, seen);
  EXPECT_THAT(seen.sequences, ElementsAre(1, 2, 5, 7));
  EXPECT_EQ(seen.health.lost.get(), 2U);
  EXPECT_EQ(seen.health.damaged.get(), 1U);
  EXPECT_EQ(seen.health.samples.get(), 4U);
}

TEST(V4l2Camera, IsOpenedAgainWhenItWasUnplugged) {
  FakeCamera first;
  first.frames = {{.sequence = 0}, {.sequence = 1}, {.error = ENODEV}};
  FakeCamera later;
  later.frames = {{.sequence = 0}, {.sequence = 1}};
  Seen seen;
  serve(first, later, 4, seen, 2);
  EXPECT_THAT(seen.sequences, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(seen.health.openings.get(), 2U);
  EXPECT_EQ(seen.health.lost.get(), 0U);
  EXPECT_EQ(first.unmapped, first.mapped);
  EXPECT_EQ(seen.health.state(), DeviceState::kClosed);
}

}  // namespace
}  // namespace perimap

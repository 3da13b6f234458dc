#include "daemon/runtime/setup_warnings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perimap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Measured, as it should be.
Configuration measured() {
  Configuration configuration;
  configuration.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  configuration.tracker.translation_SC_mm[2] = 200.0;
  configuration.tracker.position_deviation_mm = 0.3;
  configuration.tracker.rotation_deviation_rad = 0.004;
  return configuration;
}

CameraModel lens() {
  CameraModel camera;
  camera.width = 1280, camera.height = 720;
  camera.fx = camera.fy = 900.0;
  camera.cx = 640.0, camera.cy = 360.0;
  camera.k1 = -0.2;
  return camera;
}

TEST(SetupWarnings, SayNothingOfAMeasuredSetUp) { EXPECT_THAT(setup_warnings(measured(), lens()), IsEmpty()); }

TEST(SetupWarnings, SayNothingOfAReplayAndWithoutATracker) {
  Configuration configuration;
  EXPECT_THAT(setup_warnings(configuration, lens()), IsEmpty());
  configuration.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
  configuration.replay.recording = "session.mcap";
  EXPECT_THAT(setup_warnings(configuration, lens()), IsEmpty());
}

TEST(SetupWarnings, NameWhatIsForTrialsAlone) {
  Configuration configuration = measured();
  configuration.camera.device = "v4l2:/dev/video0";
  configuration.ecg.protocol = EcgConfiguration::Protocol::kBitalino;
  EXPECT_THAT(setup_warnings(configuration, lens()), IsEmpty());
  configuration.camera.repeats_allowed = configuration.ecg.repeats_allowed = true;
  EXPECT_THAT(setup_warnings(configuration, lens()),
              ElementsAre(HasSubstr("camera.repeats_allowed"), HasSubstr("ecg.repeats_allowed")));
}

TEST(SetupWarnings, NameAnIdentityHandEye) {
  Configuration configuration = measured();
  configuration.tracker.translation_SC_mm[2] = 0.0;
  EXPECT_THAT(setup_warnings(configuration, lens()), ElementsAre(HasSubstr("tracker.hand_eye_translation_SC_mm")));
}

TEST(SetupWarnings, NameATrackerThatIsSaidToBeExact) {
  Configuration configuration = measured();
  configuration.tracker.position_deviation_mm = configuration.tracker.rotation_deviation_rad = 0.0;
  EXPECT_THAT(setup_warnings(configuration, lens()), ElementsAre(HasSubstr("tracker.position_deviation_mm")));
  configuration.tracker.position_deviation_mm = 1.0;
  EXPECT_THAT(setup_warnings(configuration, lens()), ElementsAre(HasSubstr("tracker.rotation_deviation_deg")));
}

TEST(SetupWarnings, NameAPrincipalPointFarFromTheMiddle) {
  CameraModel camera = lens();
  camera.cx = 640.0 + 0.19 * 1280.0;
  EXPECT_THAT(setup_warnings(measured(), camera), IsEmpty());
  camera.cx = 640.0 + 0.21 * 1280.0;
  EXPECT_THAT(setup_warnings(measured(), camera), ElementsAre(HasSubstr("principal point")));
}

TEST(SetupWarnings, NameAWideLensWithoutDistortion) {
  CameraModel camera = lens();
  camera.k1 = 0.0;
  EXPECT_THAT(setup_warnings(measured(), camera), ElementsAre(HasSubstr("no distortion")));
  camera.fx = camera.fy = 4000.0;
  EXPECT_THAT(setup_warnings(measured(), camera), IsEmpty());
}

}  // namespace
}  // namespace perimap

// Pictures of tissue that beats before a camera that keeps still, by another clock than the ECG's: as a clip that is
// looped in place of a camera.
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "core/following/video_tracker.hpp"
#include "tests/simulated/still_camera_session.hpp"
#include "tests/simulated/wet_tissue.hpp"

namespace perimap {
namespace {

constexpr int kFrames = 240, kFeatures = 120;
constexpr int kBegun = 50;  // frames after which features must be there
constexpr double kRate = 25;

test::StillCameraSettings settings_for(const WetTissueSettings& tissue, int workers) {
  test::StillCameraSettings settings;
  settings.width = tissue.width;
  settings.height = tissue.height;
  settings.frames_per_s = kRate;
  settings.features = kFeatures;
  settings.workers = workers;
  return settings;
}

// How many places of features were further than this from where their tissue has gone since they began.
class Truth {
 public:
  explicit Truth(const WetTissue& tissue) : tissue_(tissue) {}
  void judge(std::uint32_t id, const Vector2d& px, int frame) {
    constexpr double kOff_px = 5;
    const auto& [first, first_px] = begun_.try_emplace(id, frame, px).first->second;
    ++judged_;
    off_ += (px - tissue_.moved(first_px, first, frame)).norm() > kOff_px ? 1 : 0;
  }
  [[nodiscard]] double judged() const { return judged_; }
  [[nodiscard]] double off() const { return off_; }

 private:
  const WetTissue& tissue_;
  std::map<std::uint32_t, std::pair<int, Vector2d>> begun_;
  double judged_ = 0, off_ = 0;
};

TEST(StillTissue, IsFollowedAsWithoutAMapAndCalledWhatItIs) {
  const WetTissueSettings settings;
  WetTissue tissue(settings);
  test::StillCameraSession session(settings_for(settings, 1));
  VideoTracker tracker({.features = kFeatures, .frames_per_s = kRate});
  Truth of_pipeline(tissue), of_tracker(tissue);
  for (int k = 0; k < kFrames; ++k) {
    const WetTissue::Frame frame = tissue.frame(k);
    session.deliver(frame.grey, frame.colour);
    tracker.track_into(frame.grey);
    ASSERT_TRUE(tracker.fill_up(frame.grey, frame.colour));
    if (k < kBegun) continue;
    for (const auto& [id, px] : session.found()) of_pipeline.judge(id, px, k);
    for (const FollowedFeature& feature : tracker.features()) {
      if (feature.found && feature.state == FollowState::kTracked) of_tracker.judge(feature.id, feature.px, k);
    }
  }
  EXPECT_GE(of_pipeline.judged(), 0.9 * of_tracker.judged());
  // Its features are spread over the picture, and so more of them stand on weak corners.
  EXPECT_LE(of_tracker.off() / of_tracker.judged(), 0.05);
  EXPECT_LE(of_pipeline.off() / of_pipeline.judged(), 0.1)
      << of_pipeline.off() << " of " << of_pipeline.judged() << "; without a map " << of_tracker.off() << " of "
      << of_tracker.judged();
  std::size_t no_parallax = 0, late = 0;
  for (std::size_t i = 0; i < session.told().size(); ++i) {
    const auto& told = session.told()[i];
    EXPECT_NE(told.state, SurfaceState::kGood) << i;
    if (i < 3 * session.told().size() / 4) continue;
    ++late;
    no_parallax += told.reason == SurfaceReason::kNoParallax ? 1 : 0;
  }
  EXPECT_GE(no_parallax, 9 * late / 10) << "of " << late;
}

TEST(StillTissue, IsFollowedAlikeWhateverTheNumberOfWorkers) {
  WetTissueSettings settings;
  settings.seed = 2;
  WetTissue tissue(settings);
  test::StillCameraSession one(settings_for(settings, 1)), three(settings_for(settings, 3));
  for (int k = 0; k < 90; ++k) {
    const WetTissue::Frame frame = tissue.frame(k);
    one.deliver(frame.grey, frame.colour);
    three.deliver(frame.grey, frame.colour);
    ASSERT_EQ(one.found(), three.found()) << "frame " << k;
  }
  EXPECT_GT(one.found().size(), std::size_t{kFeatures} / 2);
}

}  // namespace
}  // namespace perimap

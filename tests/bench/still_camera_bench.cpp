// Videos in place of a still camera, looped, in the pipeline with a tracker that says so and an ECG of another heart;
// beside it the tracker without a map. A line a second. Arguments: FEATURES FRAMES NOISE_mm VIDEO..., the noise that of
// the emulated tracker.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>

#include "core/following/video_tracker.hpp"
#include "drivers/video/video_file.hpp"
#include "tests/simulated/still_camera_session.hpp"

namespace perimap::bench {
namespace {

class Session {
 public:
  Session(const VideoFrame& first, double rate, int features, double tracker_noise_mm)
      : rate_(rate),
        session_({.width = first.grey.width,
                  .height = first.grey.height,
                  .frames_per_s = rate,
                  .features = features,
                  .workers = 1,
                  .tracker_noise_mm = tracker_noise_mm}),
        tracker_({.features = features, .frames_per_s = rate}) {}

  void take(const VideoFrame& frame) {
    session_.deliver(frame.grey, frame.colour);
    tracker_.track_into(frame.grey);
    if (!tracker_.fill_up(frame.grey, frame.colour)) std::exit(1);
    ++frames_;
    const auto found = session_.found();
    in_pipeline_ += static_cast<double>(found.size());
    for (const auto& feature : tracker_.features()) {
      in_tracker_ += feature.found && feature.state == FollowState::kTracked ? 1 : 0;
    }
    for (const auto& [id, px] : found) ++lives_[id];
    for (const FeatureSlot& slot : session_.slots()) {
      by_last_view_ += slot.match.state == MatchState::kFound && slot.seen_by_last_view ? 1 : 0;
    }
    if (frames_ % static_cast<int>(rate_) == 0) tell();
  }

 private:
  void tell() {
    std::map<SlotState, int> states;
    for (const FeatureSlot& slot : session_.slots()) ++states[slot.state];
    std::map<int, int> reasons;
    for (; told_ < session_.told().size(); ++told_) ++reasons[static_cast<int>(session_.told()[told_].reason)];
    int converged = 0;
    for (const FeatureSlot& slot : session_.slots()) converged += slot.converged ? 1 : 0;
    PipelineCounters& counters = session_.counters();
    std::printf(
        "%4d  found %5.1f (by last view %5.1f), track %5.1f | empty %3d tracked %3d starting %3d mapped %3d "
        "converged %3d | lost unseen %llu refused %llu unstarted %llu, ids %zu | reasons",
        frames_, in_pipeline_ / rate_, by_last_view_ / rate_, in_tracker_ / rate_, states[SlotState::kEmpty],
        states[SlotState::kTracked], states[SlotState::kStarting], states[SlotState::kMapped], converged,
        static_cast<unsigned long long>(counters.features_lost_unseen.get()),
        static_cast<unsigned long long>(counters.features_lost_refused.get()),
        static_cast<unsigned long long>(counters.features_lost_unstarted.get()), lives_.size());
    for (const auto& [reason, count] : reasons) std::printf(" %d:%d", reason, count);
    std::printf("\n");
    std::fflush(stdout);
    in_pipeline_ = in_tracker_ = by_last_view_ = 0;
  }

  double rate_;
  test::StillCameraSession session_;
  VideoTracker tracker_;
  int frames_ = 0;
  std::size_t told_ = 0;
  double in_pipeline_ = 0, in_tracker_ = 0, by_last_view_ = 0;
  std::map<std::uint32_t, int> lives_;
};

bool run(const std::string& path, int features, int frames, double tracker_noise_mm) {
  std::unique_ptr<Session> session;
  for (int taken = 0; taken < frames;) {
    auto reader = VideoReader::open(path);
    if (!reader) {
      std::fprintf(stderr, "%s\n", reader.error().message.c_str());
      return false;
    }
    for (auto frame = (*reader)->next(); frame && *frame != nullptr && taken < frames; frame = (*reader)->next()) {
      if (session == nullptr) {
        const double rate = (*reader)->frames_per_s();
        session = std::make_unique<Session>(**frame, rate > 0 ? rate : 25, features, tracker_noise_mm);
      }
      session->take(**frame);
      ++taken;
    }
  }
  return true;
}

}  // namespace
}  // namespace perimap::bench

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "still_camera_bench FEATURES FRAMES NOISE_mm VIDEO...\n");
    return 2;
  }
  bool all = true;
  for (int i = 4; i < argc; ++i) {
    std::printf("%s\n", argv[i]);
    all = perimap::bench::run(argv[i], std::atoi(argv[1]), std::atoi(argv[2]), std::atof(argv[3])) && all;
  }
  return all ? 0 : 1;
}

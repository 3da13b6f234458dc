#include "drivers/standins/emulator/simulated_frames.hpp"

namespace perimap {

SimulatedFrames::SimulatedFrames(const Simulation& simulation)
    : simulation_(simulation),
      pixels_(static_cast<std::size_t>(simulation.settings().width) *
              static_cast<std::size_t>(simulation.settings().height)) {}

Expected<std::optional<PlayedFrame>> SimulatedFrames::next(Instant now) {
  const auto frames = simulation_.frames();
  for (; next_ < frames.size() && frames[next_].stamp.arrival < now + rendering_; ++next_) ++left_out_;
  if (next_ == frames.size()) return std::optional<PlayedFrame>();
  const FrameStamp& stamp = frames[next_].stamp;
  const Instant begun = MonotonicClock::now();
  simulation_.render(next_++, workspace_, pixels_);
  rendering_ = MonotonicClock::now() - begun;
  const int width = simulation_.settings().width;
  return PlayedFrame{stamp.capture, stamp.arrival, {pixels_.data(), width, simulation_.settings().height, width}};
}

}  // namespace perimap

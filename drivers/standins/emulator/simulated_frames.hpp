// A simulated heart's frames for an emulated camera, rendered as they are asked for.
#pragma once

#include <cstddef>
#include <vector>

#include "drivers/standins/emulator/played_frames.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// Where rendering does not keep up with the frame rate, as many frames are left out as it takes, and those that are
// shown are shown in time.
class SimulatedFrames final : public PlayedFrames {
 public:
  // `simulation` must outlive this.
  explicit SimulatedFrames(const Simulation& simulation);

  [[nodiscard]] Instant first_arrival() const noexcept override { return simulation_.arrivals().front().arrival; }
  [[nodiscard]] Expected<std::optional<PlayedFrame>> next(Instant now) override;
  [[nodiscard]] std::uint64_t left_out() const noexcept override { return left_out_; }

 private:
  const Simulation& simulation_;
  RenderWorkspace workspace_;
  std::vector<std::uint8_t> pixels_;
  std::size_t next_ = 0;
  std::uint64_t left_out_ = 0;
  Duration rendering_{0};  // what the last one took
};

}  // namespace perimap

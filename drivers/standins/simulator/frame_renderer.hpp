// Renders a simulation's frames ahead on several threads and hands them out in order.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "drivers/standins/simulator/parallel_for.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// A ParallelFor on so many threads.
[[nodiscard]] ParallelFor threaded_for(unsigned threads);

// Frames are functions of the simulation alone, so the result does not depend on the number of threads.
class FrameRenderer {
 public:
  // `simulation` must outlive this.
  FrameRenderer(const Simulation& simulation, unsigned threads);
  FrameRenderer(const FrameRenderer&) = delete;
  FrameRenderer& operator=(const FrameRenderer&) = delete;
  ~FrameRenderer();  // stops the threads after the frames they are at

  // The next frame's pixels, from frame 0 on, valid until the next call. Call it frames().size() times at most.
  [[nodiscard]] std::span<const std::uint8_t> next();

 private:
  struct Slot {
    std::vector<std::uint8_t> image;
    bool ready = false;
  };

  void work();

  const Simulation& simulation_;
  std::mutex mutex_;
  std::condition_variable slot_free_;
  std::condition_variable frame_ready_;
  std::vector<Slot> slots_;  // frame k is rendered into slot k mod size
  std::size_t started_ = 0;  // frames taken up by a thread
  std::size_t handed_out_ = 0;
  bool stop_ = false;
  std::vector<std::jthread> threads_;  // last, so that they end before what they use
};

}  // namespace perimap

#include "drivers/standins/simulator/frame_renderer.hpp"

#include <algorithm>
#include <atomic>

namespace perimap {

ParallelFor threaded_for(unsigned threads) {
  return [threads](int count, const std::function<void(int)>& body) {
    std::atomic<int> next{0};
    const auto work = [&] {
      for (int i = next.fetch_add(1); i < count; i = next.fetch_add(1)) body(i);
    };
    std::vector<std::jthread> helpers;
    for (unsigned i = 1; i < threads; ++i) helpers.emplace_back(work);
    work();
  };
}

FrameRenderer::FrameRenderer(const Simulation& simulation, unsigned threads)
    : simulation_(simulation), slots_(2 * std::size_t{std::max(threads, 1U)} + 2) {
  const std::size_t pixels =
      static_cast<std::size_t>(simulation.settings().width) * static_cast<std::size_t>(simulation.settings().height);
  for (Slot& slot : slots_) slot.image.resize(pixels);
  for (unsigned i = 0; i < std::max(threads, 1U); ++i) threads_.emplace_back([this] { work(); });
}

FrameRenderer::~FrameRenderer() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  slot_free_.notify_all();
}

std::span<const std::uint8_t> FrameRenderer::next() {
  std::unique_lock lock(mutex_);
  if (handed_out_ > 0) slots_[(handed_out_ - 1) % slots_.size()].ready = false;
  Slot& slot = slots_[handed_out_ % slots_.size()];
  frame_ready_.wait(lock, [&] { return slot.ready; });
  ++handed_out_;
  slot_free_.notify_one();
  return slot.image;
}

void FrameRenderer::work() {
  RenderWorkspace workspace;
  std::unique_lock lock(mutex_);
  for (;;) {
    // The slot of the frame handed out last is still being read.
    slot_free_.wait(lock, [&] {
      return stop_ || started_ == simulation_.frames().size() ||
             started_ + 1 < std::max<std::size_t>(handed_out_, 1) + slots_.size();
    });
    if (stop_ || started_ == simulation_.frames().size()) return;
    const std::size_t frame = started_++;
    Slot& slot = slots_[frame % slots_.size()];
    lock.unlock();
    simulation_.render(frame, workspace, slot.image);
    lock.lock();
    slot.ready = true;
    frame_ready_.notify_one();
  }
}

}  // namespace perimap

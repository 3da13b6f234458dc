#include "drivers/camera/v4l2_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "drivers/device/arrival_clock.hpp"
#include "drivers/device/reopening.hpp"

namespace perimap {
namespace {

constexpr Duration kShortestSilence = std::chrono::milliseconds(500);
constexpr Duration kReopenAfter = std::chrono::seconds(3);

std::string why_none(V4l2Stream& stream, bool damaged) {
  std::string fault = stream.input_fault();
  if (!fault.empty()) return fault;
  return damaged ? stream.damage() : "is another program using it?";
}

// Frames of one opening, until the camera fails (the reason is returned) or the interrupt is requested (empty then).
std::string stream_frames(V4l2Stream& stream, FrameCount& count, const CameraSink& sink, DeviceHealth& health,
                          const Interrupt& interrupt) {
  std::optional<ArrivalClock> clock;
  if (stream.period() > Duration(0)) {
    clock.emplace(ArrivalClockSettings{.period_ns = static_cast<double>(stream.period().count())});
  }
  const Duration silent_after = std::max(kShortestSilence, 3 * stream.period());
  Instant last = MonotonicClock::now();
  const std::uint64_t damaged_before = health.damaged.get();
  count.reopen();
  for (;;) {
    auto got = stream.next(silent_after, interrupt);
    if (!got) return std::move(got.error().message);
    if (*got == V4l2Stream::Grab::kInterrupted) return "";
    const bool damaged = *got == V4l2Stream::Grab::kDamaged;
    CameraFrame frame = stream.frame();
    if (damaged || *got == V4l2Stream::Grab::kFrame) {
      frame.stamp.sequence = count.next(static_cast<std::uint32_t>(frame.stamp.sequence));
      health.lost.add(count.gap());
    }
    if (damaged) health.damaged.add();
    if (*got != V4l2Stream::Grab::kFrame) {
      const Duration silence = MonotonicClock::now() - last;
      if (silence >= kReopenAfter) {
        return fmt::format("no good frame for 3 s: {}", why_none(stream, health.damaged.get() > damaged_before));
      }
      // Frames that are none are silence too.
      if (silence >= silent_after && health.state() == DeviceState::kStreaming) health.set_state(DeviceState::kSilent);
      continue;
    }
    last = frame.stamp.arrival;
    if (clock) {
      const auto counted = static_cast<std::int64_t>(frame.stamp.sequence);
      clock->observe(counted, frame.stamp.arrival);
      health.jitter.add(clock->lateness(counted, frame.stamp.arrival));
    }
    health.samples.add();
    sink(frame);
    health.set_state(DeviceState::kStreaming);
  }
}

}  // namespace

std::uint64_t FrameCount::next(std::uint32_t sequence) noexcept {
  const std::uint32_t step = sequence - sequence_;  // wraps as the driver's count does
  constexpr std::uint32_t kBackwards = 1U << 31U;
  gap_ = open_ && step > 1 && step < kBackwards ? step - 1 : 0;
  open_ = true;
  sequence_ = sequence;
  count_ += gap_ + 1;
  return count_;
}

void serve_v4l2_camera(const V4l2Settings& settings, const CameraSink& sink, DeviceHealth& health,
                       const Interrupt& interrupt, const V4l2Opener& open) {
  FrameCount count;
  const auto open_stream = [&] {
    return open(settings.path).and_then([&settings](std::unique_ptr<V4l2Node> node) {
      return V4l2Stream::open(std::move(node), settings);
    });
  };
  const auto use_stream = [&](std::unique_ptr<V4l2Stream>& stream) {
    health.set_identity(stream->identity());
    return stream_frames(*stream, count, sink, health, interrupt);
  };
  serve_reopening(open_stream, use_stream, health, interrupt);
}

}  // namespace perimap

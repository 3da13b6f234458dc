#include "drivers/standins/emulator/camera_emulator.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <random>
#include <utility>

#include "drivers/standins/emulator/video_output.hpp"

namespace perimap {

Expected<ShownFrames> emulate_camera(const std::string& device, PlayedFrames& frames, Instant start,
                                     const EmulatorFaults& faults, const EmulatorReady& ready,
                                     const Interrupt& interrupt, const V4l2Opener& open) {
  std::mt19937_64 random(faults.seed);
  std::uniform_real_distribution<> dice(0.0, 1.0);
  const double rate = 1.0 + 1e-6 * faults.drift_ppm;
  const auto played_at = [&](Instant of_session) {
    return start + Duration(std::llround(static_cast<double>((of_session - frames.first_arrival()).count()) / rate));
  };
  const auto session_time = [&](Instant t) {
    return frames.first_arrival() + Duration(std::llround(static_cast<double>((t - start).count()) * rate));
  };
  const auto unplugged = [&faults](Duration since) {
    return faults.unplug_every > Duration(0) &&
           since % (faults.unplug_every + faults.unplug_for) >= faults.unplug_every;
  };
  std::unique_ptr<VideoOutput> output;
  const Instant begun = MonotonicClock::now();
  ShownFrames count;
  for (;;) {
    const auto frame = frames.next(session_time(MonotonicClock::now()));
    if (!frame) return tl::unexpected(frame.error());
    count.too_slow = frames.left_out();
    if (!*frame) return count;
    const GreyImage& image = (*frame)->image;
    const Instant due = played_at((*frame)->arrival);
    if (due < begun) continue;
    if (!wait_unless_interrupted(due - MonotonicClock::now(), interrupt)) return count;
    if (unplugged(due - start)) {
      output.reset();
      continue;
    }
    if (!output) {
      auto opened = open(device).and_then([&](std::unique_ptr<V4l2Node> node) {
        return VideoOutput::open(std::move(node), device, image.width, image.height);
      });
      if (!opened) return tl::unexpected(std::move(opened.error()));
      output = std::move(*opened);
      ready(fmt::format("v4l2:{}, {} {}x{}", device, pixel_format_name(output->format()), image.width, image.height));
    }
    if (dice(random) < faults.lost) {
      ++count.lost;
      continue;
    }
    const bool truncated = dice(random) < faults.truncated;
    const auto shown = output->show(image, played_at((*frame)->capture), truncated ? dice(random) : 1.0);
    if (!shown) return tl::unexpected(shown.error());
    ++(*shown ? count.shown : count.refused);
    if (*shown && truncated) ++count.faulty;
  }
}

}  // namespace perimap

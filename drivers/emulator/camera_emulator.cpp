#include "drivers/emulator/camera_emulator.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <variant>

#include "drivers/emulator/video_output.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {
namespace {

Expected<Instant> first_arrival_of(const std::string& recording) {
  auto all = ReplayReader::open(recording, ReadMode::kStrict);
  if (!all) return tl::unexpected(std::move(all.error()));
  const auto first = all->next();
  if (!first) return tl::unexpected(first.error());
  if (!*first) return fail(recording + ": the recording is empty");
  return arrival_of(**first);
}

}  // namespace

Expected<ShownFrames> emulate_camera(const std::string& device, const std::string& recording, Instant start,
                                     const EmulatorFaults& faults, const EmulatorReady& ready,
                                     const Interrupt& interrupt, const V4l2Opener& open) {
  const auto first_arrival = first_arrival_of(recording);
  if (!first_arrival) return tl::unexpected(first_arrival.error());
  constexpr std::array<std::string_view, 1> kFrames{channels::kCameraImage};
  auto frames = ReplayReader::open(recording, ReadMode::kStrict, kFrames);
  if (!frames) return tl::unexpected(std::move(frames.error()));

  std::mt19937_64 random(faults.seed);
  std::uniform_real_distribution<> dice(0.0, 1.0);
  const auto played_at = [&](Instant recorded) {
    const double since_ns = static_cast<double>((recorded - *first_arrival).count());
    return start + Duration(std::llround(since_ns / (1.0 + 1e-6 * faults.drift_ppm)));
  };
  const auto unplugged = [&faults](Duration since) {
    return faults.unplug_every > Duration(0) &&
           since % (faults.unplug_every + faults.unplug_for) >= faults.unplug_every;
  };
  std::unique_ptr<VideoOutput> output;
  const Instant begun = MonotonicClock::now();
  ShownFrames count;
  for (;;) {
    const auto event = frames->next();
    if (!event) return tl::unexpected(event.error());
    if (!*event) return count;
    const auto& frame = std::get<FrameEvent>(**event);
    const Instant due = played_at(frame.stamp.arrival);
    if (due < begun) continue;
    if (!wait_unless_interrupted(due - MonotonicClock::now(), interrupt)) return count;
    if (unplugged(due - start)) {
      output.reset();
      continue;
    }
    if (!output) {
      auto opened = open(device).and_then([&](std::unique_ptr<V4l2Node> node) {
        return VideoOutput::open(std::move(node), device, frame.width, frame.height);
      });
      if (!opened) return tl::unexpected(std::move(opened.error()));
      output = std::move(*opened);
      ready(fmt::format("v4l2:{}, {} {}x{}", device, pixel_format_name(output->format()), frame.width, frame.height));
    }
    if (dice(random) < faults.lost) {
      ++count.lost;
      continue;
    }
    const bool truncated = dice(random) < faults.truncated;
    const auto shown = output->show(frame.image(), played_at(frame.stamp.capture), truncated ? dice(random) : 1.0);
    if (!shown) return tl::unexpected(shown.error());
    ++(*shown ? count.shown : count.refused);
    if (*shown && truncated) ++count.faulty;
  }
}

}  // namespace perimap

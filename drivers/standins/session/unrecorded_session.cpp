#include "drivers/standins/session/unrecorded_session.hpp"

#include <span>

#include "drivers/standins/session/session_writer.hpp"

namespace perimap {

Expected<std::optional<ReplayEvent>> RenderedEvents::next() {
  if (!waits_ && !sensors_ended_) {
    auto read = sensors_.next();
    if (!read) return read;
    waits_ = *std::move(read);
    sensors_ended_ = !waits_;
  }
  // Of what arrives in the same nanosecond the frame is first, as in Simulation::arrivals().
  const bool frames_left = frame_ < simulation_.frames().size();
  if (frames_left && (!waits_ || simulation_.frames()[frame_].stamp.arrival <= arrival_of(*waits_))) {
    return std::optional<ReplayEvent>(next_frame());
  }
  return std::exchange(waits_, std::nullopt);
}

FrameEvent RenderedEvents::next_frame() {
  const FrameStamp& stamp = simulation_.frames()[frame_++].stamp;
  FrameEvent frame;
  // A recording's messages have no longer count.
  frame.stamp = {static_cast<std::uint32_t>(stamp.sequence), stamp.capture, stamp.arrival};
  frame.width = simulation_.settings().width;
  frame.height = simulation_.settings().height;
  const std::span<const std::uint8_t> pixels = pictures_.next();
  frame.pixels.assign(pixels.begin(), pixels.end());
  return frame;
}

Expected<UnrecordedSession> UnrecordedSession::create(Simulation simulation, const TrackerNoise& noise,
                                                      unsigned threads, bool tool) {
  auto file = UnnamedFile::create();
  if (!file) return tl::unexpected(file.error());
  if (auto written = write_without_pictures(simulation, {file->path(), noise, true, tool}); !written) {
    return tl::unexpected(written.error());
  }
  return UnrecordedSession(std::make_unique<const Simulation>(std::move(simulation)), *std::move(file), threads);
}

}  // namespace perimap

// A simulated session that is replayed without a recording of it.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/error/expected.hpp"
#include "drivers/file/unnamed_file.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/standins/simulator/frame_renderer.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// Everything that a recording's reader would give, and in the same order: what its sensors gave from a file, its
// pictures as they are rendered. Threads render ahead until this is gone.
class RenderedEvents {
 public:
  // `sensors`: at the first event of the session's file. Neither may go before this.
  RenderedEvents(const Simulation& simulation, ReplayReader& sensors, unsigned threads)
      : simulation_(simulation), sensors_(sensors), pictures_(simulation, threads) {}

  // In order of arrival; nullopt at the end.
  [[nodiscard]] Expected<std::optional<ReplayEvent>> next();

 private:
  [[nodiscard]] FrameEvent next_frame();

  const Simulation& simulation_;
  ReplayReader& sensors_;
  bool sensors_ended_ = false;
  std::optional<ReplayEvent> waits_;  // the sensors' next, until the frames before it are out
  std::size_t frame_ = 0;             // the next one
  FrameRenderer pictures_;
};

// What a recording of it would hold but for the pictures is small: it is written at once, as into a recording, and read
// like one. The pictures are rendered ahead as they are wanted, and are gone when they were used.
class UnrecordedSession {
 public:
  // Renders on so many threads; what is replayed does not depend on their number. `tool`: as of a SimulatedRecording.
  [[nodiscard]] static Expected<UnrecordedSession> create(Simulation simulation, const TrackerNoise& noise,
                                                          unsigned threads, bool tool = false);

  // All but the pictures, as a file that only this process sees, for as long as this lives.
  [[nodiscard]] std::string recording() const { return sensors_.path(); }

  // Of its pictures, px.
  [[nodiscard]] int width() const noexcept { return simulation_->settings().width; }
  [[nodiscard]] int height() const noexcept { return simulation_->settings().height; }

  // `sensors`: of recording(), at its first event. It and this must outlive what is given.
  [[nodiscard]] std::unique_ptr<RenderedEvents> events(ReplayReader& sensors) const {
    return std::make_unique<RenderedEvents>(*simulation_, sensors, threads_);
  }

 private:
  UnrecordedSession(std::unique_ptr<const Simulation> simulation, UnnamedFile sensors, unsigned threads)
      : simulation_(std::move(simulation)), sensors_(std::move(sensors)), threads_(threads) {}

  std::unique_ptr<const Simulation> simulation_;  // stays where it is, for those who render it
  UnnamedFile sensors_;
  unsigned threads_;
};

}  // namespace perimap

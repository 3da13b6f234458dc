// A recording's frames for an emulated camera.
#pragma once

#include <string>
#include <utility>

#include "drivers/recording/replay_reader.hpp"
#include "drivers/standins/emulator/played_frames.hpp"

namespace perimap {

// Every frame, however late it is asked for.
class RecordedFrames final : public PlayedFrames {
 public:
  [[nodiscard]] static Expected<RecordedFrames> open(const std::string& recording);

  [[nodiscard]] Instant first_arrival() const noexcept override { return first_arrival_; }
  [[nodiscard]] Expected<std::optional<PlayedFrame>> next(Instant now) override;

 private:
  RecordedFrames(ReplayReader reader, Instant first_arrival)
      : reader_(std::move(reader)), first_arrival_(first_arrival) {}

  ReplayReader reader_;
  Instant first_arrival_;
  FrameEvent frame_;
};

}  // namespace perimap

// The messages that viewers know, into a file.
#pragma once

#include <foxglove.h>
#include <foxglove_view.h>

#include <cstdint>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/bridge/messages/view_topics.hpp"
#include "drivers/file/whole_file.hpp"
#include "drivers/recording/recording_writer.hpp"

namespace perimap {

// The file has its name once finish() has succeeded. Errors name it.
class ViewWriter {
 public:
  [[nodiscard]] static Expected<ViewWriter> create(const std::string& file, const std::string& generator);

  // `utc` is when each of them is shown. A picture's channel has the type of the first one.
  [[nodiscard]] Expected<void> write(const foxglove_RawImage& image, Instant utc);
  [[nodiscard]] Expected<void> write(const foxglove_CompressedImage& image, Instant utc);
  [[nodiscard]] Expected<void> write(const foxglove_CameraCalibration& calibration, Instant utc);
  [[nodiscard]] Expected<void> write(const foxglove_FrameTransform& transform, Instant utc);
  [[nodiscard]] Expected<void> write(const foxglove_SceneUpdate& scene, Instant utc);
  [[nodiscard]] Expected<void> write(const foxglove_ImageAnnotations& annotations, Instant utc);
  [[nodiscard]] Expected<void> write(const perimap_view_EcgValue& value, Instant utc);
  [[nodiscard]] Expected<void> write(const perimap_view_SurfaceWorth& worth, Instant utc);

  [[nodiscard]] Expected<void> finish();

 private:
  // Of a channel: added with its first message.
  struct Lane {
    std::optional<ChannelId> id;
    std::uint32_t sequence = 0;
  };

  ViewWriter(WholeFile file, RecordingWriter writer) : file_(std::move(file)), writer_(std::move(writer)) {}
  template <class T>
  [[nodiscard]] Expected<void> put(Lane& lane, const char* topic, const T& message, Instant utc);

  WholeFile file_;  // goes after what writes to it
  RecordingWriter writer_;
  Lane image_, calibration_, transforms_, scene_, annotations_, ecg_, worth_;
};

}  // namespace perimap

// Received samples into a recording.
#pragma once

#include <perimap.h>
#include <perimap_mesh.h>
#include <perimap_tool.h>

#include <filesystem>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/file/whole_file.hpp"
#include "drivers/recording/recording_writer.hpp"

namespace perimap {

// Log time is the receipt, publish time the sample's own: release_time_ns of a surface and of a tool's distance,
// time_ns of the others. The file has its name when finish() has succeeded.
class SampleRecorder {
 public:
  // What becomes of a file that could not be finished: what a replay gives can be had again, what was received cannot.
  enum class Unfinished { kRemoved, kKept };

  // `generator` names the program and its version in the recording.
  [[nodiscard]] static Expected<SampleRecorder> create(const std::filesystem::path& file, std::string generator,
                                                       Unfinished unfinished = Unfinished::kRemoved);

  [[nodiscard]] Expected<void> write(const perimap_Surface& surface, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_SurfaceModel& model, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_SurfaceMesh& mesh, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_ToolDistance& distance, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_Phase& phase, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_Status& status, Instant receipt);
  // An error says where what was kept is.
  [[nodiscard]] Expected<void> finish();

 private:
  SampleRecorder(WholeFile file, RecordingWriter writer, std::string generator, Unfinished unfinished)
      : file_(std::move(file)), writer_(std::move(writer)), generator_(std::move(generator)), unfinished_(unfinished) {}

  // The facts of the recording, known with the first surface.
  [[nodiscard]] Expected<void> write_info(const perimap_Surface& surface, Instant receipt);

  WholeFile file_;  // goes after what writes to it
  RecordingWriter writer_;
  std::string generator_;
  Unfinished unfinished_;
  bool info_written_ = false;
  ChannelId info_;
  ChannelId surface_;
  ChannelId model_;
  ChannelId mesh_;
  std::optional<ChannelId> tool_;  // from the first distance on
  ChannelId phase_;
  ChannelId status_;
};

}  // namespace perimap

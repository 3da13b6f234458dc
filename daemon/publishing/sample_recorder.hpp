// Writes what is published into a recording, off the publisher thread.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "daemon/publishing/publication.hpp"
#include "drivers/recording/recording_writer.hpp"

namespace perimap {

// surface() copies into a free one of a fixed set of buffers; drain() writes them and belongs, like the other
// topics, to the status thread. Status messages are not recorded: they tell of the machine, not of the heart, and would
// differ from run to run.
class SampleRecorder final : public Publication {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<SampleRecorder>> create(const std::string& path,
                                                                        std::size_t maximum_features);

  void surface(const perimap_Surface& sample) override;
  void surface_model(const perimap_SurfaceModel& model) override;
  void phase(const perimap_Phase& phase) override;
  void status(const perimap_Status& /*status*/) override {}

  // Writes the surfaces taken so far.
  void drain();

  // Writes the rest and ends the file. An error of this or any earlier write, or samples that found no free buffer.
  [[nodiscard]] Expected<void> finish();

 private:
  struct Buffer {
    perimap_Surface sample{};
    std::vector<perimap_SurfaceFeature> features;
  };

  SampleRecorder(RecordingWriter writer, ChannelId surface, ChannelId model, ChannelId phase,
                 std::size_t maximum_features);
  void keep_first_error(const Expected<void>& written);

  RecordingWriter writer_;
  ChannelId surface_;
  ChannelId model_;
  ChannelId phase_;
  std::vector<Buffer> buffers_;
  SpscRing<std::size_t> free_;
  SpscRing<std::size_t> filled_;
  std::uint64_t not_recorded_ = 0;  // the publisher's own; read after it has ended
  Expected<void> first_error_;
};

}  // namespace perimap

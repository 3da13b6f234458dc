// Writes what is published into a recording, off the publisher thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/sample_recorder.hpp"

namespace perimap {

// surface() copies into a free one of a fixed set of buffers, tool() into a queue; the other topics and drain() belong
// to the status thread and write. In virtual time one thread calls all, and surface() and tool() write what was before.
// Status messages are not recorded: they tell of the machine, not of the heart, and would differ from run to run of the
// same recording.
class PublicationRecorder final : public Publication {
 public:
  // `generator` names the program and its version in the recording. In virtual time the receipt is the release itself;
  // otherwise it is the instant at which surface() is called.
  [[nodiscard]] static Expected<std::unique_ptr<PublicationRecorder>> create(const std::string& path,
                                                                             std::string generator, bool virtual_time,
                                                                             std::size_t maximum_features);

  void surface(const perimap_Surface& sample) override;
  void surface_model(const perimap_SurfaceModel& model) override;
  void surface_mesh(const perimap_SurfaceMesh& mesh) override;
  void tool(const perimap_ToolDistance& distance) override;
  void phase(const perimap_Phase& phase) override;
  void status(const perimap_Status& /*status*/) override { drain(); }

  // Writes the surfaces and distances taken so far.
  void drain();

  // Writes the rest and ends the file. An error of this or any earlier write, or samples that found no free buffer.
  [[nodiscard]] Expected<void> finish();

 private:
  struct Buffer {
    Instant receipt;
    perimap_Surface sample{};
    std::vector<perimap_SurfaceFeature> features;
  };

  struct ToldTool {
    Instant receipt;
    perimap_ToolDistance sample{};
  };

  PublicationRecorder(SampleRecorder recorder, bool virtual_time, std::size_t maximum_features);
  void keep_first_error(const Expected<void>& written);

  SampleRecorder recorder_;
  bool virtual_time_;
  std::vector<Buffer> buffers_;
  SpscRing<std::size_t> free_;
  SpscRing<std::size_t> filled_;
  SpscRing<ToldTool> tools_;
  std::uint64_t not_recorded_ = 0;        // the publisher's own; read after it has ended
  std::uint64_t tools_not_recorded_ = 0;  // likewise, of the thread that tells of tools
  Expected<void> first_error_;
};

}  // namespace perimap

#include "daemon/publishing/sample_recorder.hpp"

#include <utility>

#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

std::uint32_t short_sequence(std::uint64_t sequence) { return static_cast<std::uint32_t>(sequence); }

}  // namespace

Expected<SampleRecorder> SampleRecorder::create(const std::filesystem::path& file, std::string generator,
                                                Unfinished unfinished) {
  auto whole = WholeFile::create(file, WholeFile::Name::kPart, WholeFile::Readers::kOwner);
  if (!whole) return tl::unexpected(whole.error());
  auto sink = create_file(whole->path().string(), file.string());
  if (!sink) return tl::unexpected(sink.error());
  auto writer = RecordingWriter::create(std::move(*sink));
  if (!writer) return tl::unexpected(writer.error());
  SampleRecorder recorder(std::move(*whole), std::move(*writer), std::move(generator), unfinished);
  const auto keep = [](ChannelId& place) { return [&place](ChannelId id) { place = id; }; };
  const Expected<void> results[] = {
      recorder.writer_.add_channel<perimap_RecordingInfo>(channels::kRecordingInfo).map(keep(recorder.info_)),
      recorder.writer_.add_channel<perimap_Surface>(channels::kSurface).map(keep(recorder.surface_)),
      recorder.writer_.add_channel<perimap_SurfaceModel>(channels::kSurfaceModel).map(keep(recorder.model_)),
      recorder.writer_.add_channel<perimap_SurfaceMesh>(channels::kSurfaceMesh).map(keep(recorder.mesh_)),
      recorder.writer_.add_channel<perimap_Phase>(channels::kPhase).map(keep(recorder.phase_)),
      recorder.writer_.add_channel<perimap_Status>(channels::kStatus).map(keep(recorder.status_))};
  for (const Expected<void>& result : results) {
    if (!result) {
      return tl::unexpected(result.error());
    }
  }
  return recorder;
}

Expected<void> SampleRecorder::write_info(const perimap_Surface& surface, Instant receipt) {
  std::string description = "published samples";
  std::string world_frame = surface.frame_id;
  perimap_RecordingInfo info{};
  info.generator = generator_.data();
  info.description = description.data();
  info.utc_minus_monotonic_ns = surface.release_utc_ns - surface.release_time_ns;
  info.world_frame_id = world_frame.data();
  return writer_.write(info_, info, receipt, receipt, 0);
}

Expected<void> SampleRecorder::finish() {
  auto done = writer_.finish().and_then([this] { return file_.finish(); });
  if (done || unfinished_ == Unfinished::kRemoved) return done;
  file_.keep_unfinished();
  return fail(done.error().message + "; what came before is in " + file_.path().string());
}

Expected<void> SampleRecorder::write(const perimap_Surface& surface, Instant receipt) {
  if (!std::exchange(info_written_, true)) {
    if (auto written = write_info(surface, receipt); !written) {
      return written;
    }
  }
  return writer_.write(surface_, surface, receipt, from_ns(surface.release_time_ns),
                       short_sequence(surface.sample_sequence));
}

Expected<void> SampleRecorder::write(const perimap_SurfaceModel& model, Instant receipt) {
  return writer_.write(model_, model, receipt, from_ns(model.time_ns), short_sequence(model.sample_sequence));
}

Expected<void> SampleRecorder::write(const perimap_SurfaceMesh& mesh, Instant receipt) {
  return writer_.write(mesh_, mesh, receipt, from_ns(mesh.time_ns), short_sequence(mesh.sample_sequence));
}

Expected<void> SampleRecorder::write(const perimap_ToolDistance& distance, Instant receipt) {
  if (!tool_) {
    auto added = writer_.add_channel<perimap_ToolDistance>(channels::kTool);
    if (!added) return tl::unexpected(added.error());
    tool_ = *added;
  }
  return writer_.write(*tool_, distance, receipt, from_ns(distance.release_time_ns),
                       short_sequence(distance.sample_sequence));
}

Expected<void> SampleRecorder::write(const perimap_Phase& phase, Instant receipt) {
  return writer_.write(phase_, phase, receipt, from_ns(phase.time_ns), short_sequence(phase.sample_sequence));
}

Expected<void> SampleRecorder::write(const perimap_Status& status, Instant receipt) {
  return writer_.write(status_, status, receipt, from_ns(status.time_ns), short_sequence(status.sample_sequence));
}

}  // namespace perimap

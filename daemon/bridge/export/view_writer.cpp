#include "daemon/bridge/export/view_writer.hpp"

#include <utility>

#include "daemon/bridge/messages/view_names.hpp"

namespace perimap {

Expected<ViewWriter> ViewWriter::create(const std::string& file, const std::string& generator) {
  auto whole = WholeFile::create(file, WholeFile::Name::kPart, WholeFile::Readers::kOwner);
  if (!whole) return tl::unexpected(whole.error());
  auto sink = create_file(whole->path().string(), file);
  if (!sink) return tl::unexpected(sink.error());
  McapWriterOptions options;
  options.library = generator;
  auto writer = RecordingWriter::create(std::move(*sink), options);
  if (!writer) return tl::unexpected(writer.error());
  return ViewWriter(std::move(*whole), std::move(*writer));
}

template <class T>
Expected<void> ViewWriter::put(Lane& lane, const char* topic, const T& message, Instant utc) {
  if (!lane.id) {
    const auto added = writer_.add_channel<T>(topic);
    if (!added) return tl::unexpected(added.error());
    lane.id = *added;
  }
  return writer_.write(*lane.id, message, utc, utc, lane.sequence++);
}

Expected<void> ViewWriter::write(const foxglove_RawImage& image, Instant utc) {
  return put(image_, view_names::kImage, image, utc);
}
Expected<void> ViewWriter::write(const foxglove_CompressedImage& image, Instant utc) {
  return put(image_, view_names::kImage, image, utc);
}
Expected<void> ViewWriter::write(const foxglove_CameraCalibration& calibration, Instant utc) {
  return put(calibration_, view_names::kCalibration, calibration, utc);
}
Expected<void> ViewWriter::write(const foxglove_FrameTransform& transform, Instant utc) {
  return put(transforms_, view_names::kTransforms, transform, utc);
}
Expected<void> ViewWriter::write(const foxglove_SceneUpdate& scene, Instant utc) {
  return put(scene_, view_names::kScene, scene, utc);
}
Expected<void> ViewWriter::write(const foxglove_ImageAnnotations& annotations, Instant utc) {
  return put(annotations_, view_names::kAnnotations, annotations, utc);
}
Expected<void> ViewWriter::write(const perimap_view_EcgValue& value, Instant utc) {
  return put(ecg_, view_names::kEcg, value, utc);
}
Expected<void> ViewWriter::write(const perimap_view_SurfaceWorth& worth, Instant utc) {
  return put(worth_, view_names::kWorth, worth, utc);
}

Expected<void> ViewWriter::finish() {
  return writer_.finish().and_then([this] { return file_.finish(); });
}

}  // namespace perimap

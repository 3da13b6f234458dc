#include "daemon/publishing/publication_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kBuffers = 1024;  // of the fastest clock and as fast a camera, half a second
constexpr std::size_t kTools = 4096;    // eight tools, likewise

}  // namespace

Expected<std::unique_ptr<PublicationRecorder>> PublicationRecorder::create(const std::string& path,
                                                                           std::string generator, bool virtual_time,
                                                                           std::size_t maximum_features) {
  auto recorder = SampleRecorder::create(path, std::move(generator));
  if (!recorder) return tl::unexpected(recorder.error());
  return std::unique_ptr<PublicationRecorder>(
      new PublicationRecorder(std::move(*recorder), virtual_time, maximum_features));
}

PublicationRecorder::PublicationRecorder(SampleRecorder recorder, bool virtual_time, std::size_t maximum_features)
    : recorder_(std::move(recorder)),
      virtual_time_(virtual_time),
      buffers_(kBuffers),
      free_(kBuffers),
      filled_(kBuffers),
      tools_(kTools) {
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    buffers_[i].features.resize(maximum_features);
    static_cast<void>(free_.push(i));
  }
}

void PublicationRecorder::surface(const perimap_Surface& sample) {
  std::size_t i = 0;
  // In virtual time there is one thread for all, and nothing to be late for.
  if (virtual_time_) drain();
  if (!free_.pop(i)) {
    ++not_recorded_;
    return;
  }
  Buffer& buffer = buffers_[i];
  buffer.receipt = virtual_time_ ? from_ns(sample.release_time_ns) : MonotonicClock::now();
  buffer.sample = sample;
  std::copy_n(sample.features._buffer, sample.features._length, buffer.features.begin());
  buffer.sample.features._buffer = buffer.features.data();
  static_cast<void>(filled_.push(i));
}

void PublicationRecorder::surface_model(const perimap_SurfaceModel& model) {
  drain();
  keep_first_error(recorder_.write(model, from_ns(model.time_ns)));
}

void PublicationRecorder::surface_mesh(const perimap_SurfaceMesh& mesh) {
  drain();
  keep_first_error(recorder_.write(mesh, from_ns(mesh.time_ns)));
}

void PublicationRecorder::tool(const perimap_ToolDistance& distance) {
  if (virtual_time_) drain();
  const Instant receipt = virtual_time_ ? from_ns(distance.release_time_ns) : MonotonicClock::now();
  if (!tools_.push({receipt, distance})) ++tools_not_recorded_;
}

void PublicationRecorder::phase(const perimap_Phase& phase) {
  drain();
  keep_first_error(recorder_.write(phase, from_ns(phase.time_ns)));
}

void PublicationRecorder::drain() {
  std::size_t i = 0;
  while (filled_.pop(i)) {
    const perimap_Surface& sample = buffers_[i].sample;
    keep_first_error(recorder_.write(sample, buffers_[i].receipt));
    static_cast<void>(free_.push(i));
  }
  ToldTool told;
  while (tools_.pop(told)) keep_first_error(recorder_.write(told.sample, told.receipt));
}

Expected<void> PublicationRecorder::finish() {
  drain();
  keep_first_error(recorder_.finish());
  if (!first_error_) return first_error_;
  if (const std::uint64_t lost = not_recorded_ + tools_not_recorded_; lost > 0) {
    return fail(fmt::format("{} samples were published but not recorded", lost));
  }
  return {};
}

void PublicationRecorder::keep_first_error(const Expected<void>& written) {
  if (first_error_ && !written) first_error_ = written;
}

}  // namespace perimap

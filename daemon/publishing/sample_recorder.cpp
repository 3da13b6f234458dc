#include "daemon/publishing/sample_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

constexpr std::size_t kBuffers = 256;  // over two seconds at 100 samples/s

}  // namespace

Expected<std::unique_ptr<SampleRecorder>> SampleRecorder::create(const std::string& path,
                                                                 std::size_t maximum_features) {
  auto writer = RecordingWriter::create(path);
  if (!writer) return tl::unexpected(writer.error());
  const auto surface = writer->add_channel<perimap_Surface>(channels::kSurface);
  if (!surface) return tl::unexpected(surface.error());
  const auto model = writer->add_channel<perimap_SurfaceModel>(channels::kSurfaceModel);
  if (!model) return tl::unexpected(model.error());
  const auto phase = writer->add_channel<perimap_Phase>(channels::kPhase);
  if (!phase) return tl::unexpected(phase.error());
  return std::unique_ptr<SampleRecorder>(
      new SampleRecorder(std::move(*writer), *surface, *model, *phase, maximum_features));
}

SampleRecorder::SampleRecorder(RecordingWriter writer, ChannelId surface, ChannelId model, ChannelId phase,
                               std::size_t maximum_features)
    : writer_(std::move(writer)),
      surface_(surface),
      model_(model),
      phase_(phase),
      buffers_(kBuffers),
      free_(kBuffers),
      filled_(kBuffers) {
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    buffers_[i].features.resize(maximum_features);
    static_cast<void>(free_.push(i));
  }
}

void SampleRecorder::surface(const perimap_Surface& sample) {
  std::size_t i = 0;
  if (!free_.pop(i)) {
    ++not_recorded_;
    return;
  }
  Buffer& buffer = buffers_[i];
  buffer.sample = sample;
  std::copy_n(sample.features._buffer, sample.features._length, buffer.features.begin());
  buffer.sample.features._buffer = buffer.features.data();
  static_cast<void>(filled_.push(i));
}

void SampleRecorder::surface_model(const perimap_SurfaceModel& model) {
  drain();
  const Instant time = from_ns(model.time_ns);
  keep_first_error(writer_.write(model_, model, time, time, static_cast<std::uint32_t>(model.sample_sequence)));
}

void SampleRecorder::phase(const perimap_Phase& phase) {
  drain();
  const Instant time = from_ns(phase.time_ns);
  keep_first_error(writer_.write(phase_, phase, time, time, static_cast<std::uint32_t>(phase.sample_sequence)));
}

void SampleRecorder::drain() {
  std::size_t i = 0;
  while (filled_.pop(i)) {
    const perimap_Surface& sample = buffers_[i].sample;
    keep_first_error(writer_.write(surface_, sample, from_ns(sample.release_time_ns), from_ns(sample.capture_time_ns),
                                   static_cast<std::uint32_t>(sample.sample_sequence)));
    static_cast<void>(free_.push(i));
  }
}

Expected<void> SampleRecorder::finish() {
  drain();
  keep_first_error(writer_.finish());
  if (!first_error_) return first_error_;
  if (not_recorded_ > 0) return fail(fmt::format("{} samples were published but not recorded", not_recorded_));
  return {};
}

void SampleRecorder::keep_first_error(const Expected<void>& written) {
  if (first_error_ && !written) first_error_ = written;
}

}  // namespace perimap

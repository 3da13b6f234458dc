#include "daemon/black_box/samples_to_recording.hpp"

#include <span>

#include "core/time/instant.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap::black_box {

Expected<SamplesToRecording> SamplesToRecording::create(const std::filesystem::path& file, std::string generator) {
  auto recorder = SampleRecorder::create(file, std::move(generator));
  if (!recorder) return tl::unexpected(std::move(recorder.error()));
  return SamplesToRecording(std::move(*recorder));
}

template <class T>
void SamplesToRecording::write(const Entry& entry) {
  const auto sample = deserialize<T>(std::as_bytes(std::span(entry.content.data(), entry.content.size())));
  Expected<void> written = sample ? recorder_.write(**sample, from_ns(entry.at.monotonic_ns))
                                  : Expected<void>(tl::unexpected(sample.error()));
  if (first_error_ && !written) first_error_ = std::move(written);
}

void SamplesToRecording::take(const Entry& entry) {
  if (entry.kind == EntryKind::kSurface) write<perimap_Surface>(entry);
  if (entry.kind == EntryKind::kPhase) write<perimap_Phase>(entry);
  if (entry.kind == EntryKind::kStatus) write<perimap_Status>(entry);
}

Expected<void> SamplesToRecording::finish() {
  auto finished = recorder_.finish();
  return first_error_ ? finished : first_error_;
}

}  // namespace perimap::black_box

#include "drivers/emulator/ecg_waveform.hpp"

#include <cmath>

#include "drivers/simulator/ecg_record.hpp"

namespace perimap {

Expected<EcgWaveform> EcgWaveform::of_record(std::string_view name, Instant start) {
  auto record = load_ecg_record(name);
  if (!record) return tl::unexpected(std::move(record.error()));
  std::vector<float> mV;
  mV.reserve(record->samples.size());
  for (const std::int16_t counts : record->samples)
    mV.push_back(static_cast<float>(counts / EcgRecord::kCounts_per_mV));
  return EcgWaveform(start, EcgRecord::kSampleRate_hz, std::move(mV), true);
}

std::optional<float> EcgWaveform::at(Instant t) const noexcept {
  double index = to_seconds(t - start_) * sample_rate_hz_;
  const auto size = static_cast<double>(mV_.size());
  if (index < 0.0 || mV_.empty() || (!repeated_ && index > size - 1.0)) return std::nullopt;
  index = std::fmod(index, size);
  const auto left = static_cast<std::size_t>(index);
  const std::size_t right = left + 1 < mV_.size() ? left + 1 : repeated_ ? 0 : left;
  const double part = index - static_cast<double>(left);
  return static_cast<float>((1.0 - part) * mV_[left] + part * mV_[right]);
}

}  // namespace perimap

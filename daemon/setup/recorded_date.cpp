#include "daemon/setup/recorded_date.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <ctime>
#include <optional>
#include <string_view>

#include "core/time/instant.hpp"
#include "daemon/setup/kept_result.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

// None: it does not say.
std::optional<std::time_t> begin_of(const std::string& recording) {
  auto reader = RecordingReader::open(recording);
  if (!reader) return std::nullopt;
  const auto channels = reader->channels();
  const bool has_info = std::any_of(channels.begin(), channels.end(),
                                    [](const RecordedChannel& c) { return c.name == channels::kRecordingInfo; });
  if (!has_info) return std::nullopt;
  constexpr std::array<std::string_view, 1> kWanted = {channels::kRecordingInfo};
  if (!reader->select(kWanted)) return std::nullopt;
  const auto message = reader->next();
  if (!message || !*message) return std::nullopt;
  const auto info = reader->decode<perimap_RecordingInfo>(**message);
  if (!info || (*info)->utc_minus_monotonic_ns <= 0) return std::nullopt;
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::int64_t utc_s = to_ns((**message).arrival) / kSecond_ns + (*info)->utc_minus_monotonic_ns / kSecond_ns;
  constexpr std::int64_t kBeforeAny_s = 946'684'800;  // of the year 2000
  return utc_s < kBeforeAny_s ? std::nullopt : std::optional<std::time_t>(utc_s);
}

}  // namespace

std::string date_of_measurement(const std::string& recording) {
  if (recording.empty()) return date_now();
  if (const auto begin = begin_of(recording)) return date_text_of(*begin);
  return date_now() + " (worked out; the recording has no date)";
}

}  // namespace perimap

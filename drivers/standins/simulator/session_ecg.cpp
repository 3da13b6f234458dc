#include "drivers/standins/simulator/session_ecg.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/made_ecg.hpp"
#include "drivers/standins/simulator/played_trace.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kSessionStream = 1;  // as of the session's start (simulation.cpp)
constexpr std::size_t kBeatsBefore = 8;
constexpr std::size_t kBeatsAfter = 3;

// The record's sample at which the session starts.
Expected<std::uint32_t> start_sample(const SimulationSettings& s, const EcgRecord& record) {
  const auto samples = [&](Duration d) { return to_seconds(d) * record.sample_rate_hz; };
  const double first = record.beat_samples[kBeatsBefore];
  double last = record.beat_samples[record.beat_samples.size() - 1 - kBeatsAfter] - samples(s.duration);
  if (!s.procedure.empty()) last = std::max(last, first);  // it begins anew
  if (last < first)
    return fail(fmt::format("duration: ECG record {} holds no {} s", record.name, to_seconds(s.duration)));
  if (!s.ecg_start) return static_cast<std::uint32_t>(CounterNoise(s.seed, kSessionStream).uniform(0, first, last));
  const double asked = samples(*s.ecg_start);
  if (asked < first || asked > last) {
    return fail(fmt::format("ECG start: {} s is outside {:.1f} to {:.1f} s of record {}", to_seconds(*s.ecg_start),
                            first / record.sample_rate_hz, last / record.sample_rate_hz, record.name));
  }
  return static_cast<std::uint32_t>(asked);
}

// Of a trace, with beats enough before and after the session.
Expected<EcgScript> traced_ecg(const SimulationSettings& s) {
  constexpr double kBefore_s = 20.0, kAfter_s = 10.0;
  const auto played = PlayedTrace::create(s.trace, s.seed);
  if (!played) return tl::unexpected(played.error());
  std::vector<double> beats_s = played->beats_s(kBefore_s, to_seconds(s.duration) + kAfter_s);
  const auto before = std::count_if(beats_s.begin(), beats_s.end(), [](double beat_s) { return beat_s < 0.0; });
  const auto after =
      std::count_if(beats_s.begin(), beats_s.end(), [&](double beat_s) { return beat_s > to_seconds(s.duration); });
  if (before <= static_cast<std::ptrdiff_t>(kBeatsBefore) || after <= static_cast<std::ptrdiff_t>(kBeatsAfter)) {
    return fail("motion trace: its heart beats too seldom");
  }
  for (double& beat_s : beats_s) beat_s += kBefore_s;
  EcgRecord record = made_ecg(beats_s, s.seed);
  const auto first_sample = static_cast<std::uint32_t>(kBefore_s * record.sample_rate_hz);
  if (s.procedure.empty()) return EcgScript::plain(std::move(record), first_sample);
  return EcgScript::with_runs(std::move(record), first_sample, s.procedure, s.duration, s.seed);
}

}  // namespace

Expected<EcgScript> session_ecg(const SimulationSettings& s) {
  if (s.trace) return traced_ecg(s);
  auto record = load_ecg_record(s.ecg_record);
  if (!record) return tl::unexpected(record.error());
  const auto first_sample = start_sample(s, *record);
  if (!first_sample) return tl::unexpected(first_sample.error());
  if (s.procedure.empty()) return EcgScript::plain(*std::move(record), *first_sample);
  return EcgScript::with_runs(*std::move(record), *first_sample, s.procedure, s.duration, s.seed);
}

std::vector<Instant> r_peaks_of(const EcgScript& script, Instant start, Duration duration) {
  std::vector<Instant> r_peaks;
  for (const std::int64_t beat : script.beats()) r_peaks.push_back(script.time_of(start, beat));
  const auto after_start = std::upper_bound(r_peaks.begin(), r_peaks.end(), start);
  const auto after_end = std::upper_bound(after_start, r_peaks.end(), start + duration);
  r_peaks.erase(after_end + kBeatsAfter, r_peaks.end());
  r_peaks.erase(r_peaks.begin(), after_start - kBeatsBefore);
  return r_peaks;
}

}  // namespace perimap

#include "daemon/evaluation/tool/tool_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>

#include "daemon/evaluation/json/json_number.hpp"
#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

constexpr std::int64_t kMap_ns = 15'000'000'000;   // until then a map is made
constexpr std::int64_t kBelongs_ns = 500'000'000;  // what is said so long before or after a touch is said of it
constexpr double kNear_mm = 5.0;
constexpr double kAway_mm = 2.0;

class Errors {
 public:
  void add(double error_mm, double deviation_mm) {
    errors_mm_.push_back(std::abs(error_mm));
    squares_ += error_mm * error_mm;
    nees_ += error_mm * error_mm / (deviation_mm * deviation_mm);
  }
  [[nodiscard]] ToolFigures::Errors figures() {
    const auto n = static_cast<double>(errors_mm_.size());
    if (errors_mm_.empty()) return {};
    constexpr double kMost = 0.95;
    const auto p95 = errors_mm_.begin() + static_cast<std::ptrdiff_t>(kMost * (n - 1.0));
    std::nth_element(errors_mm_.begin(), p95, errors_mm_.end());
    return {errors_mm_.size(), std::sqrt(squares_ / n), *p95, nees_ / n};
  }

 private:
  std::vector<double> errors_mm_;
  double squares_ = 0.0, nees_ = 0.0;
};

std::optional<double> share(std::size_t part, std::size_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

std::string plain(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

nlohmann::json number(const std::optional<double>& value) { return value ? json_number(*value) : nlohmann::json(); }

bool usable(const perimap_ToolDistance& sample) {
  return sample.state == perimap_TOOL_GOOD || sample.state == perimap_TOOL_DEGRADED;
}

nlohmann::json errors_json(const ToolFigures::Errors& errors) {
  return {{"samples", errors.samples},
          {"rms_mm", number(errors.rms_mm)},
          {"p95_mm", number(errors.p95_mm)},
          {"nees", number(errors.nees)}};
}

}  // namespace

Expected<ToolTruths> load_tool_truths(const std::string& recording, ReadMode mode) {
  auto reader = RecordingReader::open(recording, mode);
  if (!reader) return tl::unexpected(reader.error());
  std::vector<std::string> names;
  for (const RecordedChannel& channel : reader->channels()) {
    if (channel.name.starts_with(channels::kTruthTool)) names.push_back(channel.name);
  }
  ToolTruths truths;
  if (names.empty()) return truths;
  const std::vector<std::string_view> wanted(names.begin(), names.end());
  if (auto selected = reader->select(wanted); !selected) return tl::unexpected(selected.error());
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) return truths;
    const auto truth = reader->decode<perimap_TruthTool>(**message);
    if (!truth) return tl::unexpected(truth.error());
    auto& of_tool = truths[std::string((*message)->channel.substr(channels::kTruthTool.size()))];
    if (!of_tool.empty() && (*truth)->time_ns <= of_tool.back().time_ns) {
      return reader->wrong(**message, "its time is not after that of the one before");
    }
    of_tool.push_back(**truth);
  }
}

std::optional<ToolTally::Truth> ToolTally::truth_at(std::int64_t t_ns) const {
  const auto after = std::lower_bound(truth_.begin(), truth_.end(), t_ns,
                                      [](const perimap_TruthTool& truth, std::int64_t t) { return truth.time_ns < t; });
  if (after == truth_.end() || after == truth_.begin()) return std::nullopt;
  const perimap_TruthTool& before = *std::prev(after);
  const double s = static_cast<double>(t_ns - before.time_ns) / static_cast<double>(after->time_ns - before.time_ns);
  return Truth{(1.0 - s) * before.distance_mm + s * after->distance_mm, before.touches && after->touches};
}

ToolFigures ToolTally::figures() const {
  ToolFigures figures;
  if (truth_.empty()) return figures;
  const std::int64_t from_ns = truth_.front().time_ns + kMap_ns;
  std::array<Errors, kToolHorizons.size()> horizons;
  Errors near;
  for (const perimap_ToolDistance& sample : samples_) {
    if (sample.time_ns < from_ns) continue;
    ++figures.samples;
    if (usable(sample)) ++figures.usable;
    for (std::size_t h = 0; h < horizons.size(); ++h) {
      if (sample.states[h] != perimap_TOOL_GOOD && sample.states[h] != perimap_TOOL_DEGRADED) continue;
      const auto truth = truth_at(sample.time_ns + kToolHorizons[h].count());
      if (!truth) continue;
      const double error_mm = sample.distances_mm[h] - truth->distance_mm;
      horizons[h].add(error_mm, sample.deviations_mm[h]);
      if (h == 0 && std::abs(truth->distance_mm) <= kNear_mm) near.add(error_mm, sample.deviations_mm[h]);
    }
  }
  for (std::size_t h = 0; h < horizons.size(); ++h) figures.horizons[h] = horizons[h].figures();
  figures.near = near.figures();
  judge_touches(from_ns, figures);
  return figures;
}

void ToolTally::judge_touches(std::int64_t from_ns, ToolFigures& figures) const {
  std::size_t touching = 0, told = 0, away = 0, wrong = 0;
  std::vector<std::int64_t> said_ns;  // when it was said anew
  bool before = false;
  for (const perimap_ToolDistance& sample : samples_) {
    const auto truth = usable(sample) && sample.time_ns >= from_ns ? truth_at(sample.time_ns) : std::nullopt;
    if (sample.touches && !before) said_ns.push_back(sample.time_ns);
    before = sample.touches;
    if (!truth) continue;
    touching += truth->touches ? 1 : 0;
    told += truth->touches && sample.touches ? 1 : 0;
    away += truth->distance_mm >= kAway_mm ? 1 : 0;
    wrong += truth->distance_mm >= kAway_mm && sample.touches ? 1 : 0;
  }
  figures.told_share = share(told, touching);
  figures.false_share = share(wrong, away);

  const double frame_ns = samples_.size() < 2
                              ? 1.0
                              : static_cast<double>(samples_.back().time_ns - samples_.front().time_ns) /
                                    static_cast<double>(samples_.size() - 1);
  std::vector<double> frames;
  for (std::size_t i = 1; i < truth_.size(); ++i) {
    const std::int64_t began_ns = truth_[i].time_ns;
    if (!truth_[i].touches || truth_[i - 1].touches || began_ns < from_ns) continue;
    // The first sample that could say so.
    const auto first = std::find_if(samples_.begin(), samples_.end(),
                                    [began_ns](const perimap_ToolDistance& s) { return s.time_ns >= began_ns; });
    if (first == samples_.end() || !usable(*first)) continue;
    ++figures.touches;
    const auto nearest = std::min_element(said_ns.begin(), said_ns.end(), [began_ns](std::int64_t a, std::int64_t b) {
      return std::abs(a - began_ns) < std::abs(b - began_ns);
    });
    if (nearest == said_ns.end() || std::abs(*nearest - began_ns) > kBelongs_ns) continue;
    ++figures.touches_told;
    frames.push_back(static_cast<double>(*nearest - began_ns) / frame_ns);
  }
  if (frames.empty()) return;
  std::sort(frames.begin(), frames.end());
  figures.told_frames_median = frames[frames.size() / 2];
  figures.told_frames_worst = std::abs(frames.front()) > std::abs(frames.back()) ? frames.front() : frames.back();
}

nlohmann::json to_json(const ToolFigures& figures) {
  return {{"samples", figures.samples},
          {"usable", figures.usable},
          {"distance_rms_mm", number(figures.horizons[0].rms_mm)},
          {"distance_p95_mm", number(figures.horizons[0].p95_mm)},
          {"nees", number(figures.horizons[0].nees)},
          {"near", errors_json(figures.near)},
          {"ahead_100_ms", errors_json(figures.horizons[1])},
          {"ahead_300_ms", errors_json(figures.horizons[2])},
          {"touches", figures.touches},
          {"touches_told", figures.touches_told},
          {"touch_told_frames", number(figures.told_frames_median)},
          {"touch_told_worst_frames", number(figures.told_frames_worst)},
          {"touch_told_share", number(figures.told_share)},
          {"touch_false_share", number(figures.false_share)}};
}

std::string to_text(const std::string& tool, const ToolFigures& figures) {
  const ToolFigures::Errors& now = figures.horizons[0];
  if (now.samples == 0) {
    return fmt::format("tool        {}: no distance from 15 s on ({} samples)", tool, figures.samples);
  }
  return fmt::format(
      "tool        {}: distance RMS {} mm, 95th percentile {} mm, NEES {} ({} of {} samples from 15 s on)\n"
      "            at 5 mm and nearer RMS {} mm, NEES {}; 100 ms ahead {} mm ({}), 300 ms ahead {} mm ({})\n"
      "            {} of {} touches told, after {} frames (worst {}); {} of the time on the surface, {} of that 2 mm "
      "away",
      tool, plain(now.rms_mm, 3), plain(now.p95_mm, 2), plain(now.nees, 2), figures.usable, figures.samples,
      plain(figures.near.rms_mm, 3), plain(figures.near.nees, 2), plain(figures.horizons[1].rms_mm, 2),
      plain(figures.horizons[1].nees, 2), plain(figures.horizons[2].rms_mm, 2), plain(figures.horizons[2].nees, 2),
      figures.touches_told, figures.touches, plain(figures.told_frames_median, 1), plain(figures.told_frames_worst, 1),
      plain(figures.told_share, 3), plain(figures.false_share, 3));
}

}  // namespace perimap

#include "daemon/evaluation/watch/watch_screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <perimap_client.hpp>
#include <string_view>

#include "core/angle/angle.hpp"
#include "daemon/evaluation/watch/watch_text.hpp"
#include "daemon/publishing/advice.hpp"
#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostSources = 16;  // whatever a status says

std::string upper(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return result;
}

// Names come from outside: nothing of them moves the cursor.
std::string printable(std::string_view text) {
  std::string result(text);
  std::replace_if(
      result.begin(), result.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return result;
}

std::string row(std::string_view what, std::string_view text) { return fmt::format("  {:<12}{}\n", what, text); }

// What may be trusted now.
struct Trust {
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  std::string word;
  std::string_view why;
  std::string_view remedy;
};

Trust trust_of(const StreamReport& report) {
  if (report.received == 0 || !report.last) {
    return {perimap_SURFACE_INVALID, "NOTHING COMES", "no surface has come for a second", ""};
  }
  if (report.hearing != client::Hearing::kUse) {
    return {perimap_SURFACE_INVALID, at_odds(report.hearing) ? "USE NONE" : "LISTENING",
            client::describe(report.hearing), ""};
  }
  if (report.expired == report.received) {
    return {perimap_SURFACE_INVALID, "TOO LATE", "surfaces come after their own validity", ""};
  }
  const SurfaceDigest& last = *report.last;
  if (last.reason == perimap_SURFACE_REASON_NONE) return {last.state, upper(name_of(last.state)), "", ""};
  return {last.state, upper(name_of(last.state)), client::describe(last.reason), remedy_of(last.reason)};
}

std::string trust_text(const StreamReport& report, bool colours) {
  const Trust trust = trust_of(report);
  std::string word = trust.word;
  if (colours) {
    // Black on green, yellow or red: readable with either background, and apart by brightness.
    const int background = trust.state == perimap_SURFACE_GOOD ? 42 : trust.state == perimap_SURFACE_DEGRADED ? 43 : 41;
    word = fmt::format("\x1b[1;30;{}m {} \x1b[0m", background, trust.word);
  }
  std::string text = fmt::format("  {}  {}\n", word, permission_of(trust.state));
  if (!trust.why.empty()) text += row("because", trust.why);
  if (!trust.remedy.empty()) text += row("do", trust.remedy);
  return text;
}

std::string sources(const StatusDigest& status) {
  std::string text = fmt::format("  {:<12}{:<10}{:>9}{:>10}{:>10}{:>10}{:>14}\n", "source", "state", "rate/s", "age ms",
                                 "dropped", "invalid", "delay p99 ms");
  for (std::size_t i = 0; i < std::min(status.sources.size(), kMostSources); ++i) {
    const perimap_SourceStatus& s = status.sources[i];
    const double age_ms =
        1e-6 * (static_cast<double>(status.status.time_ns) - static_cast<double>(s.last_source_time_ns));
    const std::string age = s.last_source_time_ns > 0 ? fmt::format("{:.0f}", age_ms) : "-";
    text += fmt::format("  {:<12}{:<10}{:>9.1f}{:>10}{:>10}{:>10}{:>14.1f}\n", name_of(s.kind), name_of(s.state),
                        s.rate_hz, age, s.dropped, s.invalid, 1e-6 * static_cast<double>(s.delay_p99_ns));
  }
  return text;
}

std::string stream_text(const StreamReport& report, bool colours) {
  std::string text = fmt::format("{} / {}\n\n", printable(report.source), printable(report.stream));
  text += trust_text(report, colours) + "\n";
  if (report.received > 0 && report.last && !at_odds(report.hearing)) {
    const SurfaceDigest& last = *report.last;
    text += row("features", features_text(last));
    if (last.uses) text += row("may", uses_words(*last.uses));
    text += row("heart", fmt::format("phase {:.0f} +- {:.1f} deg, {:.1f}/min", last.cardiac_phase_rad / kDegree,
                                     last.cardiac_phase_deviation_rad / kDegree,
                                     last.cardiac_phase_rate_rad_per_s * kPerMinutePerRadian));
    for (const ToolReport& tool : report.tools) text += row("tool", printable(tool_words(tool.last)));
  }
  text += row("received",
              fmt::format("{:.1f}/s, {} lost, {} after their validity, {} restarts",
                          rate_hz(report, ReportKind::kInterval), report.missing, report.expired, report.restarts));
  text += row("latency", spread_text(report.latency) + " ms, receipt minus capture");
  text += row("late", spread_text(report.lateness) + " ms, receipt minus release");
  text += row("jitter", spread_text(report.jitter) + " ms");
  if (!report.status || report.received == 0) return text;
  const perimap_Status& status = report.status->status;
  text += row("set-up", setup_words(status.setup));
  if (status.recording != perimap_RECORDING_OFF) {
    text += row("recording", status.recording == perimap_RECORDING_ON ? "on" : "STOPPED: perimapd's log says why");
  }
  return text + "\n" + sources(*report.status);
}

}  // namespace

std::string watch_screen(std::span<const StreamReport> reports, const WatchScreenStyle& style) {
  std::string text = style.title + "\n\n";
  for (const StreamReport& report : reports) text += stream_text(report, style.colours) + "\n";
  return text;
}

}  // namespace perimap

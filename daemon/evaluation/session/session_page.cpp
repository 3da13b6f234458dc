#include "daemon/evaluation/session/session_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <perimap_client.hpp>
#include <utility>

#include "daemon/pages/html_page.hpp"
#include "daemon/pages/svg_plot.hpp"
#include "daemon/publishing/advice.hpp"
#include "daemon/publishing/setup_text.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

constexpr double kPlotWidth = 1110.0;
constexpr double kPlotHeight = 230.0;
constexpr std::size_t kMostPoints = 900;  // a plot is as wide in pixels
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct At {
  double at_s = 0.0;
  double value = 0.0;  // not finite: there is none
};

// What is drawn of many values: of each stretch of time the least and the largest, so that what was short is seen. The
// line is interrupted where a value is missing, and where nothing came for `pause_s`.
std::vector<PlotPoint> drawn(const std::vector<At>& values, double length_s, double pause_s) {
  std::vector<PlotPoint> points;
  const double bin_s = length_s / static_cast<double>(kMostPoints);
  for (std::size_t begin = 0; begin < values.size();) {
    double least = values[begin].value, most = least;
    const bool missing = !std::isfinite(least);
    bool broken = missing;
    std::size_t end = begin + 1;
    for (; end < values.size() && values[end].at_s < values[begin].at_s + bin_s; ++end) {
      broken = !std::isfinite(values[end].value) || values[end].at_s - values[end - 1].at_s > pause_s;
      if (broken || missing) break;
      least = std::min(least, values[end].value);
      most = std::max(most, values[end].value);
    }
    broken = broken || (end < values.size() && values[end].at_s - values[end - 1].at_s > pause_s);
    const double at_s = values[begin].at_s;
    if (!missing) points.push_back({at_s, least});
    if (most > least) points.push_back({at_s, most});
    if (broken) points.push_back({at_s, kNone});
    begin = end;
  }
  return points;
}

template <class Moment, class Value>
std::vector<At> each(const std::vector<Moment>& moments, Value value) {
  std::vector<At> values;
  values.reserve(moments.size());
  for (const Moment& moment : moments) values.push_back({moment.at_s, value(moment)});
  return values;
}

// Over the whole session, so that plots stand below each other.
std::string svg_over(double length_s, Plot plot) {
  if (length_s > 0.0) plot.x_range = {0.0, length_s};
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n{2}</svg>\n",
      kPlotWidth, kPlotHeight, plot_group(plot, 0.0, 0.0, kPlotWidth, kPlotHeight));
}

std::string row(const std::string& name, const std::string& value) {
  return fmt::format("<tr><td>{}</td><td class=\"words\">{}</td></tr>\n", escaped(name), escaped(value));
}

std::string utc_text(std::int64_t utc_ns) {
  const std::time_t seconds = utc_ns / 1'000'000'000;
  std::tm parts{};
  if (utc_ns <= 0 || gmtime_r(&seconds, &parts) == nullptr) return "not told";
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday,
                     parts.tm_hour, parts.tm_min, parts.tm_sec);
}

std::string verdict_section(const SessionRecord& record) {
  const std::string answer = session_answer(record), verdict = session_verdict(record);
  std::string out = fmt::format("<p class=\"verdict\">{}</p>\n", escaped(answer));
  if (verdict != answer) out += fmt::format("<p class=\"whole\">{}</p>\n", escaped("Of the whole session: " + verdict));
  const std::vector<std::string> concerns = session_concerns(record);
  if (concerns.empty()) return out + "<p>Nothing else is amiss in what was recorded.</p>\n";
  out += "<h2>To be looked at</h2>\n<ul>\n";
  for (const std::string& concern : concerns) out += fmt::format("<li>{}</li>\n", escaped(concern));
  return out + "</ul>\n";
}

// What a reason means, and what to do.
std::string why_words(perimap_SurfaceReason reason) {
  if (reason == perimap_SURFACE_REASON_NONE) return {};
  return fmt::format("{}: {}", client::describe(reason), remedy_of(reason));
}

std::string shares_section(const SessionRecord& record) {
  std::string out =
      "<h2>What surfaces were</h2>\n<table><tr><th>state</th><th>s</th><th>%</th><th>times</th><th>longest, s</th>"
      "<th>from, s</th><th class=\"words\">why, and what helps</th></tr>\n";
  for (const StateShare& share : record.shares) {
    out += fmt::format(
        "<tr><td>{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{}</td><td>{:.2f}</td><td>{:.2f}</td>"
        "<td class=\"words\">{}</td></tr>\n",
        escaped(share.what), share.seconds, record.length_s > 0.0 ? 100.0 * share.seconds / record.length_s : 0.0,
        share.spans, share.longest_s, share.longest_begin_s, escaped(why_words(share.reason)));
  }
  return out + "</table>\n";
}

std::string time_section(const SessionRecord& record) {
  return "<h2>Over time</h2>\n" + strips_svg(record.strips, record.length_s);
}

std::string features_section(const SessionRecord& record) {
  const double length = record.length_s;
  const auto line = [length](const std::vector<At>& values, double pause_s, const char* color, const char* label) {
    return PlotLine{drawn(values, length, pause_s), color, 1.5, label};
  };
  Plot counts{"Published features", "s", "features", {}, false, true};
  counts.lines.push_back(
      line(each(record.surfaces, [](const auto& m) { return double(m.converged); }), 0.4, "#1b9e77", "converged"));
  counts.lines.push_back(line(each(record.surfaces, [](const auto& m) { return double(m.others); }), 0.4, "#d95f02",
                              "converging, or inconsistent"));
  Plot deviations{"How uncertain positions are, as perimapd says", "s", "mm", {}, false, true};
  deviations.lines.push_back(line(each(record.surfaces, [](const auto& m) { return m.deviation_mm.value_or(kNone); }),
                                  0.4, "#1f6f8b", "median over the features of the largest standard deviation"));
  std::string out = "<h2>Features</h2>\n" + svg_over(record.length_s, counts) + svg_over(record.length_s, deviations);
  if (record.mesh.empty()) return out;
  Plot mesh{"How far each feature is from what all others make of it", "s", "mm, RMS", {}, false, true};
  mesh.lines.push_back(line(each(record.mesh, [](const auto& m) { return m.leave_one_out_rms_mm; }), 5.0, "#7570b3",
                            "leave-one-out error of the mesh: the smaller, the more features agree"));
  return out + svg_over(record.length_s, mesh);
}

std::string rhythm_section(const SessionRecord& record) {
  if (record.rhythm.empty()) return {};
  std::vector<double> intervals;
  for (const RhythmMoment& moment : record.rhythm) intervals.push_back(moment.interval_s);
  std::sort(intervals.begin(), intervals.end());
  const double median = intervals[intervals.size() / 2];
  Plot plot{"From one R peak to the next", "s", "s", {}, false, false};
  plot.lines.push_back({drawn(each(record.rhythm, [](const auto& m) { return m.interval_s; }), record.length_s, 3.0),
                        "#a6761d", 1.5, ""});
  return fmt::format(
             "<h2>Rhythm</h2>\n<p>{} RR intervals; median {:.3f} s ({:.0f} a minute), shortest {:.3f} s, longest "
             "{:.3f} s.</p>\n",
             intervals.size(), median, 60.0 / median, intervals.front(), intervals.back()) +
         svg_over(record.length_s, plot);
}

std::string milliseconds(Duration duration) { return fmt::format("{:.2f}", 1e3 * to_seconds(duration)); }

std::string spread_row(const char* name, const DurationSpread& spread) {
  return fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", name, milliseconds(spread.p50),
                     milliseconds(spread.p99), milliseconds(spread.max));
}

std::string stage_rows(const std::vector<perimap_StageLatency>& stages) {
  std::string out;
  for (const perimap_StageLatency& stage : stages) {
    std::string name(name_of(stage.kind));
    std::replace(name.begin(), name.end(), '_', ' ');
    out += spread_row(escaped(name).c_str(),
                      {stage.count, Duration(stage.p50_ns), Duration(stage.p99_ns), Duration(stage.max_ns)});
  }
  return out;
}

std::string latency_section(const SessionRecord& record) {
  if (record.virtual_time) {
    return "<h2>Delays</h2>\n<p>Surfaces were made by a replay in virtual time, which has none.</p>\n";
  }
  std::string out = "<h2>Delays, ms</h2>\n<table><tr><th></th><th>median</th><th>99 %</th><th>largest</th></tr>\n";
  out += spread_row("capture to receipt", record.counts.latency);
  out += spread_row("receipt after the release's deadline", record.counts.lateness);
  out += spread_row("jitter of receipts", record.counts.jitter);
  if (record.counts.status) out += stage_rows(record.counts.status->stages);
  out += "</table>\n";
  Plot plot{"Capture to receipt", "s", "ms", {}, false, true};
  plot.lines.push_back(
      {drawn(each(record.surfaces, [](const auto& m) { return m.capture_to_receipt_ms; }), record.length_s, 0.4),
       "#1f6f8b", 1.2, ""});
  return out + svg_over(record.length_s, plot);
}

std::string set_up_section(const SessionRecord& record) {
  std::string out;
  for (const RecordedFile& file : record.files) {
    if (const auto verified = verification_of(file)) {
      out += fmt::format("<p>Verified before it: {}</p>\n", escaped(verified->words));
    }
  }
  if (record.counts.status) {
    out += fmt::format("<p>At the end: {}</p>\n", escaped(setup_words(record.counts.status->status.setup)));
  }
  return out.empty() ? out : "<h2>Set-up</h2>\n" + out;
}

std::string sources_section(const SessionRecord& record) {
  if (!record.counts.status || record.counts.status->sources.empty()) return {};
  std::string out =
      "<h2>Devices</h2>\n<table><tr><th></th><th>at the end</th><th>a second</th><th>received since its "
      "start</th><th>lost</th>"
      "<th>invalid</th><th>delay: median, ms</th><th>99 %</th><th>largest</th></tr>\n";
  for (const perimap_SourceStatus& source : record.counts.status->sources) {
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.1f}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        name_of(source.kind), name_of(source.state), source.rate_hz, source.received, source.dropped, source.invalid,
        milliseconds(Duration(source.delay_p50_ns)), milliseconds(Duration(source.delay_p99_ns)),
        milliseconds(Duration(source.delay_max_ns)));
  }
  return out + "</table>\n";
}

std::string file_section(const RecordedFile& file) {
  std::string out = fmt::format("<h3>{}</h3>\n<table>\n", escaped(file.path));
  if (!file.generator.empty()) out += row("written by", file.generator);
  if (!file.description.empty()) out += row("description", file.description);
  out +=
      "</table>\n<table><tr><th>channel</th><th class=\"words\">type</th><th>messages</th><th>MB</th><th>s</th></tr>\n";
  for (const RecordedFile::Channel& channel : file.channels) {
    out += fmt::format("<tr><td>{}</td><td class=\"words\">{}</td><td>{}</td><td>{:.2f}</td><td>{:.1f}</td></tr>\n",
                       escaped(channel.name), escaped(channel.type), channel.messages,
                       1e-6 * static_cast<double>(channel.bytes),
                       to_seconds(channel.last.time_since_epoch()) - to_seconds(channel.first.time_since_epoch()));
  }
  out += "</table>\n";
  if (!file.configuration.empty()) {
    out += fmt::format("<details><summary>its configuration</summary><pre>{}</pre></details>\n",
                       escaped(file.configuration));
  }
  return out;
}

}  // namespace

std::string session_page(const SessionRecord& record) {
  std::string body =
      "<style>.verdict{font-size:1.5em;max-width:50em}.whole{font-size:1.15em;max-width:65em}"
      "td:first-child{white-space:nowrap}p{max-width:75em}td.words,th.words{text-align:left}ul{max-width:75em}</"
      "style>\n";
  body += "<table>\n" + row("source, stream", record.source + ", " + record.stream) +
          row("begin", utc_text(record.begin_utc_ns));
  if (record.counts.status) body += row("perimapd", record.counts.status->status.version);
  body += "</table>\n";
  body += verdict_section(record);
  body +=
      "<p>Good: positions may be used. Degraded: to be used with care, for the reason that is told. Invalid: no "
      "position may be used. This is what perimapd said of itself, and what a subscriber received: how far positions "
      "were off in fact nobody knows without a truth, and this page does not tell.</p>\n";
  body += time_section(record) + shares_section(record) + features_section(record) + rhythm_section(record) +
          set_up_section(record) + sources_section(record) + latency_section(record);
  body += "<h2>Files</h2>\n";
  for (const RecordedFile& file : record.files) body += file_section(file);
  return html_page("Session", body);
}

}  // namespace perimap

#include "daemon/evaluation/bench/bench_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "daemon/evaluation/bench/table.hpp"
#include "daemon/pages/html_page.hpp"
#include "daemon/pages/svg_plot.hpp"

namespace perimap::bench {
namespace {

using Json = nlohmann::ordered_json;

double us(Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

// Of Figures, and of a LatencyHistogram's Summary.
template <class F>
Json json_of(const F& f) {
  return {
      {"count", f.count}, {"p50_us", us(f.p50)}, {"p99_us", us(f.p99)}, {"p999_us", us(f.p999)}, {"max_us", us(f.max)}};
}

Json with_share(const Figures& f) {
  Json json = json_of(f);
  json["share_within_500_us"] = f.on_time;
  return json;
}

Json json_of_run(const LiveResult& result) {
  const LiveCase& c = result.live_case;
  Json json = {{"part", c.part},
               {"name", c.name},
               {"features_asked", c.features},
               {"workers", c.workers},
               {"priority", c.priority},
               {"cpus", c.cpus},
               {"every_frame", c.every_frame},
               {"speed", c.speed},
               {"subscribers", c.subscribers},
               {"slow_subscriber", c.slow_subscriber},
               {"recording", c.recording},
               {"stress", c.stress},
               {"pages", c.pages}};
  if (!result.not_run.empty()) json["not_run"] = result.not_run;
  const LiveFigures& f = result.figures;
  if (f.sent == 0) return json;
  json["load_before"] = f.load_before;
  json["priority_granted"] = f.priority_granted;
  json["sent"] = f.sent;
  json["rate_hz"] = f.rate_hz;
  json["features"] = f.features;
  json["surface_bytes"] = f.surface_bytes;
  json["missing"] = f.missing;
  if (c.slow_subscriber) json["missing_at_slow"] = f.missing_at_slow;
  json["release_tardiness"] = with_share(f.tardiness);
  json["bare_loop"] = with_share(f.bare);
  json["dds_write"] = json_of(f.dds_write);
  json["capture_to_release"] = json_of(f.capture_to_release);
  json["capture_to_receipt"] = json_of(f.capture_to_receipt);
  json["write_to_receipt"] = json_of(f.write_to_receipt);
  for (const StageFigures& stage : f.stages) json["stages"][stage.name] = json_of(stage.summary);
  json["frames_dropped"] = f.frames_dropped;
  json["frames_too_late"] = f.frames_too_late;
  json["without_frame"] = f.without_frame;
  json["from_late_update"] = f.from_late_update;
  json["releases_missed"] = f.releases_missed;
  json["releases_late"] = f.releases_late;
  json["learning_put_off"] = f.learning_put_off;
  json["frames_not_recorded"] = f.frames_not_recorded;
  if (c.pages > 0) json["pages_open"] = f.pages_open;
  return json;
}

std::string name_of(const LiveCase& c) { return c.part + ": " + c.name; }
std::string share(double value) { return fmt::format("{:.2f} %", 100.0 * value); }
std::string in_us(Duration d) { return fmt::format("{:.1f}", us(d)); }
std::string in_ms(Duration d) { return fmt::format("{:.2f}", us(d) / 1e3); }

std::string ratio(double a, double b) { return b > 0.0 ? fmt::format("{:.1f}", a / b) : "-"; }

template <class F>
std::vector<std::string> cells(std::string name, const F& f) {
  return {std::move(name), std::to_string(f.count), in_us(f.p50), in_us(f.p99), in_us(f.p999), in_us(f.max)};
}

Table releases_table(const BenchReport& report) {
  Table table;
  table.title = "Releases";
  table.note =
      "release: from the deadline to just before the write; bare: of a loop with the same wait, "
      "priority and processor, 2 ms beside the releases; late by more than 0.5 ms counts as not on time.";
  table.head = {"run",   "features", "rate Hz", "release us: p50", "p99",
                "p99.9", "max",      "on time", "bare us: p50",    "p99",
                "p99.9", "on time",  "missing", "late updates",    "load before"};
  for (const LiveResult& result : report.live) {
    const LiveFigures& f = result.figures;
    const std::string name = name_of(result.live_case);
    if (f.sent == 0) {
      std::vector<std::string> row(table.head.size(), "-");
      row[0] = name + " (" + (result.not_run.empty() ? "nothing was released" : result.not_run) + ")";
      table.rows.push_back(std::move(row));
      continue;
    }
    table.rows.push_back(
        {name + (result.live_case.priority > 0 && !f.priority_granted ? " (refused)" : "") +
             (result.not_run.empty() ? "" : " (" + result.not_run + ")"),
         fmt::format("{:.0f}", f.features), fmt::format("{:.1f}", f.rate_hz), in_us(f.tardiness.p50),
         in_us(f.tardiness.p99), in_us(f.tardiness.p999), in_us(f.tardiness.max), share(f.tardiness.on_time),
         in_us(f.bare.p50), in_us(f.bare.p99), in_us(f.bare.p999), share(f.bare.on_time),
         result.live_case.slow_subscriber ? fmt::format("{} ({} at the slow)", f.missing, f.missing_at_slow)
                                          : std::to_string(f.missing),
         std::to_string(f.from_late_update), fmt::format("{:.1f}", f.load_before)});
  }
  return table;
}

Table receipt_table(const BenchReport& report) {
  Table table;
  table.title = "Receipt in another process";
  table.head = {"run",
                "bytes",
                "capture to release ms: p50",
                "p99",
                "capture to receipt ms: p50",
                "p99",
                "max",
                "write to receipt us: p50",
                "p99",
                "p99.9",
                "max",
                "dds_write us: p50",
                "p99",
                "max"};
  for (const LiveResult& result : report.live) {
    const LiveFigures& f = result.figures;
    if (f.sent == 0) continue;
    table.rows.push_back({name_of(result.live_case), std::to_string(f.surface_bytes), in_ms(f.capture_to_release.p50),
                          in_ms(f.capture_to_release.p99), in_ms(f.capture_to_receipt.p50),
                          in_ms(f.capture_to_receipt.p99), in_ms(f.capture_to_receipt.max),
                          in_us(f.write_to_receipt.p50), in_us(f.write_to_receipt.p99), in_us(f.write_to_receipt.p999),
                          in_us(f.write_to_receipt.max), in_us(f.dds_write.p50), in_us(f.dds_write.p99),
                          in_us(f.dds_write.max)});
  }
  return table;
}

Table stages_table(const BenchReport& report) {
  Table table;
  table.title = "Stage by stage, us";
  table.note = "Figures of the pipeline's own stages are right to 1/16.";
  table.head = {"run and stage", "count", "p50", "p99", "p99.9", "max"};
  for (const LiveResult& result : report.live) {
    const LiveFigures& f = result.figures;
    if (f.sent == 0) continue;
    const std::string run = name_of(result.live_case) + ", ";
    for (const StageFigures& stage : f.stages) table.rows.push_back(cells(run + stage.name, stage.summary));
    table.rows.push_back(cells(run + "release", f.tardiness));
    table.rows.push_back(cells(run + "dds_write", f.dds_write));
    table.rows.push_back(cells(run + "write to receipt", f.write_to_receipt));
  }
  return table;
}

Table ddsperf_table(const BenchReport& report) {
  Table table;
  table.title = "ddsperf, one way, us";
  table.note =
      "Half of the way there and back, best effort, on wait sets, normal scheduling, after the run that it is named "
      "after; ours: write to receipt of that run, median. Percentiles are medians of those of each second.";
  table.head = {"after", "bytes", "count", "p50", "p99", "max", "ours / ddsperf's p50"};
  for (const DdsperfResult& one : report.ddsperf) {
    if (!one.not_run.empty()) {
      table.rows.push_back({one.beside + " (" + one.not_run + ")", std::to_string(one.bytes), "-", "-", "-", "-", "-"});
      continue;
    }
    const auto run = std::find_if(report.live.begin(), report.live.end(), [&](const LiveResult& result) {
      return result.live_case.part == "live" && result.live_case.name == one.beside;
    });
    table.rows.push_back({one.beside, std::to_string(one.bytes), std::to_string(one.count),
                          fmt::format("{:.1f}", one.p50_us), fmt::format("{:.1f}", one.p99_us),
                          fmt::format("{:.1f}", one.max_us),
                          run == report.live.end() ? "-" : ratio(us(run->figures.write_to_receipt.p50), one.p50_us)});
  }
  return table;
}

Table cost_table(const BenchReport& report) {
  Table table;
  table.title = "Computing of a frame in lockstep, one worker, ms";
  table.note =
      "A to D as long as it took, others' use of the processor included; processor: time of all threads, finding and "
      "starting features included. More than the configuration's features stand closer together.";
  table.head = {"features asked for", "mapped", "frames", "A to D: p50",      "p99", "A: p50", "p99",
                "processor: p50",     "p99",    "max",    "p50, us a feature"};
  for (const CostResult& one : report.cost) {
    table.rows.push_back({std::to_string(one.features_asked), fmt::format("{:.0f}", one.features),
                          std::to_string(one.frames), in_ms(one.compute.p50), in_ms(one.compute.p99),
                          in_ms(one.find.p50), in_ms(one.find.p99), in_ms(one.processor.p50), in_ms(one.processor.p99),
                          in_ms(one.processor.max), ratio(us(one.processor.p50), one.features)});
  }
  return table;
}

Table memory_table(const BenchReport& report) {
  Table table;
  if (!report.memory) return table;
  const MemoryResult& m = *report.memory;
  table.title = "Resident memory in lockstep";
  table.note = fmt::format(
      "{} frames, {} rounds of the recording. At the seam all sources are silent for a second, which their counts "
      "show; "
      "all clocks go on and the map is kept.",
      m.frames, m.rounds);
  table.head = {"frames", "kB", "features mapped"};
  for (const MemoryReading& reading : m.readings) {
    table.rows.push_back(
        {std::to_string(reading.frames), std::to_string(reading.resident_kB), std::to_string(reading.features)});
  }
  return table;
}

std::vector<Table> tables(const BenchReport& report) {
  return {releases_table(report), receipt_table(report), ddsperf_table(report),
          cost_table(report),     memory_table(report),  stages_table(report)};
}

// What grows with the number of features, and what must not grow with time.
std::vector<Plot> plots(const BenchReport& report) {
  std::vector<Plot> all;
  if (!report.cost.empty()) {
    Plot plot{"computing of a frame", "features mapped", "ms", {}, false, true};
    PlotLine median{{}, "#1f6f8b", 1.5, "A to D, median"};
    PlotLine processor{{}, "#b5541c", 1.5, "processor, all threads, median"};
    for (const CostResult& one : report.cost) {
      median.points.push_back({one.features, us(one.compute.p50) / 1e3});
      processor.points.push_back({one.features, us(one.processor.p50) / 1e3});
    }
    plot.lines = {median, processor};
    all.push_back(plot);
  }
  if (report.memory) {
    Plot plot{"resident memory", "frames", "MB", {}, false, true};
    PlotLine line;
    for (const MemoryReading& reading : report.memory->readings) {
      line.points.push_back({static_cast<double>(reading.frames), static_cast<double>(reading.resident_kB) / 1024.0});
    }
    plot.lines = {line};
    all.push_back(plot);
  }
  return all;
}

std::string machine_line(const Machine& m) {
  return fmt::format("{} x {}{}; {}; governor {}; load {:.2f} at the beginning; SCHED_FIFO {}, locked memory {}; {}",
                     m.processors, m.processor, m.virtual_machine ? " (virtual)" : "", m.kernel, m.governor,
                     m.load_1_min, m.realtime_permitted ? "permitted" : "refused",
                     m.memory_lock_permitted ? "permitted" : "refused", m.build);
}

std::string setting_line(const BenchReport& r) {
  return fmt::format("{}; {} UTC; {:.0f} s to settle, {:.0f} s measured a run; {} features asked for, {} workers{}",
                     r.settings.input.recording, r.begun_utc, to_seconds(r.settings.input.settle),
                     to_seconds(r.settings.input.measure), r.settings.features, r.settings.workers,
                     r.stopped ? "; STOPPED EARLY" : "");
}

// What a reader might take the figures for, and must not.
const std::vector<std::string>& not_proven() {
  static const std::vector<std::string> lines = {
      {"A recording stands in for the devices: what drivers, buses and exposure add before a frame arrives is as it "
       "was "
       "when recorded, and reading and unpacking it costs processor time that devices do not."},
      "Capture is the recording's own stamp; an error of that stamp is in no figure.",
      "Loopback on one host: a network between publisher and subscriber adds its own.",
      "Some seconds a run: what comes once an hour, and a maximum, are not shown by them.",
      "What else ran on the machine is known by its load alone.",
      "Nothing here is about how accurate the positions are."};
  return lines;
}

}  // namespace

std::string to_table(const BenchReport& report) {
  std::string out = machine_line(report.machine) + "\n" + setting_line(report) + "\n\n";
  for (const Table& table : tables(report)) out += text_of(table);
  out += "What these figures do not prove:\n";
  for (const std::string& line : not_proven()) out += "- " + line + "\n";
  return out;
}

Json to_json(const BenchReport& report) {
  const Machine& m = report.machine;
  Json json = {{"recording", report.settings.input.recording},
               {"begun_utc", report.begun_utc},
               {"stopped_early", report.stopped},
               {"settle_s", to_seconds(report.settings.input.settle)},
               {"measure_s", to_seconds(report.settings.input.measure)},
               {"machine",
                {{"processor", m.processor},
                 {"processors", m.processors},
                 {"virtual", m.virtual_machine},
                 {"kernel", m.kernel},
                 {"governor", m.governor},
                 {"load_1_min", m.load_1_min},
                 {"realtime_permitted", m.realtime_permitted},
                 {"memory_lock_permitted", m.memory_lock_permitted},
                 {"build", m.build}}},
               {"not_proven", not_proven()}};
  json["live"] = Json::array();
  for (const LiveResult& result : report.live) json["live"].push_back(json_of_run(result));
  json["ddsperf"] = Json::array();
  for (const DdsperfResult& one : report.ddsperf) {
    Json entry = {{"beside", one.beside}, {"bytes", one.bytes}};
    if (one.not_run.empty()) {
      entry.update(Json{{"count", one.count}, {"p50_us", one.p50_us}, {"p99_us", one.p99_us}, {"max_us", one.max_us}});
    } else {
      entry["not_run"] = one.not_run;
    }
    json["ddsperf"].push_back(std::move(entry));
  }
  json["cost"] = Json::array();
  for (const CostResult& one : report.cost) {
    json["cost"].push_back({{"features_asked", one.features_asked},
                            {"features", one.features},
                            {"frames", one.frames},
                            {"processor", json_of(one.processor)},
                            {"compute", json_of(one.compute)},
                            {"find", json_of(one.find)}});
  }
  if (report.memory) {
    Json& memory = json["memory"];
    memory = {{"features_asked", report.memory->features_asked},
              {"frames", report.memory->frames},
              {"rounds", report.memory->rounds}};
    for (const MemoryReading& reading : report.memory->readings) {
      memory["readings"].push_back(
          {{"frames", reading.frames}, {"resident_kB", reading.resident_kB}, {"features", reading.features}});
    }
  }
  return json;
}

std::string to_html(const BenchReport& report) {
  std::string out =
      fmt::format("<p>{}</p>\n<p>{}</p>\n", escaped(machine_line(report.machine)), escaped(setting_line(report)));
  for (const Table& table : tables(report)) out += html_of(table);
  if (!report.cost.empty() || report.memory) out += svg_document(plots(report), "");
  out += "<h2>What these figures do not prove</h2>\n<ul>\n";
  for (const std::string& line : not_proven()) out += "<li>" + escaped(line) + "</li>\n";
  return html_page("perimap bench", out + "</ul>\n");
}

}  // namespace perimap::bench

// `perimap watch`: a subscriber in the terminal.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/evaluation/session/session_page.hpp"
#include "daemon/evaluation/watch/sample_receiver.hpp"
#include "daemon/evaluation/watch/watch_report.hpp"
#include "daemon/evaluation/watch/watch_run.hpp"
#include "daemon/evaluation/watch/watch_screen.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/process/stop_signal.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

struct WatchOptions {
  int domain = 0;
  bool json = false;
  bool once = false;
  bool lines = false;
  double duration_s = 0.0;     // 0: no limit
  std::uint64_t surfaces = 0;  // 0: no limit
  double wait_s = 0.0;         // 0: no limit
  std::string recording;
  std::string page;  // of the session, at its end
  std::optional<std::string> security;
};

void print(const std::string& line) {
  fmt::print("{}\n", line);
  (void)std::fflush(stdout);
}

// Who has no keys finds nobody in a secured domain, and is not told so by anyone.
std::string hint(const WatchOptions& options) {
  return options.security ? "" : "; a secured one shows itself to keys alone (--security)";
}

// Whether one screen is drawn anew each second, in the place of a line each.
bool on_screen(const WatchOptions& options) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here writes the environment
  const char* const terminal = std::getenv("TERM");
  return !options.json && !options.lines && isatty(STDOUT_FILENO) == 1 && terminal != nullptr &&
         std::string_view(terminal) != "dumb";
}

void draw(const WatchOptions& options, const std::vector<StreamReport>& reports) {
  constexpr const char* kHome = "\x1b[H";
  constexpr const char* kRestOfLine = "\x1b[K";
  constexpr const char* kRestOfScreen = "\x1b[J";
  constexpr const char* kCutOff = "\x1b[?7l";
  constexpr const char* kWrap = "\x1b[?7h";
  WatchScreenStyle style{fmt::format("perimap watch, DDS domain {}; Ctrl+C ends", options.domain), true};
  // NOLINTNEXTLINE(concurrency-mt-unsafe): likewise
  style.colours = std::getenv("NO_COLOR") == nullptr;
  std::string text = watch_screen(reports, style);
  if (reports.empty()) text += fmt::format("waiting for a publisher{}\n", hint(options));
  // Line by line over what was there, so that nothing flickers; as many as there is room for, each cut off at the edge.
  winsize window{};
  // The last row stays free for what is printed next.
  int room = ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_row > 0 ? window.ws_row - 1 : 23;
  std::string screen = kHome;
  for (const char c : text) {
    if (c == '\n') screen += kRestOfLine;
    screen += c;
    if (c == '\n' && --room <= 0) break;
  }
  fmt::print("{}{}{}{}", kCutOff, screen, kRestOfScreen, kWrap);
  (void)std::fflush(stdout);
}

void print_interval(const WatchOptions& options, const std::vector<StreamReport>& reports) {
  if (reports.empty()) {
    print(options.json ? std::string(R"({"kind":"waiting"})")
                       : "waiting for a publisher in DDS domain " + std::to_string(options.domain) + hint(options));
  }
  for (const StreamReport& report : reports) {
    print(options.json ? report_json(report, ReportKind::kInterval) : report_line(report));
  }
}

// Nobody wants to hear at the end of a session that its page can not be written.
Outcome check_page(const WatchOptions& options) {
  if (options.page.empty()) return {};
  if (options.recording.empty())
    return refuse("--session: expected --record too, whose file the page tells of", ExitCode::kWrongUsage);
  const Output page{"--session", options.page};
  if (auto apart = check_apart({{"--record", options.recording}, page}, {}); !apart)
    return refuse(apart.error(), ExitCode::kWrongUsage);
  if (auto able = check_writable({page}); !able) return refuse(able.error());
  return {};
}

// As perimap session does.
Expected<void> write_session_page(const WatchOptions& options) {
  SessionFiles files;
  files.recording = options.recording;
  const auto record = read_session(files);
  if (!record) return tl::unexpected(record.error());
  return write_text_file(options.page, session_page(*record));
}

Outcome watch(const WatchOptions& options, const Console& console) {
  if (auto able = check_page(options); !able) return able;
  if (options.security) {
    const auto keys = check_keys(*options.security, seconds_now());
    if (!keys) return refuse(Error{"--security: " + keys.error().message}, ExitCode::kWrongUsage);
    if (const auto warning = expiry_warning(*keys, seconds_now())) console.complain("warning: " + *warning);
  }
  Expected<StopSignal> stop = StopSignal::install();
  if (!stop) {
    return refuse(stop.error());
  }
  std::optional<SampleRecorder> recorder;
  if (!options.recording.empty()) {
    Expected<SampleRecorder> created =
        SampleRecorder::create(options.recording, "perimap watch " PERIMAP_VERSION, SampleRecorder::Unfinished::kKept);
    if (!created) {
      return refuse(created.error());
    }
    recorder.emplace(std::move(*created));
  }
  Expected<SampleReaders> readers =
      SampleReaders::create({options.domain, options.security}, recorder.has_value(), true);
  if (!readers) {
    return refuse(readers.error());
  }
  SampleReceiver receiver(std::move(*readers), std::move(recorder),
                          {options.once ? 1 : options.surfaces, options.once && options.json});
  std::function<void(const std::vector<StreamReport>&)> tell;
  if (!options.once && on_screen(options)) {
    fmt::print("\x1b[2J");
    tell = [&](const std::vector<StreamReport>& reports) { draw(options, reports); };
  } else if (!options.once) {
    tell = [&](const std::vector<StreamReport>& reports) { print_interval(options, reports); };
  }
  const auto limit = [](double seconds) { return seconds > 0.0 ? std::optional(from_seconds(seconds)) : std::nullopt; };
  watch_until_ended(receiver, *stop, {limit(options.wait_s), limit(options.duration_s)}, tell);
  const Expected<void> finished = receiver.finish();

  for (const StreamReport& report : receiver.totals()) {
    if (options.once) {
      print(options.json ? receiver.first_surface() : report_line(report));
    } else {
      print(options.json ? report_json(report, ReportKind::kSummary) : summary_text(report));
    }
  }
  if (!finished) {
    return refuse(finished.error());
  }
  if (receiver.surfaces() == 0) {
    return refuse("no surface was received in DDS domain " + std::to_string(options.domain) + hint(options));
  }
  if (options.page.empty()) return {};
  if (auto written = write_session_page(options); !written) return refuse(written.error());
  console.complain("page: " + options.page);
  return {};
}

}  // namespace

void add_watch_command(Commands& commands) {
  const auto options = std::make_shared<WatchOptions>();
  Command& command = commands.add(
      "watch",
      "Subscribes to a publishing perimapd and shows what may be trusted and why not, sources, features, phase, rate "
      "and lost samples, latency (receipt minus capture, on the publisher's host only), lateness (receipt minus "
      "release), jitter: on a terminal one screen that is drawn anew each second, elsewhere a line a second",
      [options](const Console& console) { return watch(*options, console); });
  command.add_option("--domain", options->domain, "DDS domain")->check(Range(0, 230))->capture_default_str();
  command.add_option("--security", options->security,
                     "Keys for DDS Security, as perimap keys issue makes them (a folder), where the domain is secured");
  command.add_flag("--json", options->json, "One JSON object a line");
  command.add_flag("--lines", options->lines,
                   "A line a second on a terminal, too, where else one screen is drawn anew");
  Option* once = command.add_flag("--once", options->once, "Print the first surface and end");
  command.add_option("--duration", options->duration_s, "End so many seconds after the first surface")
      ->check(Range(0.001, 1e9))
      ->excludes(once);
  command.add_option("--count", options->surfaces, "End after so many surfaces")
      ->check(Range(std::uint64_t{1}, std::uint64_t{1} << 53))
      ->excludes(once);
  command.add_option("--wait", options->wait_s, "End with exit code 1 when no surface has come after so many seconds")
      ->check(Range(0.001, 1e9));
  command.add_option("--record", options->recording, "Write every received sample of all topics to this MCAP file");
  command.add_option(
      "--session", options->page,
      "With --record: at the end write one HTML page to this file that tells what could be trusted when, "
      "as perimap session does");
}

}  // namespace perimap

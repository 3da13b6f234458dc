#include "daemon/evaluation/bench/trace_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "daemon/evaluation/bench/trace_events.hpp"
#include "drivers/file/output_file.hpp"

namespace perimap::bench {
namespace {

// No frame of a run to come was captured so long ago.
constexpr Duration kBefore = std::chrono::minutes(1);

tl::unexpected<Error> cannot_write_trace(const std::string& path, const std::string& reason) {
  return fail(path + ": cannot be written: " + reason);
}

}  // namespace

Expected<TraceFile> TraceFile::create(const std::string& path) {
  auto whole = WholeFile::create(path);
  if (!whole) return tl::unexpected(whole.error());
  auto opened = open_output_file(whole->path());
  if (!opened) return cannot_write_trace(path, opened.error());
  CStream file = stream_of(*std::move(opened), "w");
  if (!file) return cannot_write_trace(path, std::generic_category().message(errno));
  TraceFile trace(path, std::move(*whole), std::move(file), MonotonicClock::now() - kBefore);
  const std::string head =
      fmt::format(R"({{"displayTimeUnit":"ns","otherData":{{"clock":"CLOCK_MONOTONIC","zero_ns":{}}},"traceEvents":[)",
                  to_ns(trace.zero_));
  if (auto written = trace.write(head); !written) return tl::unexpected(written.error());
  return trace;
}

Expected<void> TraceFile::add(const std::string& name, const FrameTrace& trace, std::optional<Instant> counted_from) {
  left_out_ += trace.left_out();
  ++runs_;
  return write((runs_ > 1 ? ",\n" : "\n") + trace_events(runs_, name, trace, counted_from, zero_));
}

Expected<void> TraceFile::finish() {
  if (auto written = write("\n]}\n"); !written) return written;
  if (std::fclose(file_.release()) != 0) return cannot_write_trace(path_, std::generic_category().message(errno));
  return whole_.finish();
}

Expected<void> TraceFile::write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) == text.size()) return {};
  return cannot_write_trace(path_, std::generic_category().message(errno));
}

}  // namespace perimap::bench

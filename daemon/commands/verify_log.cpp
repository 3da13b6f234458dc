// `perimap verify-log`: whether a black box is as perimapd has written it.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "daemon/black_box/entry_text.hpp"
#include "daemon/black_box/samples_to_recording.hpp"
#include "daemon/black_box/verification.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/digest/digest.hpp"

namespace perimap {
namespace {

using black_box::Verification;

struct VerifyLogOptions {
  std::filesystem::path log;
  bool open = false;
  bool entries = false;
  std::optional<std::string> digest;
  std::optional<std::string> recording;
};

std::string utc(std::int64_t ns) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(std::chrono::nanoseconds(ns));
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", std::chrono::sys_seconds(seconds));
}

// Whether all is well.
bool tell(const VerifyLogOptions& options, const Verification& found, const Console& console) {
  for (const std::string& note : found.notes) console.complain(Error{note});
  for (const std::string& fault : found.faults) console.complain(Error{fault});
  const auto line = fmt::format("{} segments, {} entries, {:.1f} MB, {} to {}, digest {}", found.segments,
                                found.entries, static_cast<double>(found.bytes) / 1e6, utc(found.first_utc_ns),
                                utc(found.last_utc_ns), hex_of(found.digest));
  if (!found.faults.empty()) {
    console.complain(Error{fmt::format("{}: NOT as it was written: {}", options.log.string(), line)});
    return false;
  }
  if (found.ended) {
    fmt::print("{}: whole: {}\n", options.log.string(), line);
    return true;
  }
  const std::string open = fmt::format(
      "{}: as it was written up to its last entry, but without an end: perimapd still writes it, or was killed; what "
      "may have been cut off there cannot be told: {}",
      options.log.string(), line);
  if (options.open) {
    fmt::print("{}\n", open);
  } else {
    console.complain(Error{open});
  }
  return options.open;
}

Outcome verify_log(const VerifyLogOptions& options, const Console& console) {
  std::optional<Digest> digest;
  if (options.digest) {
    digest = digest_of_hex(*options.digest);
    if (!digest)
      return refuse("--digest: expected 64 hexadecimal digits, as the log of perimapd has them", ExitCode::kWrongUsage);
  }
  std::optional<black_box::SamplesToRecording> recording;
  if (options.recording) {
    auto begun = black_box::SamplesToRecording::create(*options.recording, "perimap verify-log " PERIMAP_VERSION);
    if (!begun) return refuse(begun.error());
    recording.emplace(std::move(*begun));
  }
  bool found_digest = false;
  const auto found = black_box::verify(options.log, [&](const black_box::Entry& entry) {
    if (options.entries) fmt::print("{}\n", black_box::json_of(entry));
    if (recording) recording->take(entry);
  });
  if (!found) return refuse(found.error());
  if (recording) {
    if (auto finished = recording->finish(); !finished) return refuse(finished.error());
  }
  const bool well = tell(options, *found, console);
  if (digest) {
    found_digest = std::find(found->ends.begin(), found->ends.end(), *digest) != found->ends.end();
    if (!found_digest)
      return refuse(
          fmt::format("{}: no segment ends with the digest {}: it was let go, or another log was put in its place",
                      options.log.string(), *options.digest));
  }
  if (!well) return refuse("");
  return {};
}

}  // namespace

void add_verify_log_command(Commands& commands) {
  const auto options = std::make_shared<VerifyLogOptions>();
  Command& command =
      commands.add("verify-log", "Says whether a black box is as perimapd has written it, and what is in it",
                   [options](const Console& console) { return verify_log(*options, console); });
  command.add_option("LOG", options->log, "The folder, as blackbox.folder has it, or one of its segments")->required();
  command.add_flag("--open", options->open, "It may be without an end: perimapd writes to it still, or was killed");
  command.add_flag("--entries", options->entries, "Each entry as a line of JSON, before all else");
  command.add_option("--digest", options->digest,
                     "One that perimapd's log has told: a segment must end with it, else another log was put there");
  command.add_option("--recording", options->recording,
                     "Writes the published samples that are in it into this recording");
}

}  // namespace perimap

#include "daemon/setup/kept_result.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <ctime>
#include <span>
#include <system_error>

#include "daemon/config/configuration_loader.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestConfiguration = std::size_t{64} * 1024;

std::string_view trimmed(std::string_view line) {
  constexpr std::string_view kSpace = " \t\r";
  line.remove_prefix(std::min(line.find_first_not_of(kSpace), line.size()));
  return line.substr(0, line.find_last_not_of(kSpace) + 1);
}

// Whether the line sets the key, or would if it were no comment.
bool is_of_key(std::string_view line, std::string_view key) {
  line = trimmed(line);
  while (line.starts_with('#')) line = trimmed(line.substr(1));
  if (!line.starts_with(key)) return false;
  return trimmed(line.substr(key.size())).starts_with('=');
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    lines.emplace_back(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  }
  return lines;
}

}  // namespace

std::string date_text_of(std::time_t time) { return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(time)); }

std::string date_now() { return date_text_of(std::time(nullptr)); }

KeptResults::~KeptResults() {
  std::error_code unknown;
  for (const Result& result : results_) std::filesystem::remove(result.written, unknown);
}

Expected<void> KeptResults::add(const std::filesystem::path& file, std::string_view text) {
  results_.push_back({file, std::filesystem::path(file.string() + ".new"), {}});
  auto written = write_text_file(results_.back().written, text);
  if (!written) results_.pop_back();
  return written;
}

Expected<void> KeptResults::keep_before(Result& result) {
  struct stat before {};
  if (::stat(result.file.c_str(), &before) != 0) return {};
  std::error_code error;
  const std::string dated = fmt::format("{}.{:%Y%m%dT%H%M%SZ}", result.file.string(), fmt::gmtime(before.st_mtime));
  std::filesystem::path kept = dated;
  // Two of one second are both kept.
  for (int k = 2; std::filesystem::exists(kept, error); ++k) kept = fmt::format("{}-{}", dated, k);
  std::filesystem::create_hard_link(result.file, kept, error);
  if (error) std::filesystem::copy_file(result.file, kept, error);
  if (error) {
    return fail(fmt::format("{}: the one before can not be kept as {}: {}", result.file.string(), kept.string(),
                            error.message()));
  }
  result.kept = kept;
  return {};
}

// The first so many as they were before.
void KeptResults::undo(std::size_t count) {
  std::error_code unknown;
  for (Result& result : std::span(results_).first(count)) {
    if (result.kept.empty()) {
      std::filesystem::remove(result.file, unknown);
    } else {
      std::filesystem::rename(result.kept, result.file, unknown);
    }
  }
}

Expected<void> KeptResults::put_in_place() {
  for (std::size_t i = 0; i < results_.size(); ++i) {
    Result& result = results_[i];
    std::error_code error;
    auto kept = keep_before(result);
    if (kept) std::filesystem::rename(result.written, result.file, error);
    if (kept && !error) continue;
    if (kept && !result.kept.empty()) {
      std::error_code unknown;
      std::filesystem::remove(result.kept, unknown);  // the file itself is still there
    }
    undo(i);
    if (!kept) return kept;
    return fail(fmt::format("{}: cannot be written: {}", result.file.string(), error.message()));
  }
  return {};
}

Expected<void> write_kept(const std::filesystem::path& file, std::string_view text) {
  KeptResults results;
  if (auto added = results.add(file, text); !added) return added;
  return results.put_in_place();
}

std::string with_keys(std::string_view text, std::string_view section, const std::vector<MeasuredKey>& keys,
                      std::string_view comment) {
  std::vector<std::string> lines = lines_of(text);
  const std::string heading = fmt::format("[{}]", section);
  const auto is_heading = [](const std::string& line) { return trimmed(line).starts_with('['); };
  auto begin = lines.size();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (trimmed(lines[i]).substr(0, heading.size()) == heading) {
      begin = i + 1;
      break;
    }
  }
  if (begin == lines.size()) {
    if (lines.empty() || lines.back() != heading) lines.push_back(heading);
    begin = lines.size();
  }
  for (const MeasuredKey& key : keys) {
    auto end = begin;
    while (end < lines.size() && !is_heading(lines[end])) ++end;
    auto at = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (!is_of_key(lines[i], key.name)) continue;
      at = i;
      if (!trimmed(lines[i]).starts_with('#')) break;  // one that counts rather than one that is commented out
    }
    if (key.value.empty()) {
      if (at < end && !trimmed(lines[at]).starts_with('#')) {
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(at));
      }
      continue;
    }
    const std::string line = fmt::format("{} = {}  # {}", key.name, key.value, comment);
    if (at < end) {
      lines[at] = line;
    } else {
      while (at > begin && trimmed(lines[at - 1]).empty()) --at;
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(at), line);
    }
  }
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

Expected<std::string> configuration_with_keys(const std::filesystem::path& file, std::string_view section,
                                              const std::vector<MeasuredKey>& keys, std::string_view comment,
                                              bool files_may_be_missing) {
  const auto text = read_text_file(file, kLargestConfiguration, "configuration");
  if (!text) return tl::unexpected(text.error());
  std::string changed = with_keys(*text, section, keys, comment);
  const NamedFiles named = files_may_be_missing ? NamedFiles::kMayBeMissing : NamedFiles::kMustExist;
  if (const auto sound = parse_configuration(changed, file, {}, named); !sound) return tl::unexpected(sound.error());
  return changed;
}

}  // namespace perimap

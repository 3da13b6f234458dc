#include "daemon/setup/kept_result.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <ctime>
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

std::string date_now() { return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr))); }

Expected<void> write_kept(const std::filesystem::path& file, std::string_view text) {
  std::error_code error;
  const auto written = std::filesystem::path(file.string() + ".new");
  if (auto done = write_text_file(written, text); !done) {
    std::filesystem::remove(written, error);
    return done;
  }
  struct stat before {};
  if (::stat(file.c_str(), &before) == 0) {
    const std::string dated = fmt::format("{}.{:%Y%m%dT%H%M%SZ}", file.string(), fmt::gmtime(before.st_mtime));
    std::filesystem::path kept = dated;
    // Two of one second are both kept.
    for (int k = 2; std::filesystem::exists(kept, error); ++k) kept = fmt::format("{}-{}", dated, k);
    std::filesystem::create_hard_link(file, kept, error);
    if (error) std::filesystem::copy_file(file, kept, std::filesystem::copy_options::overwrite_existing, error);
    if (error) {
      std::error_code unknown;
      std::filesystem::remove(written, unknown);
      return fail(
          fmt::format("{}: the one before can not be kept as {}: {}", file.string(), kept.string(), error.message()));
    }
  }
  std::filesystem::rename(written, file, error);
  if (error) return fail(fmt::format("{}: cannot be written: {}", file.string(), error.message()));
  return {};
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

Expected<void> set_keys(const std::filesystem::path& file, std::string_view section,
                        const std::vector<MeasuredKey>& keys, std::string_view comment, bool files_may_be_missing) {
  const auto text = read_text_file(file, kLargestConfiguration, "configuration");
  if (!text) return tl::unexpected(text.error());
  const std::string changed = with_keys(*text, section, keys, comment);
  const NamedFiles named = files_may_be_missing ? NamedFiles::kMayBeMissing : NamedFiles::kMustExist;
  if (const auto sound = parse_configuration(changed, file, {}, named); !sound) return tl::unexpected(sound.error());
  return write_kept(file, changed);
}

}  // namespace perimap

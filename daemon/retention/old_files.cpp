#include "daemon/retention/old_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <string_view>
#include <system_error>

#include "drivers/file/descriptor.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;

// What the project's own files begin with: MCAP (mcap.dev/spec, magic), a checkpoint, and a segment of a black box.
constexpr std::string_view kRecording("\x89MCAP0\r\n", 8);
constexpr std::string_view kCheckpoint("PERIMAPC");
constexpr std::string_view kBlackBox("PERIMAPB");

bool is_of_patients(const fs::path& file) {
  std::array<char, 8> begin{};
  std::ifstream in(file, std::ios::binary);
  if (!in.read(begin.data(), begin.size())) {
    // Begun, and stopped before there was anything in it.
    return in.gcount() == 0 && (file.extension() == ".mcap" || file.string().find(".mcap.part") != std::string::npos);
  }
  const std::string_view head(begin.data(), begin.size());
  return head == kRecording || head == kCheckpoint || head == kBlackBox;
}

}  // namespace

Expected<std::chrono::seconds> parse_age(const std::string& text) {
  constexpr long kMost = 100'000;
  long count = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, count);
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  if (error == std::errc() && count > 0 && count <= kMost) {
    if (unit == "h") return std::chrono::hours(count);
    if (unit == "d") return std::chrono::days(count);
    if (unit == "w") return std::chrono::weeks(count);
  }
  return fail(
      fmt::format("expected a number of hours, days or weeks from 1 to {}, as 12h, 30d or 8w, got '{}'", kMost, text));
}

Expected<std::vector<OldFile>> old_files(const fs::path& folder, std::chrono::seconds age, fs::file_time_type now) {
  std::error_code error;
  std::vector<OldFile> found;
  fs::directory_iterator entries(folder, error);
  if (error) return fail(fmt::format("{}: cannot be read: {}", folder.string(), error.message()));
  for (const fs::directory_entry& entry : entries) {
    std::error_code ignored;
    if (entry.is_symlink(ignored) || !entry.is_regular_file(ignored)) continue;
    const auto written = entry.last_write_time(ignored);
    if (ignored || now - written < age || !is_of_patients(entry.path())) continue;
    found.push_back(
        {entry.path(), std::chrono::duration_cast<std::chrono::seconds>(now - written), entry.file_size(ignored)});
  }
  std::sort(found.begin(), found.end(), [](const OldFile& a, const OldFile& b) { return a.age > b.age; });
  return found;
}

Expected<void> remove_old(const OldFile& file) {
  std::error_code error;
  fs::remove(file.path, error);
  if (error) return fail(fmt::format("{}: cannot be removed: {}", file.path.string(), error.message()));
  return {};
}

Forgotten forget_old(const std::vector<std::string>& folders, std::chrono::seconds age, bool dry,
                     const std::function<void(const OldFile&)>& tell,
                     const std::function<void(const Error&)>& complain) {
  Forgotten forgotten;
  const auto fault = [&](const Error& error) {
    complain(error);
    forgotten.failed = true;
  };
  for (const std::string& folder : folders) {
    const auto found = old_files(folder, age, fs::file_time_type::clock::now());
    if (!found) {
      fault(found.error());
      continue;
    }
    for (const OldFile& file : *found) {
      const auto removed = dry ? Expected<void>() : remove_old(file);
      if (!removed) {
        fault(removed.error());
        continue;
      }
      ++forgotten.files;
      forgotten.bytes += file.bytes;
      tell(file);
    }
    if (!dry) synchronise_folder(folder);
  }
  return forgotten;
}

void synchronise_folder(const fs::path& folder) {
  const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened) static_cast<void>(::fsync(opened.get()));
}

}  // namespace perimap

#include "daemon/black_box/segment_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

#include "drivers/text_file/text_file.hpp"

namespace perimap::black_box {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kName = "segment-";
constexpr std::size_t kLargest = std::size_t{256} << 20;

}  // namespace

std::optional<std::uint64_t> number_of_segment(const std::string& name) {
  if (!name.starts_with(kName) || name.size() < kName.size() + 8) return std::nullopt;
  std::uint64_t number = 0;
  const char* end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(name.data() + kName.size(), end, number);
  // One name for one number.
  if (error != std::errc() || rest != end || name != fmt::format("{}{:08}", kName, number)) return std::nullopt;
  return number;
}

Expected<std::vector<std::uint64_t>> segment_numbers(const fs::path& folder) {
  std::error_code error;
  std::vector<std::uint64_t> numbers;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (const auto number = number_of_segment(entry->path().filename().string())) numbers.push_back(*number);
  }
  if (error) return fail(fmt::format("{}: cannot be read: {}", folder.string(), error.message()));
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

void remove_unfinished_segments(const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const fs::path path = entry->path();
    std::error_code ignored;
    if (path.extension() == ".part" && number_of_segment(path.stem().string())) fs::remove(path, ignored);
  }
}

Expected<std::string> read_segment_file(const fs::path& file) {
  auto bytes = read_text_file(file, kLargest, "segment of a black box");
  if (bytes && bytes->size() > kLargest) {
    return fail(fmt::format("{}: expected a segment of at most {} bytes", file.string(), kLargest));
  }
  return bytes;
}

}  // namespace perimap::black_box

#include "daemon/command_line/same_file.hpp"

#include <filesystem>
#include <system_error>

#include "drivers/file/whole_file.hpp"

namespace perimap {

bool is_same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty() || is_special(a) || is_special(b)) return false;
  std::error_code error;
  if (std::filesystem::equivalent(a, b, error) && !error) return true;
  const auto name = [](const std::string& path) {
    std::error_code unknown;
    const auto canonical = std::filesystem::weakly_canonical(std::filesystem::absolute(path, unknown), unknown);
    return unknown ? std::filesystem::path(path) : canonical;
  };
  return name(a) == name(b);
}

}  // namespace perimap

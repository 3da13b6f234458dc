#include "daemon/process/service_folder.hpp"

#include <cstdlib>

namespace perimap {

std::optional<std::string> service_file(const char* variable, const std::string& name) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here writes the environment
  const char* value = std::getenv(variable);
  const std::string folder = value != nullptr ? value : "";
  if (!folder.starts_with('/') || folder.find(':') != std::string::npos) return std::nullopt;
  return folder + "/" + name;
}

}  // namespace perimap

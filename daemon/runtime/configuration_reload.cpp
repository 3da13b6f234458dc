#include "daemon/runtime/configuration_reload.hpp"

#include <fmt/format.h>

#include "daemon/config/configuration_difference.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/logging/logging.hpp"

namespace perimap {

Expected<std::string> ConfigurationReload::operator()() {
  // Over the reading, too: of two that come together the one that reads later has the last word.
  const std::lock_guard lock(mutex_);
  const auto read = load_configuration(file_);
  if (!read) return tl::unexpected(read.error());
  std::string restart;
  for (const std::string& key : differing_keys(running_, *read)) {
    if (key != "log.level") restart += fmt::format("{}{}", restart.empty() ? "" : ", ", key);
  }
  Logging::set_level(read->log.level);
  running_.log.level = read->log.level;
  return restart.empty() ? std::string("in effect\n")
                         : fmt::format("in effect but for what needs a restart: {}\n", restart);
}

}  // namespace perimap

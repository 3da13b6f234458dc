#include "daemon/config/configuration_difference.hpp"

#include "daemon/config/configuration_keys.hpp"

namespace perimap {

std::vector<std::string> differing_keys(const Configuration& a, const Configuration& b) {
  std::vector<std::string> names;
  for (const ConfigurationKey& key : configuration_keys()) {
    if (key.write(a) != key.write(b)) names.push_back(key.section.empty() ? key.name : key.section + "." + key.name);
  }
  return names;
}

}  // namespace perimap

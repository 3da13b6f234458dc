#include "drivers/file/group_access.hpp"

#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

#include "core/error/one_line.hpp"

namespace perimap {

Expected<void> let_group_read(const std::filesystem::path& file, const std::string& group) {
  const auto failed = [&](const std::string& why) {
    return fail(on_one_line(file.string() + ": cannot be given to the group '" + group + "': " + why));
  };
  ::group entry{};
  ::group* found = nullptr;
  std::vector<char> buffer(1U << 16U);
  const int error = getgrnam_r(group.c_str(), &entry, buffer.data(), buffer.size(), &found);
  if (error != 0) return failed(std::generic_category().message(error));
  if (found == nullptr) return failed("there is no such group on this machine");
  // The group first: until then the mode gives nobody anything.
  if (::chown(file.c_str(), static_cast<uid_t>(-1), entry.gr_gid) != 0 ||
      ::chmod(file.c_str(), S_IRUSR | S_IWUSR | S_IRGRP) != 0) {
    return failed(std::generic_category().message(errno));
  }
  return {};
}

}  // namespace perimap

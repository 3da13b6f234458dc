#include "daemon/command_line/open_files.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

namespace perimap {

Expected<void> ensure_open_files(unsigned least) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= least) return {};
  limit.rlim_cur = std::min<rlim_t>(least, limit.rlim_max);
  static_cast<void>(setrlimit(RLIMIT_NOFILE, &limit));
  if (limit.rlim_cur >= least) return {};
  return fail(
      fmt::format("at most {} files may be open at a time: expected a limit of at least {} (ulimit -n, "
                  "LimitNOFILE=)",
                  limit.rlim_max, least));
}

}  // namespace perimap

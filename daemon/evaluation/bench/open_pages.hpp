// People who look: `perimap view` and browsers with its page, beside a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/evaluation/bench/child_process.hpp"

namespace perimap::bench {

// Ends with the object. Each page has a headless Chromium of its own, so that none is in the background of another;
// that costs the machine more than four windows of one.
class OpenPages {
 public:
  // Begins `perimap view` in the domain, which needs no keys, and the browsers, whose profiles are in `scratch`; what
  // is not installed is an error.
  [[nodiscard]] static Expected<OpenPages> open(int domain, int pages, const std::filesystem::path& scratch);

  // So many connections `perimap view` has now: one a page, once the pages have been there for ten seconds; before,
  // those as well over which they were loaded.
  [[nodiscard]] int connected() const;

 private:
  OpenPages(ChildProcess view, std::uint16_t port) noexcept : view_(std::move(view)), port_(port) {}

  ChildProcess view_;
  std::uint16_t port_;
  std::vector<ChildProcess> browsers_;
};

// From the kernel's table (/proc/net/tcp): connections that are established at this port of this host.
[[nodiscard]] int established_at(std::uint16_t port, const std::filesystem::path& table = "/proc/net/tcp");

}  // namespace perimap::bench

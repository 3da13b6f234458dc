// The digests of a key folder's files, by which a byte that is another is noticed wherever it stands: what reads PEM
// and S/MIME passes over line ends and headers, and what looks at a signature over what is not signed.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

// As sha256sum(1) writes and reads them, so that others can look too.
inline constexpr const char* kKeyDigests = "SHA256SUMS";

// A line for each name and its content.
[[nodiscard]] std::string key_digests(const std::vector<std::pair<std::string, std::string>>& files);

// Each of the files is as it was when the folder was issued, the list of what is revoked apart, which is replaced while
// the others stay. An error names the first that is not, or what is wrong with the digests.
[[nodiscard]] Expected<void> check_key_digests(const std::filesystem::path& folder);

}  // namespace perimap

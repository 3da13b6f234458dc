#include "daemon/keys/key_digests.hpp"

#include <fmt/format.h>

#include <array>
#include <cstddef>

#include "daemon/dds/security.hpp"
#include "daemon/digest/digest.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
namespace files = dds::key_files;

constexpr std::size_t kLargestFile = std::size_t{1} << 20U;
constexpr std::array kDigested = {files::kAuthority, files::kCertificate, files::kKey, files::kGovernance,
                                  files::kPermissions};

}  // namespace

std::string key_digests(const std::vector<std::pair<std::string, std::string>>& contents) {
  std::string text;
  for (const auto& [name, content] : contents) {
    text += fmt::format("{}  {}\n", hex_of(digest_of({content})), name);
  }
  return text;
}

Expected<void> check_key_digests(const fs::path& folder) {
  const fs::path file = folder / kKeyDigests;
  const auto told = read_text_file(file, kLargestFile, "list of digests (perimap keys issue --renew makes one)");
  if (!told) return tl::unexpected(told.error());
  std::vector<std::pair<std::string, std::string>> contents;
  for (const char* name : kDigested) {
    auto content = read_text_file(folder / name, kLargestFile, "file of keys");
    if (!content) return tl::unexpected(content.error());
    if (told->find(key_digests({{name, *content}})) == std::string::npos) {
      return fail(
          fmt::format("{}: is not as it was issued (by its digest in {})", (folder / name).string(), file.string()));
    }
    contents.emplace_back(name, *std::move(content));
  }
  if (*told != key_digests(contents)) return fail(file.string() + ": is not as it was written");
  return {};
}

}  // namespace perimap

#include "daemon/evaluation/bench/scratch_folder.hpp"

#include <cstdlib>
#include <string>
#include <system_error>

namespace perimap::bench {

Expected<ScratchFolder> ScratchFolder::create(const std::filesystem::path& in) {
  std::string path = (in / "perimap-bench-XXXXXX").string();
  if (mkdtemp(path.data()) == nullptr) return fail(in.string() + ": a folder cannot be made there");
  return ScratchFolder(path);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

}  // namespace perimap::bench

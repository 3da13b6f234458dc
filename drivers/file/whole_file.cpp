#include "drivers/file/whole_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "core/error/one_line.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {
namespace {

constexpr int kMostPartial = 1000;  // beside one file

tl::unexpected<Error> cannot_write(const std::filesystem::path& file, int error) {
  return fail(on_one_line(file.string() + ": cannot be written: " + std::generic_category().message(error)));
}

// The file that a link leads to, whether it is there or not.
std::filesystem::path without_links(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_symlink(file, error)) return file;
  auto target = std::filesystem::weakly_canonical(file, error);
  return error ? file : target;
}

// Whether a link of its way is that of a descriptor, as /dev/stdout and /dev/fd/3 are: whoever opened the file that it
// leads to goes on with that file, whatever takes its name.
bool is_open_already(std::filesystem::path file) {
  constexpr int kMostLinks = 40;  // as the kernel follows
  for (int link = 0; link < kMostLinks; ++link) {
    std::error_code error;
    const auto folder = std::filesystem::weakly_canonical(std::filesystem::absolute(file, error).parent_path(), error);
    if (error) return false;
    if (folder.string().starts_with("/proc/")) return true;
    const auto target = std::filesystem::read_symlink(folder / file.filename(), error);
    if (error) return false;
    file = folder / target;
  }
  return false;
}

// On the disk, whatever opened it and however it was written. 0, or the error.
int synchronise(const std::filesystem::path& path, int flags) {
  const Descriptor descriptor(::open(path.c_str(), flags | O_CLOEXEC));
  return descriptor && ::fsync(descriptor.get()) == 0 ? 0 : errno;
}

}  // namespace

bool is_special(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return false;
  return !std::filesystem::is_regular_file(file, error) || is_open_already(file);
}

Expected<WholeFile> WholeFile::create(const std::filesystem::path& file, Name name, Readers readers) {
  if (is_special(file)) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error)) return cannot_write(file, EISDIR);
    // A pipe is not opened here: that would wait for its reader, and the writer opens it anyway.
    return WholeFile(file, file, file);
  }
  std::filesystem::path target = without_links(file);
  // A new file takes the place of the old one, which may say that it is not to be written.
  if (::access(target.c_str(), W_OK) != 0 && errno != ENOENT) return cannot_write(file, errno);
  std::filesystem::path partial;
  Descriptor made;
  // What has that name already may be all that is left of an earlier run, or another's that is under way.
  for (int number = 1; !made; ++number) {
    partial = target;
    partial += number == 1 ? ".part" : ".part-" + std::to_string(number);
    if (name == Name::kPartWithEnding) partial += target.extension();
    constexpr int kFlags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;
    made = Descriptor(::open(partial.c_str(), kFlags, readers == Readers::kOwner ? 0600 : 0666));
    if (!made && (errno != EEXIST || number == kMostPartial)) return cannot_write(file, errno);
  }
  if (readers == Readers::kOwner) return WholeFile(file, std::move(target), std::move(partial));
  std::error_code error;
  const auto before = std::filesystem::status(target, error);
  if (std::filesystem::exists(before)) std::filesystem::permissions(partial, before.permissions(), error);
  return WholeFile(file, std::move(target), std::move(partial));
}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : named_(std::move(other.named_)),
      file_(std::move(other.file_)),
      partial_(std::move(other.partial_)),
      unfinished_(std::exchange(other.unfinished_, false)) {}

WholeFile::~WholeFile() {
  if (!unfinished_ || direct()) return;
  std::error_code ignored;
  std::filesystem::remove(partial_, ignored);
}

Expected<void> WholeFile::finish() {
  if (direct()) return {};
  if (const int error = synchronise(partial_, O_RDONLY); error != 0) return cannot_write(named_, error);
  if (::rename(partial_.c_str(), file_.c_str()) != 0) return cannot_write(named_, errno);
  unfinished_ = false;
  // Its name, too. A file system that cannot do that has done what it can.
  const auto folder = file_.has_parent_path() ? file_.parent_path() : std::filesystem::path(".");
  static_cast<void>(synchronise(folder, O_RDONLY | O_DIRECTORY));
  return {};
}

Expected<void> check_writable(const std::filesystem::path& file) {
  return WholeFile::create(file).map([](const WholeFile&) {});
}

}  // namespace perimap

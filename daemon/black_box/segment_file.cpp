#include "daemon/black_box/segment_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string_view>
#include <system_error>
#include <utility>

namespace perimap::black_box {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> failed(const fs::path& path, std::string_view what) {
  return fail(fmt::format("{}: cannot {}: {}", path.string(), what, std::generic_category().message(errno)));
}

// How many of the bytes were written before an error, if there was one.
std::size_t write_all(int descriptor, std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = ::write(descriptor, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  return done;
}

}  // namespace

fs::path segment_path(const fs::path& folder, std::uint64_t number) {
  return folder / fmt::format("segment-{:08}", number);
}

SegmentFile::SegmentFile(Descriptor descriptor, fs::path path, std::uint64_t number)
    : descriptor_(std::move(descriptor)), path_(std::move(path)) {
  facts_.number = number;
  facts_.digest = begin_digest();
}

Expected<SegmentFile> SegmentFile::create(const fs::path& folder, const SegmentHeader& header, const Entry& entry,
                                          std::uint64_t reserved) {
  const fs::path path = segment_path(folder, header.number);
  const fs::path part = path.string() + ".part";
  Descriptor descriptor(::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
  if (!descriptor) return failed(part, "be created");
  // KEEP_SIZE: the file's length says how much was written. Where it is refused, as by a file system that cannot, each
  // write finds its own room.
  static_cast<void>(::fallocate(descriptor.get(), FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(reserved)));
  SegmentFile file(std::move(descriptor), part, header.number);
  const std::string begin = segment_begin();
  const auto refused = [&](tl::unexpected<Error> error) {
    ::unlink(part.c_str());
    return error;
  };
  if (write_all(file.descriptor_.get(), begin) != begin.size()) return refused(failed(part, "be written"));
  file.facts_.bytes = begin.size();
  if (auto written = file.append(entry); !written) return refused(fail(written.error().message));
  if (auto synchronised = file.synchronise(); !synchronised) return refused(fail(synchronised.error().message));
  // Never over another: what is there is evidence.
  if (::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) != 0) {
    return refused(failed(path, "be made"));
  }
  file.path_ = path;
  const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened) static_cast<void>(::fsync(opened.get()));
  return file;
}

Expected<void> SegmentFile::append(const Entry& entry) {
  Digest chain = facts_.digest;
  const std::string frame = frame_of(entry, chain);
  if (write_all(descriptor_.get(), frame) != frame.size()) {
    const int reason = errno;
    // Without the part that was: behind it nothing could be read.
    const bool taken_back = ::ftruncate(descriptor_.get(), static_cast<off_t>(facts_.bytes)) == 0 &&
                            ::lseek(descriptor_.get(), static_cast<off_t>(facts_.bytes), SEEK_SET) >= 0;
    errno = reason;
    return failed(path_, taken_back ? "be written" : "be written, and has part of an entry");
  }
  facts_.digest = chain;
  facts_.bytes += frame.size();
  facts_.last_utc_ns = entry.at.utc_ns;
  ++facts_.entries;
  return {};
}

Expected<void> SegmentFile::synchronise() {
  if (::fdatasync(descriptor_.get()) != 0) return failed(path_, "be brought to the disk");
  return {};
}

void SegmentFile::release_room() {
  // Truncating to the length that it has frees what was reserved behind it.
  static_cast<void>(::ftruncate(descriptor_.get(), static_cast<off_t>(facts_.bytes)));
}

}  // namespace perimap::black_box

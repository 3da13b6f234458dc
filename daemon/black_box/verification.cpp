#include "daemon/black_box/verification.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "daemon/black_box/segment_file.hpp"
#include "daemon/black_box/segment_folder.hpp"
#include "daemon/black_box/segment_reader.hpp"
#include "daemon/black_box/segment_ring.hpp"

namespace perimap::black_box {
namespace {

namespace fs = std::filesystem;

// A segment as it is now, for what later ones tell of it.
struct Found {
  fs::path file;
  SegmentFacts facts;
  std::uint64_t remainder_bytes = 0;
  Digest remainder{};
  std::set<std::uint64_t> let_go;
  bool run_has_ended = false;
};

class Verifier {
 public:
  Verifier(const std::function<void(const Entry&)>& see, bool of_folder) : see_(see), of_folder_(of_folder) {}

  Expected<void> read(const fs::path& file, std::optional<std::uint64_t> number) {
    const auto bytes = read_segment_file(file);
    if (!bytes) return tl::unexpected(bytes.error());
    Found found;
    found.file = file;
    found.facts = read_segment(*bytes, [&](const Entry& entry) { take(entry, found); });
    const SegmentFacts& facts = found.facts;
    found.remainder_bytes = bytes->size() - facts.bytes;
    if (found.remainder_bytes > 0) found.remainder = digest_of({std::string_view(*bytes).substr(facts.bytes)});
    if (facts.entries > 0 && number && facts.header.number != *number) {
      fault(file, fmt::format("its header says that it is segment {}", facts.header.number));
    }
    count(facts);
    found_.emplace(number.value_or(facts.header.number), std::move(found));
    return {};
  }

  Verification judge() {
    for (auto later = found_.begin(); later != found_.end(); ++later) {
      for (const PresentSegment& told : later->second.facts.header.present) hold(told, later->second);
    }
    for (const auto& [number, found] : found_) judge_end(number, found);
    const Found& last = found_.rbegin()->second;
    // Of one file nothing is asked of others.
    if (of_folder_) judge_missing();
    result_.ended = last.facts.whole() && (last.run_has_ended || !of_folder_);
    result_.digest = last.facts.digest;
    return std::move(result_);
  }

 private:
  void take(const Entry& entry, Found& found) {
    if (entry.kind == EntryKind::kLetGo) {
      const std::uint64_t number = let_go_number(entry.content).value_or(0);
      found.let_go.insert(number);
      if (why_of(entry.content) == kRemovedByOthers) {
        result_.notes.push_back(fmt::format("segment {}: {}", number, kRemovedByOthers));
      }
    }
    if (entry.kind == EntryKind::kEnd) found.run_has_ended = why_of(entry.content) == kRunHasEnded;
    if (see_) see_(entry);
  }

  void count(const SegmentFacts& facts) {
    ++result_.segments;
    result_.entries += facts.entries;
    result_.bytes += facts.bytes;
    if (result_.first_utc_ns == 0) result_.first_utc_ns = facts.first_utc_ns;
    if (facts.entries > 0) result_.last_utc_ns = facts.last_utc_ns;
    result_.ends.push_back(facts.digest);
  }

  void fault(const fs::path& file, std::string_view what) {
    result_.faults.push_back(fmt::format("{}: {}", file.string(), what));
  }

  // What a later segment says of one, against what that is.
  void hold(const PresentSegment& told, const Found& later) {
    const auto there = found_.find(told.number);
    if (there == found_.end()) return;
    const Found& found = there->second;
    const bool same = told.entries == found.facts.entries && told.bytes == found.facts.bytes &&
                      (told.entries == 0 || told.digest == found.facts.digest) &&
                      told.remainder_bytes == found.remainder_bytes && told.remainder == found.remainder;
    if (same) {
      vouched_.insert(told.number);
    } else if (differing_.insert(told.number).second) {
      fault(found.file, fmt::format("expected {} entries in {} bytes with the digest {} at the end, as {} has it, got "
                                    "{} entries in {} bytes with {}",
                                    told.entries, told.bytes + told.remainder_bytes, hex_of(told.digest),
                                    later.file.filename().string(), found.facts.entries,
                                    found.facts.bytes + found.remainder_bytes, hex_of(found.facts.digest)));
    }
  }

  // What stands behind the last good entry may be what a stopped machine has left; whether it is, the next segment
  // says.
  void judge_end(std::uint64_t number, const Found& found) {
    if (found.facts.whole()) return;
    const bool newest = number == found_.rbegin()->first;
    const bool vouched = vouched_.contains(number) && !differing_.contains(number);
    if (!found.facts.fault.empty()) {
      if (vouched && found.facts.torn) {
        result_.notes.push_back(
            fmt::format("{}: {}: as the next run found it", found.file.string(), found.facts.fault));
      } else {
        fault(found.file, found.facts.fault);
      }
    } else if (!newest && vouched) {
      result_.notes.push_back(
          fmt::format("{}: has no end, as the next run found it: perimapd was killed, had crashed, "
                      "or its disk was full",
                      found.file.string()));
    } else if (!newest && !differing_.contains(number)) {
      fault(found.file, "has no end, and no later segment says that it had none");
    }
  }

  void judge_missing() {
    const Found& last = found_.rbegin()->second;
    for (const PresentSegment& told : last.facts.header.present) {
      if (found_.contains(told.number) || last.let_go.contains(told.number)) continue;
      fault(last.file, fmt::format("tells of segment {}, which is not there and was not let go: it was removed, by "
                                   "`perimap forget` or by somebody",
                                   told.number));
    }
  }

  const std::function<void(const Entry&)>& see_;
  bool of_folder_;
  Verification result_;
  std::map<std::uint64_t, Found> found_;
  std::set<std::uint64_t> vouched_;
  std::set<std::uint64_t> differing_;
};

}  // namespace

Expected<Verification> verify(const fs::path& folder_or_file, const std::function<void(const Entry&)>& see) {
  std::error_code error;
  const bool of_folder = fs::is_directory(folder_or_file, error);
  Verifier verifier(see, of_folder);
  if (!of_folder) {
    if (auto read = verifier.read(folder_or_file, std::nullopt); !read) return tl::unexpected(std::move(read.error()));
    return verifier.judge();
  }
  const auto numbers = segment_numbers(folder_or_file);
  if (!numbers) return tl::unexpected(numbers.error());
  if (numbers->empty())
    return fail(fmt::format("{}: expected segments of a black box, found none", folder_or_file.string()));
  for (const std::uint64_t number : *numbers) {
    if (auto read = verifier.read(segment_path(folder_or_file, number), number); !read) {
      return tl::unexpected(std::move(read.error()));
    }
  }
  return verifier.judge();
}

}  // namespace perimap::black_box

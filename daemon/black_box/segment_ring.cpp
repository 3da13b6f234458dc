#include "daemon/black_box/segment_ring.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "daemon/black_box/json_members.hpp"
#include "daemon/black_box/segment_folder.hpp"
#include "daemon/black_box/segment_reader.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap::black_box {
namespace {

namespace fs = std::filesystem;

// So many headers tell of at most: what would be more is let go.
constexpr std::size_t kMostSegments = 1000;
// At 120 features and 30 surfaces a second half a minute is 15 MB.
constexpr std::uint64_t kMostSegmentBytes = std::uint64_t{32} << 20;

std::int64_t ns(std::chrono::nanoseconds d) { return d.count(); }

PresentSegment present_of(std::uint64_t number, const SegmentFacts& facts, std::string_view bytes) {
  PresentSegment segment;
  segment.number = number;
  segment.entries = facts.entries;
  segment.bytes = facts.bytes;
  segment.digest = facts.digest;
  segment.last_utc_ns = facts.last_utc_ns;
  segment.remainder_bytes = bytes.size() - facts.bytes;
  if (segment.remainder_bytes > 0) segment.remainder = digest_of({bytes.substr(facts.bytes)});
  return segment;
}

}  // namespace

std::optional<std::uint64_t> let_go_number(std::string_view content) {
  const auto json = nlohmann::ordered_json::parse(content, nullptr, false);
  JsonMembers members(json, "the entry");
  const std::uint64_t number = members.number("segment");
  return members.fault().empty() ? std::optional(number) : std::nullopt;
}

std::string why_of(std::string_view content) {
  const auto json = nlohmann::ordered_json::parse(content, nullptr, false);
  return JsonMembers(json, "the entry").text("why");
}

SegmentRing::SegmentRing(fs::path folder, const RingLimits& limits, SegmentHeader whose, Clock clock, Descriptor lock)
    : folder_(std::move(folder)),
      limits_(limits),
      whose_(std::move(whose)),
      clock_(std::move(clock)),
      lock_(std::move(lock)) {}

Expected<SegmentRing> SegmentRing::open(const fs::path& folder, const RingLimits& limits, SegmentHeader whose,
                                        Clock clock) {
  const auto failed = [&folder](std::string_view what) {
    return fail(fmt::format("{}: cannot {}: {}", folder.string(), what, std::generic_category().message(errno)));
  };
  if (::mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) return failed("be made");
  Descriptor lock(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock) return failed("be opened");
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    return fail(fmt::format("{}: another process writes its black box there", folder.string()));
  }
  SegmentRing ring(folder, limits, std::move(whose), std::move(clock), std::move(lock));
  if (auto taken = ring.take_up(); !taken) return tl::unexpected(std::move(taken.error()));
  return ring;
}

// Only the newest is read as a whole: it tells of those before it.
Expected<void> SegmentRing::take_up() {
  auto numbers = segment_numbers(folder_);
  if (!numbers) return tl::unexpected(std::move(numbers.error()));
  remove_unfinished_segments(folder_);
  if (numbers->empty()) return {};
  std::vector<PresentSegment> unknown;
  for (auto number = numbers->rbegin(); number != numbers->rend(); ++number) {
    const fs::path path = segment_path(folder_, *number);
    const auto bytes = read_segment_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    bool event = false;
    std::vector<std::uint64_t> gone;
    const SegmentFacts facts = read_segment(*bytes, [&](const Entry& entry) {
      event |= entry.kind == EntryKind::kEvent;
      if (entry.kind == EntryKind::kLetGo) gone.push_back(let_go_number(entry.content).value_or(0));
    });
    PresentSegment segment = present_of(*number, facts, *bytes);
    const bool newest = *number == numbers->back();
    segment.kept = !facts.whole() || event;
    if (newest && facts.fault.empty() && !facts.ended) {
      findings_.push_back(fmt::format("segment {} has no end: the run before was killed or has crashed", *number));
    }
    if (!facts.fault.empty()) {
      findings_.push_back(fmt::format("segment {} is not as it was written: {}", *number, facts.fault));
    }
    unknown.push_back(segment);
    if (facts.entries == 0) continue;  // it tells of none: the one before it is asked
    present_ = facts.header.present;
    std::erase_if(present_, [&](const PresentSegment& s) {
      return std::find(gone.begin(), gone.end(), s.number) != gone.end() &&
             !fs::exists(segment_path(folder_, s.number));
    });
    break;
  }
  present_.insert(present_.end(), unknown.rbegin(), unknown.rend());
  // An event's minute before it.
  const PresentSegment& last = present_.back();
  for (PresentSegment& segment : present_) {
    segment.kept |= last.kept && segment.last_utc_ns >= last.last_utc_ns - ns(kKeptBefore);
  }
  next_number_ = present_.back().number + 1;
  last_digest_ = present_.back().digest;
  return {};
}

std::vector<std::string> SegmentRing::take_findings() { return std::exchange(findings_, {}); }

std::uint64_t SegmentRing::segment_bytes() const { return std::min(kMostSegmentBytes, limits_.bytes / 8); }

Expected<void> SegmentRing::write(const Entry& entry) {
  const std::int64_t monotonic = clock_().monotonic_ns;
  const bool full = file_ && file_->facts().entries > 2 &&
                    file_->facts().bytes + entry.content.size() + kEntryFrame > segment_bytes();
  if (full || (file_ && monotonic - file_began_ns_ >= ns(kSegmentSpan))) {
    if (auto ended = end(kNextGoesOn); !ended) return ended;
  }
  if (!file_) {
    if (auto begun = begin_segment(); !begun) return begun;
  }
  return file_->append(entry);
}

Expected<void> SegmentRing::write_configuration(const Stamp& at, std::string toml) {
  configuration_ = std::move(toml);
  return file_ ? write({EntryKind::kConfiguration, at, configuration_}) : Expected<void>();
}

Expected<void> SegmentRing::write_now(EntryKind kind, std::string_view content) {
  return file_->append({kind, clock_(), content});
}

Expected<void> SegmentRing::begin_segment() {
  const Stamp now = clock_();
  notice_removed();
  let_go_of_old(now.utc_ns);
  whose_.number = next_number_;
  whose_.present = present_;
  const std::string header = text_of(whose_);
  const Entry entry{EntryKind::kHeader, now, header};
  auto file = SegmentFile::create(folder_, whose_, entry, segment_bytes());
  if (!file) {
    // What is to go makes room.
    remove_let_go();
    file = SegmentFile::create(folder_, whose_, entry, segment_bytes());
  }
  if (!file) return tl::unexpected(std::move(file.error()));
  file_.emplace(std::move(*file));
  ++next_number_;
  file_began_ns_ = now.monotonic_ns;
  file_kept_ = now.monotonic_ns < keep_until_ns_;
  if (!configuration_.empty()) {
    if (auto written = write_now(EntryKind::kConfiguration, configuration_); !written) return written;
  }
  return tell_let_go();
}

// Told before it is done: after a crash in between nothing is missing that nobody has told of.
Expected<void> SegmentRing::tell_let_go() {
  Expected<void> told;
  for (const std::string& entry : std::exchange(let_go_, {})) {
    if (auto written = write_now(EntryKind::kLetGo, entry); !written && told) told = std::move(written);
  }
  remove_let_go();
  return told;
}

void SegmentRing::remove_let_go() {
  for (const std::uint64_t number : std::exchange(going_, {})) ::unlink(segment_path(folder_, number).c_str());
}

void SegmentRing::keep_around_now() {
  const Stamp now = clock_();
  keep_until_ns_ = now.monotonic_ns + ns(kKeptAfter);
  file_kept_ = true;
  for (PresentSegment& segment : present_) segment.kept |= segment.last_utc_ns >= now.utc_ns - ns(kKeptBefore);
}

Expected<void> SegmentRing::synchronise() { return file_ ? file_->synchronise() : Expected<void>(); }

Expected<void> SegmentRing::end(std::string_view why) {
  if (!file_) return {};
  let_go_of_old(clock_().utc_ns);
  static_cast<void>(tell_let_go());
  const nlohmann::ordered_json told{{"why", why}};
  const auto written = write_now(EntryKind::kEnd, json_line(told));
  // On a full disk it has no end; the next header tells what it had.
  file_->release_room();
  static_cast<void>(file_->synchronise());
  present_.push_back(file_->facts());
  present_.back().kept = file_kept_;
  last_digest_ = file_->facts().digest;
  file_.reset();
  return written;
}

// By `perimap forget`, or by whomever.
void SegmentRing::notice_removed() {
  for (std::size_t i = present_.size(); i-- > 0;) {
    struct stat status {};
    const fs::path path = segment_path(folder_, present_[i].number);
    if (::stat(path.c_str(), &status) == 0 || errno != ENOENT) continue;
    findings_.push_back(fmt::format("segment {} was removed, not by perimapd", present_[i].number));
    let_go(i, kRemovedByOthers);
  }
}

void SegmentRing::let_go_of_old(std::int64_t utc_ns) {
  for (std::size_t i = present_.size(); i-- > 0;) {
    const std::int64_t age = utc_ns - present_[i].last_utc_ns;
    if (!present_[i].kept && age > ns(limits_.ring)) {
      let_go(i, "the ring has come round");
    } else if (age > ns(limits_.keep)) {
      let_go(i, "older than it is kept");
    }
  }
  const auto bytes = [this] {
    std::uint64_t sum = segment_bytes() + (file_ ? file_->facts().bytes : 0);  // the coming one's too
    for (const PresentSegment& segment : present_) sum += segment.bytes + segment.remainder_bytes;
    return sum;
  };
  // What no event holds first; the oldest of these, or of all.
  while (!present_.empty() && (bytes() > limits_.bytes || present_.size() >= kMostSegments)) {
    const auto ring = std::find_if(present_.begin(), present_.end(), [](const PresentSegment& s) { return !s.kept; });
    const auto oldest = ring == present_.end() ? present_.begin() : ring;
    let_go(static_cast<std::size_t>(oldest - present_.begin()), "more would be more bytes than it may have");
  }
}

void SegmentRing::let_go(std::size_t index, std::string_view why) {
  const std::uint64_t number = present_[index].number;
  const nlohmann::ordered_json told{{"segment", number}, {"digest", hex_of(present_[index].digest)}, {"why", why}};
  going_.push_back(number);
  let_go_.push_back(json_line(told));
  present_.erase(present_.begin() + static_cast<std::ptrdiff_t>(index));
}

}  // namespace perimap::black_box

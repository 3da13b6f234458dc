// What a subscriber received from a perimapd that was killed again and again, and what its recordings hold.
// killed_check RECEIVED KILLS RECORDINGS
//   RECEIVED    of perimap watch --record
//   KILLS       a line for each kill: when it was killed and when it was started again, s of CLOCK_MONOTONIC
//   RECORDINGS  the folder, with a file for each run
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

// It ends the program: there is nothing to go on with.
[[noreturn]] void give_up(const std::string& why) {
  fmt::print(stderr, "{}\n", why);
  std::exit(1);
}

struct Kill {
  Instant killed;
  Instant begun;
};

std::vector<Kill> read_kills(const std::string& file) {
  std::ifstream in(file);
  std::vector<Kill> kills;
  for (double killed_s = 0.0, begun_s = 0.0; in >> killed_s >> begun_s;) {
    kills.push_back({from_ns(0) + from_seconds(killed_s), from_ns(0) + from_seconds(begun_s)});
  }
  if (kills.empty()) give_up(file + ": no kills");
  return kills;
}

// When the first surface came after each start, and the first with positions that may be used.
struct Resumed {
  std::optional<Instant> any;
  std::optional<Instant> valid;
};

bool has_valid_positions(const perimap_Surface& surface) {
  if (surface.state == perimap_SURFACE_INVALID) return false;
  for (std::uint32_t i = 0; i < surface.features._length; ++i) {
    if (surface.features._buffer[i].state == perimap_FEATURE_CONVERGED) return true;
  }
  return false;
}

std::vector<Resumed> read_received(const std::string& file, const std::vector<Kill>& kills) {
  auto reader = RecordingReader::open(file);
  if (!reader) give_up(reader.error().message);
  constexpr std::array<std::string_view, 1> kSurfaces = {channels::kSurface};
  if (const auto selected = reader->select(kSurfaces); !selected) give_up(selected.error().message);
  std::vector<Resumed> resumed(kills.size());
  for (;;) {
    const auto message = reader->next();
    if (!message) give_up(message.error().message);
    if (!*message) return resumed;
    const auto surface = reader->decode<perimap_Surface>(**message);
    if (!surface) give_up(surface.error().message);
    const Instant receipt = (*message)->arrival;
    // The last start before it.
    const auto next = std::find_if(kills.begin(), kills.end(), [&](const Kill& k) { return k.begun > receipt; });
    if (next == kills.begin()) continue;
    Resumed& run = resumed[static_cast<std::size_t>(next - kills.begin()) - 1];
    if (!run.any) run.any = receipt;
    if (!run.valid && has_valid_positions(**surface)) run.valid = receipt;
  }
}

// Prints the times from the start; true when there is one for each kill.
bool tell_times(const char* what, const std::vector<Resumed>& resumed, std::optional<Instant> Resumed::*when,
                const std::vector<Kill>& kills) {
  std::vector<double> times_s;
  for (std::size_t i = 0; i < kills.size(); ++i) {
    if (resumed[i].*when) times_s.push_back(to_seconds(*(resumed[i].*when) - kills[i].begun));
  }
  std::sort(times_s.begin(), times_s.end());
  const auto within = std::upper_bound(times_s.begin(), times_s.end(), 1.0) - times_s.begin();
  fmt::print("{}: after {} of {} starts", what, times_s.size(), kills.size());
  if (!times_s.empty()) {
    fmt::print("; {} within 1 s; median {:.2f} s, most {:.2f} s", within, times_s[times_s.size() / 2], times_s.back());
  }
  fmt::print("\n");
  return times_s.size() == kills.size();
}

struct Kept {
  Instant first;
  Instant last;
  std::uint64_t messages = 0;
};

Kept read_recording(const std::string& file) {
  auto reader = RecordingReader::open(file, ReadMode::kWhole);
  if (!reader) give_up(reader.error().message);
  Kept kept;
  for (;;) {
    const auto message = reader->next();
    if (!message) give_up(message.error().message);
    if (!*message) break;
    if (kept.messages++ == 0) kept.first = (*message)->arrival;
    kept.last = (*message)->arrival;
  }
  return kept;
}

// So long a run has recorded something, whatever its devices take to answer: a chunk is a second.
constexpr Duration kSurelyRecorded = std::chrono::seconds(4);

// Each file is readable to its last whole chunk. What came after that is what a kill may cost.
bool tell_recordings(const std::string& folder, const std::vector<Kill>& kills) {
  std::vector<Kept> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const Kept kept = read_recording(entry.path().string());
    if (kept.messages > 0) files.push_back(kept);
  }
  Duration longest{0};
  std::size_t recorded = 0;
  bool all = true;
  for (std::size_t i = 0; i < kills.size(); ++i) {
    const Instant begun = i == 0 ? from_ns(0) : kills[i - 1].begun;
    const auto file = std::find_if(files.begin(), files.end(), [&](const Kept& kept) {
      return kept.first >= begun && kept.first <= kills[i].killed;
    });
    if (file != files.end()) {
      ++recorded;
      longest = std::max(longest, kills[i].killed - file->last);
    } else if (kills[i].killed - begun > kSurelyRecorded) {
      all = false;
    }
  }
  fmt::print(
      "recordings: {} files with messages, {} of them of the {} runs that were killed; at most {:.2f} s of one "
      "are missing at its end\n",
      files.size(), recorded, kills.size(), to_seconds(longest));
  return all;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  using namespace perimap;
  if (argc != 4) give_up("killed_check RECEIVED KILLS RECORDINGS");
  const std::vector<Kill> kills = read_kills(argv[2]);
  const std::vector<Resumed> resumed = read_received(argv[1], kills);
  const bool published = tell_times("surfaces again", resumed, &Resumed::any, kills);
  const bool valid = tell_times("positions to be used again", resumed, &Resumed::valid, kills);
  return tell_recordings(argv[3], kills) && published && valid ? 0 : 1;
}

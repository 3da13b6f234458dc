// A device is taken from a running perimapd and given back again and again: what is a subscriber told, and how soon?
// pulled_device PID SOURCE TIMES PULL PLUG
//   PID        of perimapd
//   SOURCE     camera, ecg or r_trigger
//   TIMES      how often
//   PULL PLUG  shell commands that take the device away and give it back
// Exit code 0 when the source was OK, each time was told to be gone and was OK again after it was given back, surfaces
// went on, and perimapd's descriptors and memory stay what they were after the first time. A trigger that is gone must
// be told as closed: stalled is also one whose monitor counts no beat.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/integration/pipeline/process_figures.hpp"
#include "tests/integration/pipeline/told_states.hpp"

namespace perimap::test {
namespace {

// An emulated processor takes its time.
constexpr Duration kPatience = std::chrono::seconds(60);  // with each word: then it was never told
constexpr Duration kOut = std::chrono::seconds(2);
constexpr long kMoreMemory_kB = 2048;  // over the second half; of which the allocator may keep some

std::optional<Duration> told(const ToldStates& states, perimap_SourceKind kind,
                             const std::vector<perimap_SourceState>& any, Instant since) {
  const Instant deadline = MonotonicClock::now() + kPatience;
  while (MonotonicClock::now() < deadline) {
    if (const auto change = states.first(kind, any, since)) return change->receipt - since;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return std::nullopt;
}

int fail(const std::string& why) {
  fmt::print(stderr, "pulled_device: {}\n", why);
  return 1;
}

int run(pid_t pid, perimap_SourceKind kind, int times, const std::string& pull, const std::string& plug) {
  auto readers = SampleReaders::create(0, false);
  if (!readers) return fail(readers.error().message);
  ToldStates states(std::move(*readers));
  if (!told(states, kind, {perimap_SOURCE_OK}, Instant())) return fail("it is not there to begin with");
  std::vector<perimap_SourceState> as_gone{perimap_SOURCE_CLOSED};
  if (kind != perimap_SOURCE_R_TRIGGER) as_gone.push_back(perimap_SOURCE_STALLED);
  std::vector<Duration> gone, back;
  long descriptors_first = 0, memory_first_kB = 0;
  for (int i = 0; i < times; ++i) {
    const Instant pulled = MonotonicClock::now();
    if (std::system(pull.c_str()) != 0) return fail(pull);
    const auto word = told(states, kind, as_gone, pulled);
    if (!word) return fail(fmt::format("time {}: nobody is told that it is gone", i + 1));
    gone.push_back(*word);
    const std::size_t before = states.surfaces().size();
    std::this_thread::sleep_for(kOut);
    const std::size_t meanwhile = states.surfaces().size() - before;
    if (meanwhile == 0) return fail(fmt::format("time {}: no surfaces", i + 1));
    const Instant plugged = MonotonicClock::now();
    if (std::system(plug.c_str()) != 0) return fail(plug);
    const auto again = told(states, kind, {perimap_SOURCE_OK}, plugged);
    if (!again) return fail(fmt::format("time {}: it does not recover", i + 1));
    back.push_back(*again);
    // After half of them: what a session comes to know at first takes memory too.
    if (i + 1 != (times + 1) / 2) continue;
    descriptors_first = descriptors_of(pid);
    memory_first_kB = own_memory_kB_of(pid);
  }
  fmt::print("{} times: told after {}; OK again after {}; descriptors {} and {}, memory {} and {} kB\n", times,
             spread(gone), spread(back), descriptors_first, descriptors_of(pid), memory_first_kB,
             own_memory_kB_of(pid));
  if (descriptors_of(pid) > descriptors_first) return fail("descriptors leak");
  if (own_memory_kB_of(pid) > memory_first_kB + kMoreMemory_kB) return fail("memory leaks");
  return 0;
}

}  // namespace
}  // namespace perimap::test

int main(int argc, char** argv) {
  using namespace perimap::test;
  const std::map<std::string_view, perimap_SourceKind> sources{
      {"camera", perimap_SOURCE_CAMERA}, {"ecg", perimap_SOURCE_ECG}, {"r_trigger", perimap_SOURCE_R_TRIGGER}};
  const auto source = argc == 6 ? sources.find(argv[2]) : sources.end();
  const int times = argc == 6 ? std::atoi(argv[3]) : 0;
  if (source == sources.end() || times < 1) return fail("PID camera|ecg|r_trigger TIMES PULL PLUG");
  return run(std::atoi(argv[1]), source->second, times, argv[4], argv[5]);
}

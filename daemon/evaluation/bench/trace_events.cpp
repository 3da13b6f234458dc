#include "daemon/evaluation/bench/trace_events.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "drivers/json/json_text.hpp"

namespace perimap::bench {
namespace {

// Thread numbers within a run's process.
constexpr int kSourceThread = 1;
constexpr int kMapperThread = 2;
constexpr int kPublisherThread = 3;
constexpr int kFirstWorkerThread = 4;
constexpr std::size_t kMapperParts = static_cast<std::size_t>(FramePart::kLearn) + 1;
// Numbers of a process's frames, for what belongs together across threads.
constexpr std::uint64_t kMostFrames = 10'000'000;

// Of one frame; what there is not is null.
struct Life {
  const TracedArrival* arrival = nullptr;
  std::array<const FrameSlice*, kMapperParts> parts{};
  const TracedRelease* release = nullptr;

  [[nodiscard]] const FrameSlice* part(FramePart which) const { return parts[static_cast<std::size_t>(which)]; }
};

// In the order of their numbers.
std::map<std::uint64_t, Life> lives_of(const FrameTrace& trace) {
  std::map<std::uint64_t, Life> lives;
  for (const TracedArrival& arrival : trace.arrivals.entries()) lives[arrival.stamp.sequence].arrival = &arrival;
  for (const FrameSlice& slice : trace.mapper.entries())
    lives[slice.frame].parts[static_cast<std::size_t>(slice.part)] = &slice;
  for (const TracedRelease& traced : trace.releases.entries()) {
    const bool frames_own = traced.release.stream == ReleaseStream::kFrame && !traced.release.frame_missing;
    if (frames_own) lives[traced.release.frame_sequence].release = &traced;
  }
  return lives;
}

// Microseconds, exactly.
std::string exact_us(Duration d) {
  const std::int64_t ns = d.count() < 0 ? -d.count() : d.count();
  return fmt::format("{}{}.{:03}", d.count() < 0 ? "-" : "", ns / 1000, ns % 1000);
}
std::string of_frame(std::uint64_t frame) { return fmt::format(R"("frame":{})", frame); }

class EventLines {
 public:
  EventLines(int process, Instant zero) : process_(process), zero_(zero) {}

  void name_process(const std::string& name) {
    line(R"("ph":"M","name":"process_name","args":{{"name":{}}})", json_line(nlohmann::json(name)));
    line(R"("ph":"M","name":"process_sort_index","args":{{"sort_index":{}}})", process_);
  }
  void name_thread(int thread, std::string_view name) {
    line(R"("ph":"M","tid":{},"name":"thread_name","args":{{"name":"{}"}})", thread, name);
    line(R"("ph":"M","tid":{0},"name":"thread_sort_index","args":{{"sort_index":{0}}})", thread);
  }
  // A slice within which others of the thread lie must come before those.
  void slice(int thread, std::string_view name, Instant begin, Instant end, const std::string& arguments) {
    line(R"("ph":"X","cat":"thread","tid":{},"ts":{},"dur":{},"name":"{}","args":{{{}}})", thread, since_zero(begin),
         exact_us(end - begin), name, arguments);
  }
  void mark(std::string_view name, Instant at) {
    line(R"("ph":"i","s":"p","ts":{},"name":"{}")", since_zero(at), name);
  }
  // Of a track of its own; what begins later ends earlier, or begins when the last one has ended.
  void begin(std::string_view track, std::uint64_t id, std::string_view name, Instant at,
             const std::string& arguments) {
    on_track("b", track, id, name, at, arguments);
  }
  void end(std::string_view track, std::uint64_t id, std::string_view name, Instant at) {
    on_track("e", track, id, name, at, "");
  }
  void happened(std::string_view track, std::uint64_t id, std::string_view name, Instant at,
                const std::string& arguments) {
    on_track("n", track, id, name, at, arguments);
  }
  // An arrow through the slices of these threads that are under way at these instants: "s" begins it, "f" ends it.
  void arrow(const char* kind, std::uint64_t id, int thread, Instant at) {
    line(R"("ph":"{}","cat":"frame","id":{},"bp":"e","tid":{},"ts":{},"name":"frame")", kind, id, thread,
         since_zero(at));
  }

  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  [[nodiscard]] std::string since_zero(Instant t) const { return exact_us(t - zero_); }

  template <class... Values>
  void line(fmt::format_string<Values...> format, const Values&... values) {
    if (!text_.empty()) text_ += ",\n";
    text_ += fmt::format(R"({{"pid":{},)", process_);
    fmt::vformat_to(std::back_inserter(text_), format, fmt::make_format_args(values...));
    text_ += '}';
  }
  void on_track(const char* kind, std::string_view track, std::uint64_t id, std::string_view name, Instant at,
                const std::string& arguments) {
    line(R"("ph":"{}","cat":"{}","id":{},"ts":{},"name":"{}","args":{{{}}})", kind, track, id, since_zero(at), name,
         arguments);
  }

  int process_;
  Instant zero_;
  std::string text_;
};

// Slices of a frame's own track, one after the other: what began before the last one had ended is shown from there on.
class Passage {
 public:
  Passage(EventLines& lines, std::uint64_t id, Instant begin) : lines_(lines), id_(id), reached_(begin) {}

  void go(std::string_view name, Instant until) {
    if (until <= reached_) return;
    lines_.begin("frame", id_, name, reached_, "");
    lines_.end("frame", id_, name, until);
    reached_ = until;
  }
  [[nodiscard]] Instant reached() const { return reached_; }

 private:
  EventLines& lines_;
  std::uint64_t id_;
  Instant reached_;
};

Instant end_of(const Life& life) {
  Instant end = life.arrival->end;
  if (const FrameSlice* evaluated = life.part(FramePart::kEvaluate)) end = std::max(end, evaluated->end);
  if (life.release != nullptr) end = std::max(end, life.release->written);
  return end;
}

std::string lateness(const TracedRelease& traced) {
  return fmt::format(R"("after_deadline_us":{},"update_late":{})", exact_us(traced.ready - traced.release.deadline),
                     traced.update_late);
}

void add_life(EventLines& lines, std::uint64_t frame, std::uint64_t id, const Life& life) {
  const Instant capture = life.arrival->stamp.capture;
  lines.begin("frame", id, "frame", capture, of_frame(frame));
  Passage passage(lines, id, capture);
  passage.go("on its way", life.arrival->stamp.arrival);
  passage.go("await taking over", life.arrival->begin);
  passage.go("take over", life.arrival->end);
  if (const FrameSlice* await_pose = life.part(FramePart::kAwaitPose)) {
    passage.go("await mapper", await_pose->begin);
    passage.go(name_of(FramePart::kAwaitPose), await_pose->end);
  }
  for (const FramePart part : {FramePart::kPredictAndFind, FramePart::kPhaseAndPose, FramePart::kEvaluate}) {
    const FrameSlice* slice = life.part(part);
    if (slice == nullptr) continue;
    passage.go("await mapper", slice->begin);
    passage.go(name_of(part), slice->end);
  }
  if (life.release != nullptr) {
    passage.go("await release", life.release->ready);
    lines.happened("frame", id, "released", life.release->ready, lateness(*life.release));
    passage.go("write", life.release->written);
  }
  lines.end("frame", id, "frame", end_of(life));
}

// The mapper's slices of one frame within one of the whole.
void add_mapping(EventLines& lines, std::uint64_t frame, const Life& life) {
  if (const FrameSlice* waited = life.part(FramePart::kAwaitPose))
    lines.slice(kMapperThread, name_of(waited->part), waited->begin, waited->end, of_frame(frame));
  const FrameSlice* first = life.part(FramePart::kPredictAndFind);
  if (first == nullptr) return;
  constexpr std::array kStages = {FramePart::kPredictAndFind, FramePart::kPhaseAndPose, FramePart::kEvaluate,
                                  FramePart::kSettleMatches, FramePart::kHandOn};
  Instant end = first->end;
  for (const FramePart part : kStages) {
    if (const FrameSlice* slice = life.part(part)) end = std::max(end, slice->end);
  }
  lines.slice(kMapperThread, "frame", first->begin, end, of_frame(frame));
  for (const FramePart part : kStages) {
    if (const FrameSlice* slice = life.part(part))
      lines.slice(kMapperThread, name_of(part), slice->begin, slice->end, of_frame(frame));
  }
}

void add_release(EventLines& lines, const TracedRelease& traced) {
  const std::string frame =
      of_frame(traced.release.frame_sequence) +
      fmt::format(R"(,"stream":"{}","frame_missing":{})", name_of(traced.release.stream), traced.release.frame_missing);
  lines.slice(kPublisherThread, "compose", traced.begin, traced.composed, frame);
  lines.slice(kPublisherThread, "await deadline", traced.composed, traced.ready, frame);
  lines.slice(kPublisherThread, "write", traced.ready, traced.written, frame + "," + lateness(traced));
}

void add_arrows(EventLines& lines, std::uint64_t id, const Life& life) {
  const FrameSlice* found = life.part(FramePart::kPredictAndFind);
  if (found == nullptr && life.release == nullptr) return;
  lines.arrow("s", id, kSourceThread, life.arrival->begin);
  if (found != nullptr) lines.arrow(life.release != nullptr ? "t" : "f", id, kMapperThread, found->begin);
  if (life.release != nullptr) lines.arrow("f", id, kPublisherThread, life.release->ready);
}

}  // namespace

std::string trace_events(int process, const std::string& name, const FrameTrace& trace,
                         std::optional<Instant> counted_from, Instant zero) {
  EventLines lines(process, zero);
  const std::uint64_t left_out = trace.left_out();
  lines.name_process(left_out > 0 ? fmt::format("{} ({} entries had no room)", name, left_out) : name);
  lines.name_thread(kSourceThread, "source");
  lines.name_thread(kMapperThread, "mapper");
  lines.name_thread(kPublisherThread, "publisher");
  for (std::size_t i = 0; i < trace.workers.size(); ++i) {
    const int thread = kFirstWorkerThread + static_cast<int>(i);
    lines.name_thread(thread, fmt::format("worker-{}", i));
    for (const FrameSlice& slice : trace.workers[i].entries())
      lines.slice(thread, name_of(slice.part), slice.begin, slice.end, of_frame(slice.frame));
  }
  if (counted_from) lines.mark("counted from here", *counted_from);
  for (const TracedArrival& arrival : trace.arrivals.entries())
    lines.slice(kSourceThread, "take over", arrival.begin, arrival.end, of_frame(arrival.stamp.sequence));
  for (const TracedRelease& traced : trace.releases.entries()) add_release(lines, traced);
  // Even for a frame's own track, odd for its learning's.
  std::uint64_t id = static_cast<std::uint64_t>(process) * kMostFrames;
  for (const auto& [frame, life] : lives_of(trace)) {
    id += 2;
    add_mapping(lines, frame, life);
    if (const FrameSlice* learnt = life.part(FramePart::kLearn)) {
      lines.begin("learn", id + 1, "learn", learnt->begin, of_frame(frame));
      lines.end("learn", id + 1, "learn", learnt->end);
    }
    if (life.arrival == nullptr) continue;
    add_life(lines, frame, id, life);
    add_arrows(lines, id, life);
  }
  return lines.take();
}

}  // namespace perimap::bench

#include "daemon/runtime/session_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <utility>

#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

constexpr Duration kBehind = std::chrono::milliseconds(250);
constexpr Duration kWriteTick = std::chrono::milliseconds(20);
constexpr Duration kFlushAfter = std::chrono::seconds(1);
constexpr std::size_t kFrameHeads = 1024;
constexpr std::size_t kSampleRing = 2048;
constexpr std::size_t kToolRing = 4 * kSampleRing;  // several tools at the sensor's rate

}  // namespace

Expected<std::unique_ptr<SessionRecorder>> SessionRecorder::create(const std::filesystem::path& file,
                                                                   const SensorRecordingFacts& facts,
                                                                   std::size_t memory_bytes) {
  auto recorder = std::make_unique<SessionRecorder>(memory_bytes);
  if (auto opened = recorder->open(file, facts); !opened) return tl::unexpected(std::move(opened.error()));
  return recorder;
}

SessionRecorder::SessionRecorder(std::size_t memory_bytes)
    : memory_bytes_(memory_bytes),
      frames_(kFrameHeads),
      others_(kSampleRing, kToolRing, kSampleRing, kSampleRing, kSampleRing) {}

Expected<void> SessionRecorder::open(const std::filesystem::path& file, const SensorRecordingFacts& facts) {
  if (accepting_.load(std::memory_order_relaxed))
    return fail(fmt::format("{}: is recorded to already", this->file().string()));
  const auto refuse = [this](Error error) -> Expected<void> {
    asked_.store(true, std::memory_order_relaxed);
    give_up(error);
    return tl::unexpected(std::move(error));
  };
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) return refuse({fmt::format("{}: is there already", file.string())});
  (void)std::signal(SIGXFSZ, SIG_IGN);
  auto writer = SensorWriter::create(file.string(), facts, MonotonicClock::now());
  if (!writer) return refuse(std::move(writer.error()));
  if (!bytes_) bytes_.emplace(memory_bytes_);
  {
    std::unique_lock lock(mutex_);
    file_ = file;
    reason_.clear();
    next_writer_.emplace(std::move(*writer));
    if (files_.get() > 0) next_opened_ = MonotonicClock::now();
    wakeup_.post();
    if (running_.load(std::memory_order_relaxed)) answered_.wait(lock, [this] { return !next_writer_; });
  }
  stopped_.store(false, std::memory_order_relaxed);
  asked_.store(true, std::memory_order_relaxed);
  files_.add();
  accepting_.store(true, std::memory_order_release);
  return {};
}

Expected<void> SessionRecorder::close() {
  if (!asked_.load(std::memory_order_relaxed)) return fail("nothing is recorded");
  accepting_.store(false, std::memory_order_relaxed);
  std::string reason;
  {
    std::unique_lock lock(mutex_);
    closing_ = true;
    wakeup_.post();
    answered_.wait(lock, [this] { return !closing_; });
    reason = reason_;
  }
  asked_.store(false, std::memory_order_relaxed);
  if (stopped_.exchange(false, std::memory_order_relaxed)) return fail(std::move(reason));
  return {};
}

std::filesystem::path SessionRecorder::file() const {
  const std::lock_guard lock(mutex_);
  return file_;
}

void SessionRecorder::start(ThreadLauncher& threads) {
  running_.store(true, std::memory_order_relaxed);
  thread_ = threads.launch("recorder", ThreadRole::kHousekeeping, [this] { run(); });
}

void SessionRecorder::stop() {
  if (!thread_.joinable()) return;
  ending_.store(true, std::memory_order_relaxed);
  wakeup_.post();
  thread_.join();
  running_.store(false, std::memory_order_relaxed);
}

void SessionRecorder::frame(const CameraFrame& frame) noexcept {
  const RealtimeScope realtime;
  if (!accepting_.load(std::memory_order_acquire)) return;
  // A capture after the arrival is a broken stamp: the pipeline drops such a frame, and no replay could deliver it.
  if (stopped_.load(std::memory_order_relaxed) || frame.stamp.capture > frame.stamp.arrival) {
    return frames_.refused.add();
  }
  // The bytes first: once the head is seen they are there. So room for the head is made sure of before; what the other
  // thread has taken meanwhile only makes more.
  if (frames_put_ - frames_taken_.get() >= kFrameHeads || !bytes_->push(frame.bytes)) return frames_.refused.add();
  RecordedFrameHead head{frame, frame.bytes.size()};
  head.frame.bytes = {};
  static_cast<void>(frames_.ring.push(head));
  ++frames_put_;
}

template <class Sample>
void SessionRecorder::enqueue(Lane<Sample>& lane, const Sample& sample) noexcept {
  const RealtimeScope realtime;
  if (!accepting_.load(std::memory_order_acquire)) return;
  if (stopped_.load(std::memory_order_relaxed) || !lane.ring.push(sample)) lane.refused.add();
}

void SessionRecorder::pose(const TrackerSample& sample) noexcept {
  enqueue(std::get<Lane<TrackerSample>>(others_), sample);
}
void SessionRecorder::tool(const ToolSample& sample) noexcept { enqueue(std::get<Lane<ToolSample>>(others_), sample); }
void SessionRecorder::ecg(const EcgBlock& block) noexcept { enqueue(std::get<Lane<EcgBlock>>(others_), block); }
void SessionRecorder::r_trigger(const RTriggerPulse& pulse) noexcept {
  enqueue(std::get<Lane<RTriggerPulse>>(others_), pulse);
}
void SessionRecorder::respiration(const RespirationBlock& block) noexcept {
  enqueue(std::get<Lane<RespirationBlock>>(others_), block);
}

SessionRecorder::Summary SessionRecorder::summary() const noexcept {
  return {asked_.load(std::memory_order_relaxed),
          stopped_.load(std::memory_order_relaxed),
          files_.get(),
          recorded_.get(),
          frames_.refused.get() + frames_unwritten_.get(),
          std::apply([](const auto&... lane) { return (lane.refused.get() + ...); }, others_) + other_unwritten_.get()};
}

std::string SessionRecorder::reason() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

void SessionRecorder::run() {
  for (;;) {
    wakeup_.clear();  // before looking at what is asked
    // Asked before draining: what the devices gave before stop() or close() is then drained after it.
    const bool ending = ending_.load(std::memory_order_relaxed);
    bool closing = false;
    {
      const std::lock_guard lock(mutex_);
      closing = closing_;
      if (next_writer_) {
        writer_.emplace(std::move(*next_writer_));
        next_writer_.reset();
        flushed_ = MonotonicClock::now();
        opened_ = next_opened_;
        last_arrival_ = std::max(last_arrival_, opened_);
        answered_.notify_all();
      }
    }
    const Instant now = MonotonicClock::now();
    drain(ending || closing ? Instant::max() : now - kBehind);
    if (ending || closing) finish_file();
    if (closing) {
      const std::lock_guard lock(mutex_);
      closing_ = false;
      answered_.notify_all();
    }
    if (ending) return;
    if (writer_ && now - flushed_ >= kFlushAfter && !stopped_.load(std::memory_order_relaxed)) {
      if (const auto done = writer_->flush(); !done) give_up(done.error());
      flushed_ = now;
    }
    static_cast<void>(wakeup_.wait_until(now + kWriteTick));
  }
}

void SessionRecorder::finish_file() {
  if (!writer_) return;
  if (!stopped_.load(std::memory_order_relaxed)) {
    if (const auto done = writer_->finish(); !done) give_up(done.error());
  }
  writer_.reset();
}

void SessionRecorder::drain(Instant until) {
  const auto refill = [](auto& lane) {
    if (!lane.front && !lane.ring.pop(lane.front.emplace())) lane.front.reset();
    return lane.front.has_value();
  };
  for (;;) {
    if (!frames_.front && refill(frames_)) frames_taken_.add();
    Instant first = frames_.front ? frames_.front->frame.stamp.arrival : Instant::max();
    const auto look = [&](auto& lane) {
      if (refill(lane)) first = std::min(first, lane.front->arrival);
    };
    std::apply([&](auto&... lane) { (look(lane), ...); }, others_);
    if (first == Instant::max() || first > until) return;
    write_front(first);
  }
}

Expected<void> SessionRecorder::write_frame(bool wanted) {
  frame_bytes_.resize(frames_.front->size);
  bytes_->pop(frame_bytes_);
  frames_.front->frame.bytes = frame_bytes_;
  Expected<void> written;
  if (wanted) written = writer_->write(frames_.front->frame, last_arrival_);
  frames_.front.reset();
  return written;
}

// One that comes after later ones were written, its thread having slept for longer than we are behind, is written as
// arrived with them: a replay keeps to the order.
// What came before the file was opened, of a thread that was slow to hear that the last one was closed, belongs to
// neither.
void SessionRecorder::write_front(Instant arrival) {
  const bool asked_for = writer_ && arrival >= opened_;
  if (asked_for) last_arrival_ = std::max(last_arrival_, arrival);
  const bool wanted = asked_for && !stopped_.load(std::memory_order_relaxed);
  Expected<void> written;
  Counter* unwritten = &other_unwritten_;
  if (frames_.front && frames_.front->frame.stamp.arrival == arrival) {
    unwritten = &frames_unwritten_;
    written = write_frame(wanted);
  } else {
    // The first of them that arrived then.
    const auto write = [&](auto& lane) {
      if (!lane.front || lane.front->arrival != arrival) return false;
      if (wanted) written = writer_->write(*lane.front, last_arrival_);
      lane.front.reset();
      return true;
    };
    std::apply([&](auto&... lane) { static_cast<void>((write(lane) || ...)); }, others_);
  }
  if (!written) give_up(written.error());
  if (!asked_for) return;
  if (wanted && written) {
    recorded_.add();
  } else {
    unwritten->add();
  }
}

void SessionRecorder::give_up(const Error& error) {
  {
    const std::lock_guard lock(mutex_);
    reason_ = error.message;
  }
  stopped_.store(true, std::memory_order_relaxed);
}

}  // namespace perimap

#include "daemon/runtime/session_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <utility>

#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

constexpr Duration kBehind = std::chrono::milliseconds(250);
constexpr Duration kTick = std::chrono::milliseconds(20);
constexpr Duration kFlushAfter = std::chrono::seconds(1);
constexpr std::size_t kFrameHeads = 1024;
constexpr std::size_t kSampleRing = 2048;

}  // namespace

Expected<std::unique_ptr<SessionRecorder>> SessionRecorder::create(const std::filesystem::path& file,
                                                                   const SensorRecordingFacts& facts,
                                                                   std::size_t memory_bytes) {
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) return fail(fmt::format("{}: is there already", file.string()));
  (void)std::signal(SIGXFSZ, SIG_IGN);
  auto writer = SensorWriter::create(file.string(), facts, MonotonicClock::now());
  if (!writer) return tl::unexpected(std::move(writer.error()));
  return std::unique_ptr<SessionRecorder>(new SessionRecorder(file, std::move(*writer), memory_bytes));
}

SessionRecorder::SessionRecorder(std::filesystem::path file, SensorWriter writer, std::size_t memory_bytes)
    : file_(std::move(file)),
      writer_(std::move(writer)),
      bytes_(memory_bytes),
      frames_(kFrameHeads),
      poses_(kSampleRing),
      blocks_(kSampleRing) {}

void SessionRecorder::start(ThreadLauncher& threads) {
  thread_ = threads.launch("recorder", ThreadRole::kHousekeeping, [this] { run(); });
}

void SessionRecorder::stop() {
  if (!thread_.joinable()) return;
  ending_.store(true, std::memory_order_relaxed);
  wakeup_.post();
  thread_.join();
}

void SessionRecorder::frame(const CameraFrame& frame) noexcept {
  const RealtimeScope realtime;
  // A capture after the arrival is a broken stamp: the pipeline drops such a frame, and no replay could deliver it.
  if (stopped_.load(std::memory_order_relaxed) || frame.stamp.capture > frame.stamp.arrival) {
    return frames_refused_.add();
  }
  // The bytes first: once the head is seen they are there. So room for the head is made sure of before; what the other
  // thread has taken meanwhile only makes more.
  if (frames_put_ - frames_taken_.get() >= kFrameHeads || !bytes_.push(frame.bytes)) return frames_refused_.add();
  FrameHead head{frame, frame.bytes.size()};
  head.frame.bytes = {};
  static_cast<void>(frames_.push(head));
  ++frames_put_;
}

void SessionRecorder::pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  if (stopped_.load(std::memory_order_relaxed) || !poses_.push(sample)) poses_refused_.add();
}

void SessionRecorder::ecg(const EcgBlock& block) noexcept {
  const RealtimeScope realtime;
  if (stopped_.load(std::memory_order_relaxed) || !blocks_.push(block)) blocks_refused_.add();
}

SessionRecorder::Summary SessionRecorder::summary() const noexcept {
  return {stopped_.load(std::memory_order_relaxed), recorded_.get(), frames_refused_.get() + frames_unwritten_.get(),
          poses_refused_.get() + blocks_refused_.get() + other_unwritten_.get()};
}

std::string SessionRecorder::reason() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

void SessionRecorder::run() {
  Instant flushed = MonotonicClock::now();
  for (;;) {
    // Asked before draining: what the devices gave before stop() is then drained after it.
    const bool ending = ending_.load(std::memory_order_relaxed);
    const Instant now = MonotonicClock::now();
    drain(ending ? Instant::max() : now - kBehind);
    if (ending) break;
    if (now - flushed >= kFlushAfter && !stopped_.load(std::memory_order_relaxed)) {
      if (const auto done = writer_.flush(); !done) give_up(done.error());
      flushed = now;
    }
    static_cast<void>(wakeup_.wait_until(now + kTick));
  }
  if (stopped_.load(std::memory_order_relaxed)) return;
  if (const auto done = writer_.finish(); !done) give_up(done.error());
}

template <class Front, class Ring>
void SessionRecorder::refill(std::optional<Front>& front, Ring& ring) {
  Front next;
  if (!front && ring.pop(next)) front = next;
}

void SessionRecorder::drain(Instant until) {
  for (;;) {
    if (!front_frame_) {
      refill(front_frame_, frames_);
      if (front_frame_) frames_taken_.add();
    }
    refill(front_pose_, poses_);
    refill(front_block_, blocks_);
    Instant first = Instant::max();
    if (front_frame_) first = std::min(first, front_frame_->frame.stamp.arrival);
    if (front_pose_) first = std::min(first, front_pose_->arrival);
    if (front_block_) first = std::min(first, front_block_->arrival);
    if (first == Instant::max() || first > until) return;
    write_front(first);
  }
}

// One that comes after later ones were written, its thread having slept for longer than we are behind, is written as
// arrived with them: a replay keeps to the order.
void SessionRecorder::write_front(Instant arrival) {
  last_arrival_ = std::max(last_arrival_, arrival);
  const bool stopped = stopped_.load(std::memory_order_relaxed);
  Expected<void> written;
  Counter* unwritten = &other_unwritten_;
  if (front_frame_ && front_frame_->frame.stamp.arrival == arrival) {
    unwritten = &frames_unwritten_;
    frame_bytes_.resize(front_frame_->size);
    bytes_.pop(frame_bytes_);
    front_frame_->frame.bytes = frame_bytes_;
    if (!stopped) written = writer_.write(front_frame_->frame, last_arrival_);
    front_frame_.reset();
  } else if (front_pose_ && front_pose_->arrival == arrival) {
    if (!stopped) written = writer_.write(*front_pose_, last_arrival_);
    front_pose_.reset();
  } else {
    if (!stopped) written = writer_.write(*front_block_, last_arrival_);
    front_block_.reset();
  }
  if (!written) give_up(written.error());
  if (stopped || !written) {
    unwritten->add();
  } else {
    recorded_.add();
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

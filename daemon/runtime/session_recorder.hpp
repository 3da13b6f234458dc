// Records what the devices give while they give it, off the real-time path.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "core/error/expected.hpp"
#include "core/realtime/counter.hpp"
#include "core/realtime/spsc_byte_ring.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/r_trigger_pulse.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "daemon/runtime/thread_launcher.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {

// A frame on its way to the writing thread without its bytes, which go another way in the same order.
struct RecordedFrameHead {
  CameraFrame frame;
  std::size_t size = 0;
};

// Each device's thread copies into a ring of its own; one thread writes, a quarter of a second behind, so that it has
// them in order of arrival. What finds no room, because the disk does not keep up, is counted, and so is everything
// after an error of the disk, which ends the recording and nothing else. One file may follow another; between them,
// what the devices give is not asked for, and not counted.
class SessionRecorder {
 public:
  // `memory_bytes`: for frames on their way to the disk. The file must not be there yet. SIGXFSZ is ignored from now
  // on: a file that may not grow is an error like a full disk.
  [[nodiscard]] static Expected<std::unique_ptr<SessionRecorder>> create(const std::filesystem::path& file,
                                                                         const SensorRecordingFacts& facts,
                                                                         std::size_t memory_bytes);
  // Records nothing yet, and takes that memory when it first does.
  explicit SessionRecorder(std::size_t memory_bytes);
  SessionRecorder(const SessionRecorder&) = delete;
  SessionRecorder& operator=(const SessionRecorder&) = delete;
  ~SessionRecorder() { stop(); }

  void start(ThreadLauncher& threads);
  // After the devices' threads have ended: writes what is left and ends the file. Called twice it does nothing.
  void stop();

  // Both from one thread at a time, while the devices go on. open(): what arrives from now on goes to this file, which
  // must not be there yet; an error when a file is open already. An error to begin counts as a recording that has
  // stopped.
  [[nodiscard]] Expected<void> open(const std::filesystem::path& file, const SensorRecordingFacts& facts);
  // Writes what has arrived and ends the file; an error when there is none, or when it could not be ended whole.
  [[nodiscard]] Expected<void> close();

  // Each of one thread. None of them blocks or allocates.
  void frame(const CameraFrame& frame) noexcept;
  void pose(const TrackerSample& sample) noexcept;
  void tool(const ToolSample& sample) noexcept;
  void ecg(const EcgBlock& block) noexcept;
  void r_trigger(const RTriggerPulse& pulse) noexcept;
  void respiration(const RespirationBlock& block) noexcept;

  struct Summary {
    bool asked = false;       // it is to record
    bool stopped = false;     // but does not, by an error; reason() says which
    std::uint64_t files = 0;  // opened so far; the counts below are of all of them
    std::uint64_t recorded = 0;
    std::uint64_t frames_not_recorded = 0;
    std::uint64_t other_not_recorded = 0;
  };
  [[nodiscard]] Summary summary() const noexcept;
  // Empty while all is well.
  [[nodiscard]] std::string reason() const;
  // The last one; empty before the first.
  [[nodiscard]] std::filesystem::path file() const;

 private:
  // What one device's thread gives, on its way to the writing thread.
  template <class Sample>
  struct Lane {
    explicit Lane(std::size_t capacity) : ring(capacity) {}

    SpscRing<Sample> ring;
    Counter refused;              // by the device's thread
    std::optional<Sample> front;  // of the writing thread: taken from the ring, not written yet
  };

  template <class Sample>
  void enqueue(Lane<Sample>& lane, const Sample& sample) noexcept;
  void run();
  void finish_file();
  // Writes what arrived until then.
  void drain(Instant until);
  void write_front(Instant arrival);
  [[nodiscard]] Expected<void> write_frame(bool wanted);
  void give_up(const Error& error);

  std::size_t memory_bytes_;
  std::optional<SpscByteRing> bytes_;  // there before a frame is accepted
  Lane<RecordedFrameHead> frames_;
  std::tuple<Lane<TrackerSample>, Lane<ToolSample>, Lane<EcgBlock>, Lane<RTriggerPulse>, Lane<RespirationBlock>>
      others_;

  // Of the writing thread: where it writes, none between two files.
  std::optional<SensorWriter> writer_;
  Instant opened_;
  std::vector<std::byte> frame_bytes_;
  Instant last_arrival_{};
  Instant flushed_;

  std::uint64_t frames_put_ = 0;  // of the camera's thread
  Counter frames_taken_;          // by the writing thread
  Counter recorded_;
  Counter frames_unwritten_, other_unwritten_;  // by the writing thread
  // Release by open() when all is there that a device's thread touches, acquire by those threads.
  std::atomic<bool> accepting_{false};
  // Relaxed: each is a message by itself.
  std::atomic<bool> asked_{false};
  std::atomic<bool> stopped_{false};
  std::atomic<bool> ending_{false};
  std::atomic<bool> running_{false};  // there is a writing thread, or will be at once
  Counter files_;
  // Of what open() and close() ask the writing thread, and of what is told to others.
  mutable std::mutex mutex_;
  std::condition_variable answered_;
  std::optional<SensorWriter> next_writer_;
  Instant next_opened_{};
  bool closing_ = false;
  std::filesystem::path file_;
  std::string reason_;
  Wakeup wakeup_;
  std::thread thread_;
};

}  // namespace perimap

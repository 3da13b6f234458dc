// Records what the devices give while they give it, off the real-time path.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/error/expected.hpp"
#include "core/realtime/counter.hpp"
#include "core/realtime/spsc_byte_ring.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "daemon/runtime/thread_launcher.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {

// Each device's thread copies into a ring of its own; one thread writes, a quarter of a second behind, so that it has
// them in order of arrival. What finds no room, because the disk does not keep up, is counted, and so is everything
// after an error of the disk, which ends the recording and nothing else.
class SessionRecorder {
 public:
  // `memory_bytes`: for frames on their way to the disk. The file must not be there yet. SIGXFSZ is ignored from now
  // on: a file that may not grow is an error like a full disk.
  [[nodiscard]] static Expected<std::unique_ptr<SessionRecorder>> create(const std::filesystem::path& file,
                                                                         const SensorRecordingFacts& facts,
                                                                         std::size_t memory_bytes);
  SessionRecorder(const SessionRecorder&) = delete;
  SessionRecorder& operator=(const SessionRecorder&) = delete;
  ~SessionRecorder() { stop(); }

  void start(ThreadLauncher& threads);
  // After the devices' threads have ended: writes what is left and ends the file. Called twice it does nothing.
  void stop();

  // Each of one thread. None of them blocks or allocates.
  void frame(const CameraFrame& frame) noexcept;
  void pose(const TrackerSample& sample) noexcept;
  void ecg(const EcgBlock& block) noexcept;

  struct Summary {
    bool stopped = false;  // by an error; reason() says which
    std::uint64_t recorded = 0;
    std::uint64_t frames_not_recorded = 0;
    std::uint64_t other_not_recorded = 0;
  };
  [[nodiscard]] Summary summary() const noexcept;
  // Empty while all is well.
  [[nodiscard]] std::string reason() const;
  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }

 private:
  // A frame without its bytes, which are in bytes_ in the same order.
  struct FrameHead {
    CameraFrame frame;
    std::size_t size = 0;
  };

  SessionRecorder(std::filesystem::path file, SensorWriter writer, std::size_t memory_bytes);

  void run();
  // Writes what arrived until then.
  void drain(Instant until);
  void write_front(Instant arrival);
  void give_up(const Error& error);
  template <class Front, class Ring>
  static void refill(std::optional<Front>& front, Ring& ring);

  std::filesystem::path file_;
  SensorWriter writer_;
  SpscByteRing bytes_;
  SpscRing<FrameHead> frames_;
  SpscRing<TrackerSample> poses_;
  SpscRing<EcgBlock> blocks_;

  // Of the writing thread: taken from the rings, not written yet.
  std::optional<FrameHead> front_frame_;
  std::optional<TrackerSample> front_pose_;
  std::optional<EcgBlock> front_block_;
  std::vector<std::byte> frame_bytes_;
  Instant last_arrival_{};

  std::uint64_t frames_put_ = 0;  // of the camera's thread
  Counter frames_taken_;          // by the writing thread
  Counter recorded_;
  Counter frames_refused_, poses_refused_, blocks_refused_;  // each by its device's thread
  Counter frames_unwritten_, other_unwritten_;               // by the writing thread
  // Relaxed: each is a message by itself.
  std::atomic<bool> stopped_{false};
  std::atomic<bool> ending_{false};
  mutable std::mutex mutex_;  // of reason_
  std::string reason_;
  Wakeup wakeup_;
  std::thread thread_;
};

}  // namespace perimap

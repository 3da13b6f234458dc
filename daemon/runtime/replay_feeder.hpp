// Plays a recording into the pipeline's entrance at its recorded pace: the stand-in for the device threads.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "core/error/expected.hpp"
#include "daemon/runtime/sensor_feeder.hpp"
#include "daemon/runtime/sensor_intake.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

// What becomes of an event that was read.
enum class ReplayStep { kDeliver, kSkip, kEnd };
// May change it. Called in the recording's order by the thread that reads ahead.
using ReplayEdit = std::function<ReplayStep(ReplayEvent&)>;

// One thread reads ahead from the disk, one sleeps to each arrival and pushes. All instants are moved by one offset,
// which brings the first arrival to shortly after start() when it is not given.
class ReplayFeeder final : public SensorFeeder {
 public:
  ReplayFeeder(ReplayReader reader, const SensorIntake& intake, std::optional<Duration> offset = std::nullopt,
               ReplayEdit edit = {});
  ReplayFeeder(const ReplayFeeder&) = delete;
  ReplayFeeder& operator=(const ReplayFeeder&) = delete;
  ~ReplayFeeder() override { stop(); }

  void give_tools_to(ToolTeller* tools) override { intake_.tools = tools; }
  void start(ThreadLauncher& threads) override;
  void stop() override;

  // All events are delivered, or reading failed.
  [[nodiscard]] bool ended() const noexcept override { return ended_.load(std::memory_order_acquire); }
  // Why reading failed; to be asked after ended().
  [[nodiscard]] const std::optional<Error>& error() const noexcept override { return error_; }
  // What was damaged in the recording; to be asked after ended().
  [[nodiscard]] std::vector<Error> damage() const override { return reader_.damage(); }

 private:
  void read_ahead();
  void deliver();
  [[nodiscard]] std::optional<ReplayEvent> next_event();

  ReplayReader reader_;
  SensorIntake intake_;
  std::optional<Duration> offset_;
  ReplayEdit edit_;
  std::thread reading_;
  std::thread delivering_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ReplayEvent> ahead_;
  bool read_all_ = false;
  bool stopping_ = false;
  std::optional<Error> error_;  // written before read_all_ is set under the mutex

  // Release when the last event is delivered, acquire in ended(): error_ and the reader's state are then visible.
  std::atomic<bool> ended_{false};
};

}  // namespace perimap

// The receiving side of `perimap watch`: the thread that empties its readers.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/dds/sample_readers.hpp"
#include "daemon/evaluation/watch/watch_statistics.hpp"
#include "daemon/publishing/sample_recorder.hpp"

namespace perimap {

// Starts its thread when made and ends it when destroyed. Samples are stamped when the thread wakes up.
class SampleReceiver {
 public:
  struct Limits {
    std::uint64_t surfaces = 0;       // stops after so many; 0: none
    bool keep_first_surface = false;  // as JSON
  };

  SampleReceiver(SampleReaders readers, std::optional<SampleRecorder> recorder, Limits limits);
  SampleReceiver(const SampleReceiver&) = delete;
  SampleReceiver& operator=(const SampleReceiver&) = delete;
  ~SampleReceiver();

  [[nodiscard]] std::uint64_t surfaces();
  [[nodiscard]] std::vector<StreamReport> take_interval(Duration length);
  [[nodiscard]] std::vector<StreamReport> totals();
  [[nodiscard]] std::string first_surface();
  // The thread has ended: the limit was reached, or an error came, which finish() tells.
  [[nodiscard]] bool ended();

  // Ends the thread and closes the recording.
  [[nodiscard]] Expected<void> finish();

 private:
  void receive();
  [[nodiscard]] bool limit_reached() const {
    return limits_.surfaces > 0 && statistics_.surfaces() >= limits_.surfaces;
  }
  // Takes what one reader holds and hands each sample on.
  template <class T, class Use>
  void receive_samples(dds::Reader<T>& reader, Instant receipt, Use use);

  SampleReaders readers_;
  std::optional<SampleRecorder> recorder_;
  Limits limits_;
  std::mutex mutex_;  // guards all below
  WatchStatistics statistics_;
  std::string first_surface_;
  Expected<void> result_;
  bool ended_ = false;
  std::jthread thread_;
};

}  // namespace perimap

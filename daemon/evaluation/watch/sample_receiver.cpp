#include "daemon/evaluation/watch/sample_receiver.hpp"

#include <pthread.h>

#include <utility>

#include "daemon/evaluation/watch/watch_report.hpp"

namespace perimap {

SampleReceiver::SampleReceiver(SampleReaders readers, std::optional<SampleRecorder> recorder, Limits limits)
    : readers_(std::move(readers)), recorder_(std::move(recorder)), limits_(limits), thread_([this] { receive(); }) {}

SampleReceiver::~SampleReceiver() { readers_.wait_set.stop(); }

std::uint64_t SampleReceiver::surfaces() {
  const std::lock_guard lock(mutex_);
  return statistics_.surfaces();
}

std::vector<StreamReport> SampleReceiver::take_interval(Duration length) {
  const std::lock_guard lock(mutex_);
  return statistics_.take_interval(length);
}

std::vector<StreamReport> SampleReceiver::totals() {
  const std::lock_guard lock(mutex_);
  return statistics_.totals();
}

std::string SampleReceiver::first_surface() {
  const std::lock_guard lock(mutex_);
  return first_surface_;
}

bool SampleReceiver::ended() {
  const std::lock_guard lock(mutex_);
  return ended_;
}

Expected<void> SampleReceiver::finish() {
  readers_.wait_set.stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  if (recorder_) {
    if (auto closed = recorder_->finish(); !closed) result_ = std::move(closed);
  }
  return result_;
}

template <class T, class Use>
void SampleReceiver::receive_samples(dds::Reader<T>& reader, Instant receipt, Use use) {
  const Expected<dds::Loan<T>> loan = reader.take();
  if (!loan) {
    result_ = tl::unexpected(loan.error());
    return;
  }
  for (std::size_t i = 0; i < loan->size() && result_ && !limit_reached(); ++i) {
    const T* sample = loan->sample(i);
    if (sample == nullptr) {
      continue;
    }
    use(*sample, loan->info(i).publication_handle);
    if (recorder_) {
      result_ = recorder_->write(*sample, receipt);
    }
  }
}

void SampleReceiver::receive() {
  pthread_setname_np(pthread_self(), "watch");
  while (readers_.wait_set.wait()) {
    const Instant receipt = MonotonicClock::now();
    const std::lock_guard lock(mutex_);
    receive_samples(readers_.surfaces, receipt, [&](const perimap_Surface& surface, std::uint64_t writer) {
      if (limits_.keep_first_surface && statistics_.surfaces() == 0) {
        first_surface_ = surface_json(surface, receipt);
      }
      statistics_.add(surface, receipt, writer);
    });
    receive_samples(readers_.statuses, receipt, [&](const perimap_Status& status, std::uint64_t writer) {
      statistics_.hear(status, receipt, writer);
      statistics_.add(status);
    });
    if (readers_.tools) {
      receive_samples(*readers_.tools, receipt,
                      [&](const perimap_ToolDistance& tool, std::uint64_t) { statistics_.add(tool); });
    }
    if (recorder_) {
      receive_samples(readers_.models, receipt, [](const perimap_SurfaceModel&, std::uint64_t) {});
      receive_samples(readers_.meshes, receipt, [](const perimap_SurfaceMesh&, std::uint64_t) {});
      receive_samples(readers_.phases, receipt, [](const perimap_Phase&, std::uint64_t) {});
    }
    if (limit_reached() || !result_) {
      break;
    }
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
}

}  // namespace perimap

#include "daemon/evaluation/watch/sample_receiver.hpp"

#include <pthread.h>

#include <utility>

#include "daemon/evaluation/watch/watch_report.hpp"

namespace perimap {

Expected<SampleReaders> SampleReaders::create(const dds::Membership& membership, bool all_topics) {
  auto participant = dds::Participant::create(membership);
  if (!participant) {
    return tl::unexpected(participant.error());
  }
  auto surfaces = dds::Reader<perimap_Surface>::create(*participant);
  auto models = dds::Reader<perimap_SurfaceModel>::create(*participant);
  auto meshes = dds::Reader<perimap_SurfaceMesh>::create(*participant);
  auto phases = dds::Reader<perimap_Phase>::create(*participant);
  auto statuses = dds::Reader<perimap_Status>::create(*participant);
  auto wait_set = dds::WaitSet::create(*participant);
  const auto error_of = [](const auto& result) { return result ? Error{} : result.error(); };
  for (const Error& error : {error_of(surfaces), error_of(models), error_of(meshes), error_of(phases),
                             error_of(statuses), error_of(wait_set)}) {
    if (!error.message.empty()) {
      return tl::unexpected(error);
    }
  }
  std::vector<dds_entity_t> conditions{surfaces->condition(), statuses->condition()};
  if (all_topics) {
    conditions.insert(conditions.end(), {models->condition(), meshes->condition(), phases->condition()});
  }
  for (const dds_entity_t condition : conditions) {
    if (auto attached = wait_set->attach(condition); !attached) {
      return tl::unexpected(attached.error());
    }
  }
  return SampleReaders{std::move(*participant), std::move(*surfaces), std::move(*models),  std::move(*meshes),
                       std::move(*phases),      std::move(*statuses), std::move(*wait_set)};
}

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

#include "daemon/evaluation/watch/watch_statistics.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

double largest_deviation_mm(const double (&covariance)[6]) {
  Eigen::Matrix3d P;
  P << covariance[0], covariance[1], covariance[2],  //
      covariance[1], covariance[3], covariance[4],   //
      covariance[2], covariance[4], covariance[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(P, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
}

SurfaceDigest digest(const perimap_Surface& surface) {
  SurfaceDigest digest;
  digest.sample_sequence = surface.sample_sequence;
  digest.state = surface.state;
  digest.reason = surface.reason;
  digest.cardiac_phase_rad = surface.cardiac_phase_rad;
  digest.cardiac_phase_deviation_rad = surface.cardiac_phase_deviation_rad;
  digest.cardiac_phase_rate_rad_per_s = surface.cardiac_phase_rate_rad_per_s;
  digest.uses = uses_of(surface);
  std::vector<double> deviations_mm;
  for (std::uint32_t i = 0; i < surface.features._length; ++i) {
    const perimap_SurfaceFeature& feature = surface.features._buffer[i];
    const auto state = static_cast<std::size_t>(feature.state);
    if (state < digest.features.size()) {
      ++digest.features[state];
    }
    if (feature.state != perimap_FEATURE_INVALID) {
      deviations_mm.push_back(largest_deviation_mm(feature.covariance_W_mm2));
    }
  }
  if (!deviations_mm.empty()) {
    digest.median_deviation_mm = upper_median(deviations_mm.begin(), deviations_mm.end());
  }
  return digest;
}

}  // namespace

SurfaceDigest WatchStatistics::add(const perimap_Surface& surface, Instant receipt, std::uint64_t writer) {
  Stream& stream = streams_[{surface.source, surface.stream}];
  ++surfaces_;
  stream.hearing = publishers_[surface.source].hear(surface, writer, to_ns(receipt));
  const bool contested =
      stream.hearing == client::Hearing::kTwoPublishers || stream.hearing == client::Hearing::kImplausible;
  const Instant release = from_ns(surface.release_time_ns);
  const bool first = !stream.last;
  const bool another_run = std::memcmp(stream.last_run.data(), surface.run_id, stream.last_run.size()) != 0;
  const bool restarted = !first && (another_run || surface.sample_sequence <= stream.last->sample_sequence);
  for (Tally* tally : {&stream.interval, &stream.total}) {
    ++tally->received;
    tally->expired += receipt > from_ns(surface.valid_until_ns) ? 1 : 0;
    tally->latency.add(receipt - from_ns(surface.capture_time_ns));
    tally->lateness.add(std::max(receipt - release, Duration(0)));
    tally->contested += contested ? 1 : 0;
    // Of two at once, what is missing or began anew would mean nothing; nor do numbers that jump.
    if (stream.hearing == client::Hearing::kTwoPublishers || (contested && !restarted)) continue;
    if (restarted) {
      ++tally->restarts;
    } else if (!first) {
      tally->missing += surface.sample_sequence - stream.last->sample_sequence - 1;
      tally->jitter.add(std::chrono::abs((receipt - stream.last_receipt) - (release - stream.last_release)));
    }
  }
  if (first) {
    stream.first_receipt = receipt;
  }
  stream.last_receipt = receipt;
  stream.last_release = release;
  std::copy_n(surface.run_id, stream.last_run.size(), stream.last_run.begin());
  stream.last = digest(surface);
  return *stream.last;
}

void WatchStatistics::hear(const perimap_Status& status, Instant receipt, std::uint64_t writer) {
  static_cast<void>(publishers_[status.source].hear(status, writer, to_ns(receipt)));
}

void WatchStatistics::add(const perimap_Status& status) {
  StatusDigest digest;
  digest.stages.assign(status.stages._buffer, status.stages._buffer + status.stages._length);
  digest.sources.assign(status.sources._buffer, status.sources._buffer + status.sources._length);
  digest.status = status;
  digest.status.sources = {};
  digest.status.stages = {};
  streams_[{status.source, status.stream}].status = std::move(digest);
}

void WatchStatistics::add(const perimap_ToolDistance& tool) {
  Tool& kept = tools_[{tool.source, tool.tool}];
  for (ToolReport* report : {&kept.interval, &kept.total}) {
    const std::uint64_t before = kept.total.received > 0 ? report->last.sample_sequence : 0;
    const bool goes_on = before > 0 && tool.sample_sequence > before &&
                         std::memcmp(report->last.run_id, tool.run_id, sizeof tool.run_id) == 0;
    if (goes_on) report->missing += tool.sample_sequence - before - 1;
    ++report->received;
    report->last = tool;
  }
}

std::vector<ToolReport> WatchStatistics::tools_with(const Key& key, ToolReport Tool::*tally) const {
  std::vector<ToolReport> all;
  // "clock" comes before "frame".
  const auto next = std::next(streams_.find(key));
  if (next != streams_.end() && next->first.first == key.first) return all;
  for (const auto& [of, tool] : tools_) {
    if (of.first == key.first && (tool.*tally).received > 0) all.push_back(tool.*tally);
  }
  return all;
}

StreamReport WatchStatistics::report(const Key& key, const Stream& stream, const Tally& tally, Duration length) {
  return {key.first,
          key.second,
          length,
          tally.received,
          tally.missing,
          tally.restarts,
          tally.expired,
          tally.contested,
          stream.hearing,
          tally.latency.spread(),
          tally.lateness.spread(),
          tally.jitter.spread(),
          stream.last,
          stream.status,
          {}};
}

std::vector<StreamReport> WatchStatistics::take_interval(Duration length) {
  std::vector<StreamReport> reports;
  for (auto& [key, stream] : streams_) {
    reports.push_back(report(key, stream, std::exchange(stream.interval, {}), length));
    reports.back().tools = tools_with(key, &Tool::interval);
  }
  for (auto& [key, tool] : tools_) tool.interval.received = tool.interval.missing = 0;
  return reports;
}

std::vector<StreamReport> WatchStatistics::totals() const {
  std::vector<StreamReport> reports;
  for (const auto& [key, stream] : streams_) {
    reports.push_back(report(key, stream, stream.total, stream.last_receipt - stream.first_receipt));
    reports.back().tools = tools_with(key, &Tool::total);
  }
  return reports;
}

}  // namespace perimap

#include "daemon/black_box/black_box.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "drivers/json/json_text.hpp"

namespace perimap::black_box {
namespace {

using Json = nlohmann::ordered_json;

// Of the fastest clock and as fast a camera more than a tenth of a second; of 30 a second more than eight seconds.
constexpr std::size_t kBuffers = 256;
constexpr std::size_t kMostTold = 4096;
// What a killed process takes along at most.
constexpr Duration kRound = std::chrono::milliseconds(100);
// What a machine that loses its power takes along at most.
constexpr Duration kSynchronised = std::chrono::seconds(1);
constexpr Duration kTryAgain = std::chrono::seconds(1);

Stamp stamp() {
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  return {to_ns(MonotonicClock::now()), std::chrono::nanoseconds(utc).count()};
}

std::string hex_of_run(const RunId& run) {
  std::string text;
  for (const std::uint8_t byte : run) text += fmt::format("{:02x}", byte);
  return text;
}

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

BlackBox::BlackBox(BlackBoxSettings settings)
    : settings_(std::move(settings)), buffers_(kBuffers), free_(kBuffers), filled_(kBuffers) {
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    buffers_[i].features.resize(settings_.maximum_features);
    static_cast<void>(free_.push(i));
  }
}

BlackBox::~BlackBox() = default;

void BlackBox::surface(const perimap_Surface& sample) noexcept {
  std::size_t i = 0;
  if (sample.features._length > settings_.maximum_features || !free_.pop(i)) {
    surfaces_lost_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  Buffer& buffer = buffers_[i];
  buffer.at = stamp();
  buffer.sample = sample;
  std::copy_n(sample.features._buffer, sample.features._length, buffer.features.begin());
  buffer.sample.features._buffer = buffer.features.data();
  static_cast<void>(filled_.push(i));
}

void BlackBox::phase(const perimap_Phase& phase) {
  const auto bytes = told_serializer_.serialize(phase);
  if (bytes) tell(EntryKind::kPhase, text_of(*bytes), told_events_.see(phase).value_or(""));
}

void BlackBox::status(const perimap_Status& status) {
  const auto bytes = told_serializer_.serialize(status);
  if (bytes) tell(EntryKind::kStatus, text_of(*bytes), told_events_.see(status).value_or(""));
}

void BlackBox::configuration(std::string toml) { tell(EntryKind::kConfiguration, std::move(toml)); }

void BlackBox::command(std::string_view name, bool done, std::string_view answer) {
  // A program may ask for the status every second, and what it answers is in the statuses.
  const bool asks = name == "status";
  const Json told{{"command", name}, {"done", done}, {"answer", asks && done ? "" : answer}};
  tell(EntryKind::kCommand, json_line(told), asks ? std::string() : fmt::format("command {}", name));
}

void BlackBox::log_line(std::string_view severity, std::string_view line) {
  tell(EntryKind::kLog, fmt::format("{}: {}", severity, line));
}

void BlackBox::tell(EntryKind kind, std::string content, std::string event) {
  {
    const std::lock_guard lock(mutex_);
    if (told_.size() >= kMostTold) {
      ++others_lost_;
      return;
    }
    told_.push_back({kind, stamp(), std::move(content), std::move(event)});
  }
  told_or_stopping_.notify_one();
}

void BlackBox::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  told_or_stopping_.notify_one();
}

std::deque<BlackBox::Told> BlackBox::wait_for_told() {
  std::unique_lock lock(mutex_);
  told_or_stopping_.wait_for(lock, kRound, [this] { return stopping_ || !told_.empty(); });
  return std::exchange(told_, {});
}

void BlackBox::run() {
  bool last = false;
  while (!last) {
    {
      const std::lock_guard lock(mutex_);
      last = stopping_;
    }
    const std::deque<Told> told = wait_for_told();
    const bool ready = opened();
    write_surfaces();
    if (!ready) {
      not_written_ += told.size();
      for (const Told& one : told) {
        if (one.kind == EntryKind::kConfiguration) configuration_ = one.content;
      }
      continue;
    }
    for (const Told& one : told) write(one);
    write_lost();
    const bool event = std::any_of(told.begin(), told.end(), [](const Told& one) { return !one.event.empty(); });
    const Instant now = MonotonicClock::now();
    if (event || now - synchronised_ >= kSynchronised) {
      if (const auto done = ring_->synchronise(); !done) failed(done.error().message);
      synchronised_ = now;
    }
  }
  if (!ring_) return;
  if (const auto ended = ring_->end(kRunHasEnded); !ended) return failed(ended.error().message);
  spdlog::info("black box: ended with {}", hex_of(ring_->digest()));
}

bool BlackBox::opened() {
  if (ring_) return true;
  const Instant now = MonotonicClock::now();
  if (now < try_again_) return false;
  try_again_ = now + kTryAgain;
  SegmentHeader whose;
  whose.program = settings_.program;
  whose.source = settings_.identity.source;
  whose.run = hex_of_run(settings_.identity.run_id);
  auto ring = SegmentRing::open(settings_.folder, settings_.limits, std::move(whose), stamp);
  if (!ring) {
    failed(ring.error().message);
    return false;
  }
  ring_.emplace(std::move(*ring));
  spdlog::info("black box: {}, goes on from {}", settings_.folder.string(), hex_of(ring_->digest()));
  if (!configuration_.empty()) note(ring_->write_configuration(stamp(), configuration_));
  write_event(stamp(), "perimapd has begun");
  return true;
}

void BlackBox::write_surfaces() {
  std::size_t i = 0;
  while (filled_.pop(i)) {
    const Buffer& buffer = buffers_[i];
    if (ring_) {
      if (const auto bytes = serializer_.serialize(buffer.sample)) {
        write_entry({EntryKind::kSurface, buffer.at, text_of(*bytes)});
      }
      if (const auto event = surface_events_.see(buffer.sample)) write_event(buffer.at, *event);
    } else {
      ++not_written_;
    }
    static_cast<void>(free_.push(i));
  }
}

void BlackBox::write(const Told& told) {
  if (told.kind == EntryKind::kConfiguration) {
    note(ring_->write_configuration(told.at, told.content));
  } else {
    write_entry({told.kind, told.at, told.content});
  }
  if (!told.event.empty()) write_event(told.at, told.event);
}

void BlackBox::write_event(const Stamp& at, std::string_view what) {
  ring_->keep_around_now();
  const std::string told = json_line(Json{{"event", what}});
  write_entry({EntryKind::kEvent, at, told});
}

void BlackBox::write_entry(const Entry& entry) {
  note(ring_->write(entry));
  for (const std::string& finding : ring_->take_findings()) {
    spdlog::warn("black box: {}", finding);
    write_event(stamp(), finding);
  }
}

void BlackBox::note(const Expected<void>& written) {
  if (!written) {
    ++not_written_;
    failed(written.error().message);
  } else if (!std::exchange(failure_, {}).empty()) {
    spdlog::info("black box: written again");
  }
}

// After what could be written again.
void BlackBox::write_lost() {
  const std::uint64_t surfaces = surfaces_lost_.load(std::memory_order_relaxed);
  std::uint64_t others = 0;
  {
    const std::lock_guard lock(mutex_);
    others = others_lost_;
  }
  const std::uint64_t lost = surfaces + others + not_written_;
  if (lost == lost_told_) return;
  const std::uint64_t before = not_written_;
  const std::string told = json_line(Json{{"no_room", surfaces + others}, {"not_written", not_written_}});
  write_entry({EntryKind::kLost, stamp(), told});
  // Else it is told with the next entry that is written.
  if (not_written_ == before) lost_told_ = lost;
}

void BlackBox::failed(const std::string& message) {
  if (std::exchange(failure_, message) != message) spdlog::error("black box: {}; all else goes on", message);
}

}  // namespace perimap::black_box

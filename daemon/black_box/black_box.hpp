// The black box: what happened in the last minutes, and around each event, written by a thread of its own.
#pragma once

#include <perimap.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/realtime/spsc_ring.hpp"
#include "core/time/instant.hpp"
#include "daemon/black_box/event_watch.hpp"
#include "daemon/black_box/segment_ring.hpp"
#include "daemon/publishing/identity.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap::black_box {

struct BlackBoxSettings {
  std::filesystem::path folder;
  RingLimits limits;
  std::string program;  // and its version
  Identity identity;
  std::size_t maximum_features = 0;
};

// What is told goes into queues of fixed length; what finds no room is counted and told. A disk that fails is told once
// and tried again; nothing else waits for it.
class BlackBox {
 public:
  explicit BlackBox(BlackBoxSettings settings);
  BlackBox(const BlackBox&) = delete;
  BlackBox& operator=(const BlackBox&) = delete;
  ~BlackBox();

  // The real-time thread that publishes: copies into a free buffer.
  void surface(const perimap_Surface& sample) noexcept;
  // One thread, which is not that one.
  void phase(const perimap_Phase& phase);
  void status(const perimap_Status& status);
  // Any thread but those of the real-time path.
  void configuration(std::string toml);
  void command(std::string_view name, bool done, std::string_view answer);
  void log_line(std::string_view severity, std::string_view line);

  // Writes on the calling thread until stop(), and then what is left and the end.
  void run();
  void stop();

 private:
  struct Told {
    EntryKind kind;
    Stamp at;
    std::string content;
    std::string event;  // for which what lies around it is kept; empty: none
  };
  struct Buffer {
    Stamp at;
    perimap_Surface sample{};
    std::vector<perimap_SurfaceFeature> features;
  };

  void tell(EntryKind kind, std::string content, std::string event = {});
  [[nodiscard]] std::deque<Told> wait_for_told();
  void write_surfaces();
  void write(const Told& told);
  void write_entry(const Entry& entry);
  void write_event(const Stamp& at, std::string_view what);
  void note(const Expected<void>& written);
  void write_lost();
  // Whether there is a folder to write to; tried again now and then.
  [[nodiscard]] bool opened();
  void failed(const std::string& message);

  BlackBoxSettings settings_;
  std::vector<Buffer> buffers_;
  SpscRing<std::size_t> free_;
  SpscRing<std::size_t> filled_;
  // Relaxed: counts that announce nothing but themselves.
  std::atomic<std::uint64_t> surfaces_lost_{0};

  std::mutex mutex_;  // of what follows
  std::condition_variable told_or_stopping_;
  std::deque<Told> told_;
  std::uint64_t others_lost_ = 0;
  bool stopping_ = false;

  CdrSerializer told_serializer_;  // of the thread that tells phase and status
  EventWatch told_events_;         // likewise
  CdrSerializer serializer_;       // of run(), as is what follows
  EventWatch surface_events_;
  std::optional<SegmentRing> ring_;
  std::string configuration_;
  std::uint64_t not_written_ = 0;
  std::uint64_t lost_told_ = 0;
  std::string failure_;  // as it was told; empty: none
  Instant try_again_;
  Instant synchronised_;
};

}  // namespace perimap::black_box

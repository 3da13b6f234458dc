// For navigation software: whether all that is heard of a source comes from one publisher, and is plausible.
//
//   perimap::client::PublisherWatch watch;       // one for each source that is followed, for all of its topics
//   const auto heard = watch.hear(*surface, info.publication_handle, now_ns);
//   if (heard == perimap::client::Hearing::kUse) use(*surface); else show(describe(heard));
//
// Needs C++17, the C types that idlc makes of perimap.idl, perimap_mesh.idl and perimap_tool.idl, and nothing else. It
// keeps no memory but its own and calls nothing; one thread at a time.
//
// In a domain without DDS Security anyone can publish under any name. Who does is told by the writer, which DDS knows
// (dds_sample_info_t::publication_handle; 0 where it is not known), and by the run that each sample names. Nothing is
// used until for one second all that was heard was of one writer and one run, with sequence numbers and times that
// follow upon each other: not at the beginning, not after a restart, and not of either of two publishers, however long
// both of them go on; nor for a second after perimapd has said itself that there are two. A topic that is heard for the
// first time is listened to by itself.
//
// A false publisher that is alone from the beginning can not be told from a true one by this, nor one that forges DDS'
// own identities (GUIDs) below DDS: for that there is DDS Security.
#pragma once

#include <perimap.h>
#include <perimap_mesh.h>
#include <perimap_tool.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

namespace perimap::client {

enum class Hearing : std::uint8_t {
  kUse,            // one publisher, heard long enough
  kListening,      // the first second
  kAnotherBegan,   // of a publisher that was not heard before: a restart, or a second one
  kTwoPublishers,  // two at least, in turn
  kImplausible     // this sample, or one of the last second, does not follow upon those before it, or has figures that
                   // are no numbers
};

// For people; never null.
inline const char* describe(Hearing hearing) noexcept {
  switch (hearing) {
    case Hearing::kUse:
      return "one publisher";
    case Hearing::kListening:
      return "listening whether there is one publisher";
    case Hearing::kAnotherBegan:
      return "another publisher, or another run, began a moment ago";
    case Hearing::kTwoPublishers:
      return "TWO PUBLISHERS of this source: use neither";
    case Hearing::kImplausible:
      return "samples that contradict each other: use none";
  }
  return "not known";
}

class PublisherWatch {
 public:
  // So long must one have been heard alone.
  static constexpr std::int64_t kAlone_ns = 1'000'000'000;

  // A sample as it was received, in the order of receipt. `writer`: whatever tells one writer from another. `now_ns`: a
  // monotonic clock of this host. The answer is about this very sample.
  Hearing hear(const perimap_Surface& sample, std::uint64_t writer, std::int64_t now_ns) noexcept {
    return hear({sample.run_id, kSurfaces, writer},
                {of_clock(sample.stream), sample.sample_sequence, sample.release_time_ns}, plausible(sample), now_ns);
  }
  Hearing hear(const perimap_SurfaceModel& sample, std::uint64_t writer, std::int64_t now_ns) noexcept {
    return hear({sample.run_id, kModels, writer}, {of_clock(sample.stream), sample.sample_sequence, sample.time_ns},
                plausible(sample), now_ns);
  }
  Hearing hear(const perimap_SurfaceMesh& sample, std::uint64_t writer, std::int64_t now_ns) noexcept {
    return hear({sample.run_id, kMeshes, writer}, {0, sample.sample_sequence, sample.time_ns}, plausible(sample),
                now_ns);
  }
  Hearing hear(const perimap_ToolDistance& sample, std::uint64_t writer, std::int64_t now_ns) noexcept {
    return hear({sample.run_id, kTools, writer}, {lane_of_tool(sample, now_ns), sample.sample_sequence, sample.time_ns},
                plausible(sample), now_ns);
  }
  Hearing hear(const perimap_Phase& sample, std::uint64_t writer, std::int64_t now_ns) noexcept {
    return hear({sample.run_id, kPhases, writer}, {of_clock(sample.stream), sample.sample_sequence, sample.time_ns},
                std::isfinite(sample.cardiac_phase_rad) && std::isfinite(sample.cardiac_phase_rate_rad_per_s), now_ns);
  }
  Hearing hear(const perimap_Status& sample, std::uint64_t writer, std::int64_t now_ns) noexcept {
    hear({sample.run_id, kStatuses, writer}, {of_clock(sample.stream), sample.sample_sequence, sample.time_ns}, true,
         now_ns);
    // What perimapd itself has noticed, be it in a topic that is not listened to here.
    if (sample.two_publishers) {
      alone_since_ns_ = now_ns;
      why_not_ = Hearing::kTwoPublishers;
    }
    return state(now_ns);
  }

  // What holds at `now_ns`, without another sample.
  [[nodiscard]] Hearing state(std::int64_t now_ns) const noexcept {
    return !heard_any_ ? Hearing::kListening : now_ns - alone_since_ns_ >= kAlone_ns ? Hearing::kUse : why_not_;
  }

 private:
  enum Topic : std::size_t { kSurfaces, kModels, kMeshes, kPhases, kStatuses, kTools, kTopics };
  // Each tool has sequence numbers of its own. Of more of them than this that are heard in turn those are not compared.
  static constexpr std::size_t kToolLanes = 16;
  static constexpr std::size_t kStreams = 2;
  static constexpr std::int64_t kMeshAlone_ns = 3 * kAlone_ns;  // one comes a second
  static constexpr std::size_t kRemembered = 4;
  static constexpr std::int64_t kForgotten_ns = 60 * kAlone_ns;
  static constexpr std::int64_t kTimeSlack_ns = 5'000'000'000;
  static constexpr std::uint64_t kSequenceSlack = 2000;         // what a pause may leave out, beside
  static constexpr std::uint64_t kMostSamplesPerSecond = 2000;  // of a stream; perimapd has at most 1000

  // Who sent a sample.
  struct Sender {
    const std::uint8_t* run_id;
    Topic topic;
    std::uint64_t writer;
  };
  // One run of one program, which has a writer for each topic.
  struct Publisher {
    std::array<std::uint8_t, 16> run{};
    std::array<std::uint64_t, kTopics> writers{};  // 0: not heard yet
    std::int64_t heard_ns = 0;
    bool known = false;

    [[nodiscard]] bool is(const Sender& sender) const noexcept {
      const std::uint64_t writer = writers[sender.topic];
      return known && std::memcmp(run.data(), sender.run_id, run.size()) == 0 &&
             (writer == 0 || writer == sender.writer);
    }
    void hear(const Sender& sender, std::int64_t now_ns) noexcept {
      std::memcpy(run.data(), sender.run_id, run.size());
      writers[sender.topic] = sender.writer;
      heard_ns = now_ns;
      known = true;
    }
  };
  // Of a sample in its topic.
  struct Place {
    std::size_t stream;
    std::uint64_t sequence;
    std::int64_t time_ns;
  };
  struct Lane {
    bool known = false;
    std::uint64_t sequence = 0;
    std::int64_t time_ns = 0;
    std::int64_t heard_ns = 0;
  };
  struct Tool {
    std::array<char, sizeof(perimap_ToolDistance::tool)> name{};
    std::int64_t heard_ns = std::numeric_limits<std::int64_t>::min();
  };

  // Of the tool's name; that of the tool that was heard least lately where all are taken.
  std::size_t lane_of_tool(const perimap_ToolDistance& sample, std::int64_t now_ns) noexcept {
    std::size_t oldest = 0;
    for (std::size_t i = 0; i < kToolLanes; ++i) {
      Tool& tool = tools_[i];
      if (std::strncmp(tool.name.data(), sample.tool, tool.name.size()) == 0) {
        tool.heard_ns = now_ns;
        return i;
      }
      if (tool.heard_ns < tools_[oldest].heard_ns) oldest = i;
    }
    Tool& taken = tools_[oldest];
    taken.heard_ns = now_ns;
    std::memcpy(taken.name.data(), sample.tool, taken.name.size());
    lane(kTools, oldest) = {};
    return oldest;
  }

  Lane& lane(Topic topic, std::size_t stream) noexcept { return lanes_[kStreams * topic + stream]; }

  static std::size_t of_clock(const char* stream) noexcept { return std::strcmp(stream, "clock") == 0 ? 1 : 0; }

  template <std::size_t N>
  static bool finite(const double (&values)[N]) noexcept {
    for (const double x : values) {
      if (!std::isfinite(x)) return false;
    }
    return true;
  }
  static bool plausible(const perimap_Surface& sample) noexcept {
    if (!std::isfinite(sample.cardiac_phase_rad) || !std::isfinite(sample.cardiac_phase_rate_rad_per_s)) return false;
    if (sample.valid_until_ns < sample.release_time_ns || sample.release_time_ns < sample.capture_time_ns) return false;
    if (sample.camera_pose_known && !(finite(sample.translation_WC_mm) && finite(sample.rotation_WC_wxyz)))
      return false;
    for (std::uint32_t i = 0; i < sample.features._length; ++i) {
      const perimap_SurfaceFeature& f = sample.features._buffer[i];
      if (!finite(f.position_W_mm) || !finite(f.velocity_W_mm_per_s) || !finite(f.covariance_W_mm2)) return false;
    }
    return true;
  }
  static bool plausible(const perimap_SurfaceModel& sample) noexcept {
    if (sample.valid_until_ns < sample.valid_from_ns) return false;
    for (std::uint32_t i = 0; i < sample.features._length; ++i) {
      const perimap_ModelFeature& f = sample.features._buffer[i];
      if (!std::isfinite(f.largest_deviation_mm)) return false;
      for (std::uint32_t k = 0; k < f.coefficients_W_mm._length; ++k) {
        if (!std::isfinite(f.coefficients_W_mm._buffer[k])) return false;
      }
    }
    return true;
  }
  static bool plausible(const perimap_SurfaceMesh& sample) noexcept {
    for (std::uint32_t k = 0; k < sample.coefficients_W_mm._length; ++k) {
      if (!std::isfinite(sample.coefficients_W_mm._buffer[k])) return false;
    }
    for (std::uint32_t k = 0; k < sample.covariances_W_mm2._length; ++k) {
      if (!std::isfinite(sample.covariances_W_mm2._buffer[k])) return false;
    }
    return true;
  }

  // What is told as known is a number; what is not is none, and harms nobody.
  static bool plausible(const perimap_ToolDistance& sample) noexcept {
    if (sample.valid_until_ns < sample.release_time_ns) return false;
    if (sample.tip_known && !(finite(sample.tip_W_mm) && finite(sample.tip_velocity_W_mm_per_s))) return false;
    for (std::size_t h = 0; h < perimap_TOOL_HORIZONS; ++h) {
      if (sample.states[h] > perimap_TOOL_GOOD) return false;
      if (sample.states[h] == perimap_TOOL_INVALID) continue;
      if (!std::isfinite(sample.distances_mm[h]) || !std::isfinite(sample.rates_mm_per_s[h])) return false;
      if (!(sample.deviations_mm[h] >= 0.0) || !std::isfinite(sample.deviations_mm[h])) return false;
    }
    return true;
  }

  // Of two times that may be anything.
  static std::int64_t difference(std::int64_t a, std::int64_t b) noexcept {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  }

  // Whether the sample follows upon the one before of its lane, which it then takes the place of.
  bool follows(Topic topic, const Place& place, std::int64_t now_ns) noexcept {
    Lane& before = lane(topic, place.stream);
    bool good = true;
    if (before.known) {
      const std::int64_t passed_ns = now_ns - before.heard_ns;
      const auto passed_s = static_cast<std::uint64_t>(passed_ns > 0 ? passed_ns / 1'000'000'000 : 0);
      const std::int64_t off_ns = difference(difference(place.time_ns, before.time_ns), passed_ns);
      good = place.sequence > before.sequence &&
             place.sequence - before.sequence <= kSequenceSlack + passed_s * kMostSamplesPerSecond &&
             off_ns > -kTimeSlack_ns && off_ns < kTimeSlack_ns;
    }
    before = {true, place.sequence, place.time_ns, now_ns};
    return good;
  }

  Hearing hear(const Sender& sender, const Place& place, bool plausible_by_itself, std::int64_t now_ns) noexcept {
    if (!heard_any_) {
      alone_since_ns_ = now_ns;
      heard_any_ = true;
    } else if (!current_.is(sender)) {
      change_to(sender, now_ns);
    }
    // Whoever knows the run can be the first to send in a topic of it.
    if (current_.writers[sender.topic] == 0) topic_since_ns_[sender.topic] = now_ns;
    current_.hear(sender, now_ns);
    if (!follows(sender.topic, place, now_ns) || !plausible_by_itself) {
      if (why_not_ != Hearing::kTwoPublishers || state(now_ns) == Hearing::kUse) why_not_ = Hearing::kImplausible;
      alone_since_ns_ = now_ns;
    }
    const Hearing heard = state(now_ns);
    const std::int64_t alone_ns = sender.topic == kMeshes ? kMeshAlone_ns : kAlone_ns;
    if (heard == Hearing::kUse && now_ns - topic_since_ns_[sender.topic] < alone_ns) return Hearing::kListening;
    return heard;
  }

  void change_to(const Sender& sender, std::int64_t now_ns) noexcept {
    const bool settled = state(now_ns) == Hearing::kUse;
    // One that was heard before, and another since: both go on.
    Publisher next;
    bool came_back = false;
    for (Publisher& other : others_) {
      if (!other.is(sender) || now_ns - other.heard_ns >= kForgotten_ns) continue;
      came_back = true;
      next = other;
      other.known = false;
    }
    if (came_back) {
      why_not_ = Hearing::kTwoPublishers;
    } else if (settled || why_not_ != Hearing::kTwoPublishers) {
      why_not_ = Hearing::kAnotherBegan;
    }
    // Not since the other one was heard last: who asks may have paused, and that one have gone on.
    alone_since_ns_ = now_ns;
    others_[next_other_++ % kRemembered] = current_;
    current_ = next;
    lanes_.fill({});
  }

  bool heard_any_ = false;
  Publisher current_;
  std::array<Publisher, kRemembered> others_{};
  std::size_t next_other_ = 0;
  std::int64_t alone_since_ns_ = 0;  // since then all that was heard was of the current one, and followed
  Hearing why_not_ = Hearing::kListening;
  std::array<std::int64_t, kTopics> topic_since_ns_{};  // since then its writer is known
  std::array<Tool, kToolLanes> tools_{};
  std::array<Lane, kStreams * kTools + kToolLanes> lanes_{};  // of tools, the last topic, by tool
};

}  // namespace perimap::client

// The complexes that recur in a lead, beats and P and T waves alike, and which of them look like the QRS.
//
// A cluster is a running template of the slope's shape. How much its members look like QRS complexes by
// themselves and what follows them is learnt of every member, whatever it was taken for: no wave is locked on to.
#pragma once

#include <array>
#include <cstdint>

#include "core/phase/qrs_shape.hpp"
#include "core/phase/recent_values.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct ClusterMatch {
  int of = -1;
  double correlation = 0.0;
  double gain = 1.0;  // to the size that its members have had lately
};

// What a complex was seen among. In a burst what is settled neither fades nor gives way to what is new.
enum class Surroundings : std::uint8_t { kCalm, kDisturbed, kBurst };

class QrsClusters {
 public:
  static constexpr int kClusters = 8;

  // The cluster that a shape is most like, of all or of those that look like beats.
  // `noise`: of the line, root mean square of its slope.
  [[nodiscard]] ClusterMatch nearest(const QrsShape& shape, int most_displaced, double noise = 0.0) const noexcept;
  [[nodiscard]] ClusterMatch nearest_beat(const QrsShape& shape) const noexcept;
  // Whatever its size: where that is another, the gain has changed.
  [[nodiscard]] bool has_a_beats_shape(const QrsShape& shape, double correlation) const noexcept {
    return nearest_beat(shape).correlation > correlation;
  }

  // A complex was seen. Gives the cluster that it now belongs to.
  int learn(const QrsShape& shape, bool upward, Surroundings around, Instant seen) noexcept;
  // How much it looked like a QRS by itself.
  void judged(int of, double log_odds) noexcept;
  // Whether a complex as sharp or sharper followed it within a PR interval.
  void followed(int of, bool by_sharper) noexcept;
  // Which blunter complex came within a PR interval before it; -1: none.
  void preceded(int of, int by) noexcept;
  // Another of cluster `by` that looks as much like a QRS comes so long after it, or before: at a distance, within
  // `scatter_s`, at which one of its kind came lately? `at_first`: whatever kind that was, and the first of its side.
  bool beside(int of, int by, double after_s, double scatter_s, bool at_first) noexcept;
  // Whether one came beside a member.
  void rivalled(int of, bool by_another) noexcept;
  // A member was a beat, so long after the one before: logarithm of the interval to the usual cycle.
  void came(int of, double log_of_cycle) noexcept;
  // Its members are beats, though they were seen among disturbances.
  void settle(int of) noexcept;
  void clear() noexcept { clusters_.fill({}); }

  // Seen often enough to be told from chance.
  [[nodiscard]] bool recurs(int i) const noexcept { return i >= 0 && at(i).weight >= kRecurs; }
  [[nodiscard]] bool any_recurs() const noexcept;
  // Recurs, and was mostly seen in calm: arcs and noise recur as well, but in bursts.
  [[nodiscard]] bool settled(int i) const noexcept { return recurs(i) && at(i).calm > kCalm; }
  [[nodiscard]] bool any_settled() const noexcept;
  [[nodiscard]] double log_odds(int i) const noexcept;  // mean of its members', cautious where there are few
  [[nodiscard]] double followers(int i) const noexcept { return i < 0 ? 0.0 : at(i).followed; }  // share
  // How many of its members it is known of whether something followed them, bounded.
  [[nodiscard]] double followers_known(int i) const noexcept { return i < 0 ? 0.0 : at(i).followed_known; }
  // Its members are P waves, of which not all are conducted: sharper ones follow many of them, and there is a kind that
  // hardly ever comes without one of these before it.
  [[nodiscard]] bool leads(int i) const noexcept;
  // Share of its members beside which, within one cycle, another comes that looks as much like a QRS.
  [[nodiscard]] double rivals(int i) const noexcept { return i < 0 ? 0.0 : at(i).rivalled; }
  // When its members usually come; 0, on time, while that is not known. Ectopic beats come early.
  [[nodiscard]] double log_of_cycle(int i) const noexcept;
  [[nodiscard]] Instant born(int i) const noexcept { return at(i).born; }  // its first member was seen
  [[nodiscard]] bool upward(int i) const noexcept { return at(i).upward; }

 private:
  static constexpr double kRecurs = 2.5;
  static constexpr double kCalm = 0.5;  // share of its members
  // At which rivals of one kind come: a P wave and the QRS complex may be of one kind, which has a rival a PR interval
  // and the rest of the cycle away, before as well as after it.
  static constexpr int kDistances = 4;

  struct Rival {
    int by = -1;           // the cluster seen last
    double after_s = 0.0;  // < 0: it comes before; 0: none
  };
  struct Cluster {
    QrsShape shape;  // root mean square 1
    RecentValues<8> sizes;
    double size = 0.0;
    double weight = 0.0;  // members, older ones fading; 0: free
    double log_odds = 0.0;
    double judged = 0.0;  // members that it is of, bounded
    double followed = 0.0;
    double followed_known = 0.0;
    int before = -1;        // the cluster that precedes it,
    double preceded = 0.0;  // for this share of its members,
    double preceded_known = 0.0;
    std::array<Rival, kDistances> rivals;  // those that were seen last first
    double rivalled = 0.0;
    double rivalled_known = 0.0;
    double log_of_cycle = 0.0;
    double came_known = 0.0;
    double calm = 0.0;
    double calm_known = 0.0;
    bool upward = true;
    Instant born;
  };
  // Clears the rarest cluster; `frozen`: none that is settled, while there is another.
  int make_room(bool frozen) noexcept;
  [[nodiscard]] const Cluster& at(int i) const noexcept { return clusters_[static_cast<std::size_t>(i)]; }

  std::array<Cluster, kClusters> clusters_{};
};

}  // namespace perimap

// A subscriber in a process of its own that tells when each surface reached it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/pipeline/release_stream.hpp"
#include "core/time/instant.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/evaluation/bench/child_process.hpp"

namespace perimap::bench {

struct Receipt {
  std::uint64_t sequence = 0;
  Instant time;
};

// The child's side: receives a stream's surfaces until its standard input ends, then prints them. `pause`: how long it
// does something else after each time it has taken samples.
[[nodiscard]] Expected<void> subscribe_until_input_ends(const dds::Membership& membership, const std::string& stream,
                                                        Duration pause);

// The parent's side. The program is this one, run again with the arguments that lead to subscribe_until_input_ends().
class Subscriber {
 public:
  // Returns when its reader is there.
  [[nodiscard]] static Expected<Subscriber> start(const dds::Membership& membership, ReleaseStream stream,
                                                  Duration pause);
  // Ends it; what it received, in order.
  [[nodiscard]] Expected<std::vector<Receipt>> finish();

 private:
  explicit Subscriber(ChildProcess child) noexcept : child_(std::move(child)) {}

  ChildProcess child_;
};

// A line that the child prints.
[[nodiscard]] Expected<Receipt> parse_receipt(const std::string& line);

// The command that the child is run by.
inline constexpr const char* kSubscriberCommand = "bench-subscriber";

}  // namespace perimap::bench

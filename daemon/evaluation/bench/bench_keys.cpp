#include "daemon/evaluation/bench/bench_keys.hpp"

#include <chrono>
#include <utility>

#include "daemon/keys/authority.hpp"
#include "daemon/keys/key_folder.hpp"

namespace perimap::bench {

Expected<void> make_keys(BenchInput& input) {
  const std::chrono::sys_seconds now = seconds_now();
  const Validity validity{now - std::chrono::minutes(5), now + std::chrono::days(1)};
  auto authority = Authority::create(input.scratch / "keys", "perimap bench", validity);
  if (!authority) return tl::unexpected(authority.error());
  auto publisher = authority->issue(KeyRole::kPublisher, "publisher", validity, false);
  if (!publisher) return tl::unexpected(publisher.error());
  auto subscriber = authority->issue(KeyRole::kDisplay, "subscriber", validity, false);
  if (!subscriber) return tl::unexpected(subscriber.error());
  input.publisher_keys = std::move(*publisher);
  input.subscriber_keys = std::move(*subscriber);
  return {};
}

}  // namespace perimap::bench

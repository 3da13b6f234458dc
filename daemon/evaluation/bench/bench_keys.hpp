// Keys for runs in a secured domain.
#pragma once

#include "core/error/expected.hpp"
#include "daemon/evaluation/bench/bench_input.hpp"

namespace perimap::bench {

// Makes an authority for this benchmark alone in the scratch folder, and keys for those who take part, which are put
// into the input. They are good for a day.
[[nodiscard]] Expected<void> make_keys(BenchInput& input);

}  // namespace perimap::bench

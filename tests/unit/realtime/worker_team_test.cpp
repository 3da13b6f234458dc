#include "core/realtime/worker_team.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace perimap {
namespace {

struct Sum {
  std::vector<long> by_worker;
  long step = 0;
  static void add(void* context, int worker) noexcept {
    auto& self = *static_cast<Sum*>(context);
    self.by_worker[static_cast<std::size_t>(worker)] += self.step;
  }
};

TEST(WorkerTeam, EveryWorkerRunsEveryTaskOnceAndSeesTheLeadersWrites) {
  constexpr int kWorkers = 3;
  WorkerTeam team(kWorkers);
  std::vector<std::thread> threads;
  for (int i = 0; i < kWorkers; ++i) threads.emplace_back([&team, i] { team.serve(i); });
  Sum sum;
  sum.by_worker.assign(kWorkers, 0);
  long expected = 0;
  for (sum.step = 1; sum.step <= 1000; ++sum.step) {
    team.run(&Sum::add, &sum);
    expected += sum.step;
    for (const long s : sum.by_worker) ASSERT_EQ(s, expected);
  }
  team.dismiss();
  for (auto& t : threads) t.join();
}

TEST(WorkerTeam, JoinWithoutStartReturnsAtOnce) {
  WorkerTeam team(2);
  team.join();
  SUCCEED() << "would hang otherwise";
}

}  // namespace
}  // namespace perimap

#include "daemon/runtime/thread_launcher.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace perimap {
namespace {

TEST(ThreadLauncher, NamesItsThreadsAndCutsWhatTheSystemWouldRefuse) {
  ThreadLauncher threads({});
  std::array<char, 16> name{};
  threads
      .launch("a-name-that-is-too-long", ThreadRole::kHousekeeping,
              [&name] { pthread_getname_np(pthread_self(), name.data(), name.size()); })
      .join();
  EXPECT_STREQ(name.data(), "a-name-that-is-");
  EXPECT_EQ(threads.priority(), perimap_PRIVILEGE_NOT_REQUESTED);
}

TEST(ThreadLauncher, AThreadRunsOnWithoutWhatIsRefused) {
  ThreadLauncher threads({50, {1023}});  // no such processor
  bool ran = false;
  threads.launch("source", ThreadRole::kSource, [&ran] { ran = true; }).join();
  EXPECT_TRUE(ran);
  EXPECT_EQ(threads.priority(), perimap_PRIVILEGE_REFUSED);
}

TEST(ThreadLauncher, HousekeepingAsksForNothing) {
  ThreadLauncher threads({50, {1023}});
  int policy = SCHED_FIFO;
  threads.launch("finder", ThreadRole::kHousekeeping, [&policy] { policy = sched_getscheduler(0); }).join();
  EXPECT_EQ(policy, SCHED_OTHER);
  EXPECT_EQ(threads.priority(), perimap_PRIVILEGE_GRANTED) << "nothing was refused";
}

TEST(ThreadLauncher, WhatNobodyWaitsForGivesWayToAllElse) {
  ThreadLauncher threads({50, {1023}});
  int niceness = -100;
  const auto ask = [&niceness] { niceness = getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); };
  threads.launch("setup-watch", ThreadRole::kBackground, ask).join();
  EXPECT_GE(niceness, 10);
  EXPECT_EQ(threads.priority(), perimap_PRIVILEGE_GRANTED) << "nothing was refused";
}

TEST(ThreadLauncher, ABackgroundThreadStepsBackAndNoOther) {
  ThreadLauncher threads({});
  const int usual = getpriority(PRIO_PROCESS, 0);
  int background = 0;
  int housekeeping = 0;
  threads.launch("surface", ThreadRole::kBackground, [&] { background = getpriority(PRIO_PROCESS, 0); }).join();
  threads.launch("finder", ThreadRole::kHousekeeping, [&] { housekeeping = getpriority(PRIO_PROCESS, 0); }).join();
  EXPECT_EQ(background, std::max(usual, 10));
  EXPECT_EQ(housekeeping, usual);
  EXPECT_EQ(getpriority(PRIO_PROCESS, 0), usual);
}

TEST(ThreadLauncher, TheMoreUrgentRoleGetsTheHigherPriorityAndEachItsOwnProcessor) {
  cpu_set_t allowed;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  std::vector<int> cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE && cpus.size() < 2; ++cpu) {
    if (CPU_ISSET(static_cast<unsigned>(cpu), &allowed)) cpus.push_back(cpu);
  }
  ThreadLauncher threads({50, cpus});
  struct Given {
    int priority = -1;
    cpu_set_t cpus{};
  };
  const auto given = [&threads](ThreadRole role, int number) {
    Given g;
    threads
        .launch(
            "thread", role,
            [&g] {
              sched_param parameters{};
              sched_getparam(0, &parameters);
              g.priority = parameters.sched_priority;
              sched_getaffinity(0, sizeof g.cpus, &g.cpus);
            },
            number)
        .join();
    return g;
  };
  const Given publisher = given(ThreadRole::kPublisher, 0);
  if (threads.priority() == perimap_PRIVILEGE_REFUSED) GTEST_SKIP() << "this user is given no real-time priority";
  EXPECT_EQ(publisher.priority, 50);
  EXPECT_TRUE(CPU_ISSET(static_cast<unsigned>(cpus.back()), &publisher.cpus));
  EXPECT_EQ(CPU_COUNT(&publisher.cpus), 1);
  EXPECT_EQ(given(ThreadRole::kSource, 0).priority, 49);
  EXPECT_EQ(given(ThreadRole::kMapper, 0).priority, 49);
  for (int i = 0; i < 3; ++i) {
    const Given worker = given(ThreadRole::kWorker, i);
    EXPECT_EQ(worker.priority, 48);
    EXPECT_EQ(CPU_COUNT(&worker.cpus), 1);
    EXPECT_TRUE(CPU_ISSET(static_cast<unsigned>(cpus[static_cast<std::size_t>(i) % cpus.size()]), &worker.cpus)) << i;
  }
}

}  // namespace
}  // namespace perimap

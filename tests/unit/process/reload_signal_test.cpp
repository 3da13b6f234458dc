#include "daemon/process/reload_signal.hpp"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <csignal>
#include <thread>

namespace perimap {
namespace {

class Event {
 public:
  Event() : descriptor_(eventfd(0, 0)) {}
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() { close(descriptor_); }
  [[nodiscard]] int get() const { return descriptor_; }
  void happen() const { eventfd_write(descriptor_, 1); }

 private:
  int descriptor_;
};

TEST(ReloadSignal, EndsAWaitAndNotTheProcess) {
  auto reload = ReloadSignal::install();
  ASSERT_TRUE(reload) << reload.error().message;
  const Event never;
  std::jthread sender([] { kill(getpid(), SIGHUP); });
  EXPECT_TRUE(reload->wait(never.get()));
}

TEST(ReloadSignal, IsNotLostWhenNobodyWaits) {
  auto reload = ReloadSignal::install();
  ASSERT_TRUE(reload);
  const Event never;
  raise(SIGHUP);
  EXPECT_TRUE(reload->wait(never.get()));
  raise(SIGHUP);
  EXPECT_TRUE(reload->wait(never.get()));
}

TEST(ReloadSignal, ItsWaitCanBeInterrupted) {
  auto reload = ReloadSignal::install();
  ASSERT_TRUE(reload);
  const Event end;
  std::jthread other([&end] { end.happen(); });
  EXPECT_FALSE(reload->wait(end.get()));
}

}  // namespace
}  // namespace perimap

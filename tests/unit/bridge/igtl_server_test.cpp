// The clients of the OpenIGTLink server: those that read, those that do not, those that talk.
#include "daemon/bridge/igtl/igtl_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <condition_variable>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "igtl_receiver.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using Subject = IgtlOutgoing::Subject;

IgtlOutgoing state_of(const std::string& name) {
  return pack_state(Subject::kSurfaceStatus, {IgtlState::Code::kOk, 0, name, ""});
}

// A surface of so many points, the first of which has its number.
IgtlOutgoing surface_of(int number, std::size_t points) {
  ShownSurface shown;
  shown.state = perimap_SURFACE_GOOD;
  shown.features.assign(points, {1, perimap_FEATURE_CONVERGED, {static_cast<double>(number), 0, 0}, 1.0});
  return pack_surface(shown);
}

class IgtlServers : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(pipe(stop_.data()), 0);
    auto server = IgtlServer::listen({"127.0.0.1", 0}, [this](const std::string& what) {
      const std::lock_guard lock(mutex_);
      said_.push_back(what);
      changed_.notify_all();
    });
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::make_unique<IgtlServer>(std::move(*server));
    const std::string endpoint = server_->endpoint();
    port_ = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
    thread_ = std::thread([this] {
      EXPECT_TRUE(server_->run(stop_[0], [this] {
        server_->send(state_of("gone"));
        // As by a thread that has not heard of the end: nothing comes after the last word.
        server_->post([this] { server_->send(surface_of(99, 3)); });
      }));
    });
  }
  void TearDown() override {
    stop();
    for (const int end : stop_) close(end);
  }
  void stop() {
    if (!thread_.joinable()) return;
    EXPECT_EQ(write(stop_[1], "x", 1), 1);
    thread_.join();
  }
  void send(const IgtlOutgoing& message) {
    std::promise<void> done;
    server_->post([&] {
      server_->send(message);
      done.set_value();
    });
    done.get_future().wait();
  }
  [[nodiscard]] bool hears(const std::string& text) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 20s, [&] {
      return std::any_of(said_.begin(), said_.end(),
                         [&](const std::string& what) { return what.find(text) != std::string::npos; });
    });
  }

  std::array<int, 2> stop_{};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> said_;
  std::unique_ptr<IgtlServer> server_;
  int port_ = 0;
  std::thread thread_;
};

TEST_F(IgtlServers, AClientThatComesLaterGetsTheNewestOfEachSubject) {
  send(state_of("first"));
  send(state_of("second"));
  send(surface_of(1, 3));
  send(surface_of(2, 3));
  test::IgtlReceiver client;
  ASSERT_TRUE(client.connect(port_));
  const auto surface = client.next();
  ASSERT_TRUE(surface);
  ASSERT_EQ(surface->type, "POLYDATA");
  EXPECT_EQ(surface->points.at(0)[0], 2.0F);
  const auto state = client.next();
  ASSERT_TRUE(state);
  EXPECT_EQ(state->name, "second");
  send(surface_of(3, 1));
  EXPECT_EQ(client.next()->points.at(0)[0], 3.0F);
}

TEST_F(IgtlServers, WhatIsForgottenGoesToNobodyAnyMore) {
  send(surface_of(1, 3));
  send(state_of("here"));
  server_->post([this] { server_->forget(Subject::kSurface); });
  test::IgtlReceiver client;
  ASSERT_TRUE(client.connect(port_));
  EXPECT_EQ(client.next()->name, "here");
}

TEST_F(IgtlServers, AClientThatDoesNotReadIsDroppedAndTheOthersGoOn) {
  test::IgtlReceiver slow, quick;
  ASSERT_TRUE(slow.connect(port_));
  ASSERT_TRUE(quick.connect(port_));
  int number = 0;
  const auto exchange = [&] {
    send(surface_of(++number, 20'000));  // 0.6 MB
    const auto got = quick.next();
    return got && got->points.size() == 20'000U && got->points[0][0] == static_cast<float>(number);
  };
  const Instant begin = MonotonicClock::now();
  bool dropped = false;
  while (!dropped && MonotonicClock::now() - begin < 15s) {
    ASSERT_TRUE(exchange()) << number;
    std::this_thread::sleep_for(20ms);
    const std::lock_guard lock(mutex_);
    dropped = !said_.empty();
  }
  ASSERT_TRUE(hears("does not read what it is sent, and was dropped"));
  EXPECT_TRUE(exchange());
  // What it was sent before ends somewhere; a client that is connected anew is served.
  test::IgtlReceiver again;
  ASSERT_TRUE(again.connect(port_));
  EXPECT_EQ(again.next()->points.at(0)[0], static_cast<float>(number));
}

// As many bytes as a real surface has, thirty times a second.
TEST_F(IgtlServers, AClientThatDoesNotReadSmallSurfacesIsDroppedSoonAfterItsSystemIsFull) {
  test::IgtlReceiver slow, quick;
  ASSERT_TRUE(slow.connect(port_));
  ASSERT_TRUE(quick.connect(port_));
  int number = 0;
  bool dropped = false;
  for (; !dropped && number < 400; ++number) {
    send(surface_of(number, 200));
    ASSERT_TRUE(quick.next());
    std::this_thread::sleep_for(33ms);
    const std::lock_guard lock(mutex_);
    dropped = !said_.empty();
  }
  EXPECT_TRUE(dropped);
  // What it could still read is what its own system has taken in, not what has waited here.
  int old = 0;
  while (const auto got = slow.next(100ms)) ++old;
  RecordProperty("surfaces_taken_in", old);
  EXPECT_LT(old, number - 10);
}

TEST_F(IgtlServers, WhatAClientSaysMeansNothing) {
  test::IgtlReceiver client;
  ASSERT_TRUE(client.connect(port_));
  std::string garbage(100'000, '\xFF');
  for (std::size_t i = 0; i < garbage.size(); ++i) garbage[i] = static_cast<char>(i * 31 + i / 7);
  ASSERT_TRUE(client.say(garbage));
  ASSERT_TRUE(client.say(*surface_of(1, 10).bytes));
  send(state_of("on"));
  const auto got = client.next();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->name, "on");
}

TEST_F(IgtlServers, OneMoreThanSixteenIsTurnedAway) {
  send(state_of("here"));
  std::vector<test::IgtlReceiver> clients(IgtlServer::kMostClients);
  for (auto& client : clients) {
    ASSERT_TRUE(client.connect(port_));
    ASSERT_TRUE(client.next());
  }
  test::IgtlReceiver another;
  ASSERT_TRUE(another.connect(port_));
  EXPECT_FALSE(another.next(5s));
  EXPECT_TRUE(hears("16 clients are connected already"));
  send(state_of("on"));
  for (auto& client : clients) EXPECT_EQ(client.next()->name, "on");
  clients.back().close();
  // Its place is free a moment later.
  bool served = false;
  for (int i = 0; i < 100 && !served; ++i) {
    test::IgtlReceiver next;
    served = next.connect(port_) && next.next(1s);
  }
  EXPECT_TRUE(served);
}

TEST_F(IgtlServers, WhatIsSentAtTheEndStillGoesOut) {
  test::IgtlReceiver client;
  ASSERT_TRUE(client.connect(port_));
  send(state_of("here"));
  ASSERT_TRUE(client.next());
  stop();
  const auto last = client.next();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->name, "gone");
  EXPECT_FALSE(client.next(1s));
}

TEST_F(IgtlServers, AnAlarmThatWasSetAnewComesOnce) {
  std::promise<int> rung;
  server_->post([&] {
    server_->at(MonotonicClock::now() + 50ms, [&] { rung.set_value(1); });
    server_->at(MonotonicClock::now() + 100ms, [&] { rung.set_value(2); });
  });
  EXPECT_EQ(rung.get_future().get(), 2);
}

TEST_F(IgtlServers, APortInUseAndAnAddressThatIsNoneAreTold) {
  const auto listen = [](const std::string& address, int port) {
    return IgtlServer::listen({address, static_cast<std::uint16_t>(port)}, {});
  };
  const auto second = listen("127.0.0.1", port_);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("is another perimap bridge igtl running?"));
  for (const std::string address : {"", "localhost", "127.0.0.1:1", "1.2.3", "\xFF\n"}) {
    const auto none = listen(address, 0);
    ASSERT_FALSE(none) << address;
    EXPECT_THAT(none.error().message, HasSubstr("--bind: expected an address in numbers"));
    EXPECT_THAT(none.error().message, testing::Not(HasSubstr("\n")));
  }
  const auto elsewhere = listen("192.0.2.1", 0);
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().message, HasSubstr("--bind takes an address of this host"));
}

}  // namespace
}  // namespace perimap

#include "drivers/ecg/modem_line_trigger.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <termios.h>

#include <deque>
#include <vector>

#include "drivers/transport/pseudo_terminal.hpp"
#include "drivers/transport/serial_port.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Instant kStart{seconds(10)};

struct Edges : ::testing::Test {
  // The line changes so many times and is then on or off.
  std::optional<RTriggerPulse> change(std::uint32_t times, bool on, Duration at, bool woken = true) {
    line.changes += times;
    line.on = on;
    return edges.observe_line(line, woken, kStart + at);
  }

  DeviceHealth health;
  ModemTriggerSettings settings{.path = ""};
  TriggerEdges edges{settings, health};
  ModemPort::Line line{0xFFFFFFFEU, false};  // soon over its end
  void SetUp() override { edges.restart(line); }
};

TEST_F(Edges, APulseIsOneRPeakAtItsFirstEdgeLessTheDelay) {
  const auto first = change(1, true, milliseconds(0));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->time, kStart);
  EXPECT_EQ(first->arrival, kStart);
  EXPECT_FALSE(change(1, false, milliseconds(100)));
  const auto second = change(1, true, milliseconds(800));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->device_count, first->device_count + 1);
  EXPECT_EQ(health.samples.get(), 2U);
  EXPECT_EQ(health.lost.get(), 0U);
}

TEST_F(Edges, ABounceIsNoBeat) {
  EXPECT_TRUE(change(1, true, milliseconds(0)));
  EXPECT_FALSE(change(1, false, milliseconds(1)));
  EXPECT_FALSE(change(1, true, milliseconds(2)));
  EXPECT_EQ(health.damaged.get(), 1U);
}

TEST_F(Edges, AnEdgeWithoutAKnownInstantGivesNoRPeak) {
  EXPECT_FALSE(change(2, false, milliseconds(0)));  // a whole pulse at once
  EXPECT_EQ(health.lost.get(), 1U);
  EXPECT_FALSE(change(1, true, milliseconds(900), false));  // it came while nobody waited
  EXPECT_EQ(health.lost.get(), 2U);
  EXPECT_FALSE(change(3, false, milliseconds(2000)));  // off, on, off
  EXPECT_EQ(health.lost.get(), 3U);
  EXPECT_FALSE(change(3, true, milliseconds(3000)));  // on, off, on
  EXPECT_EQ(health.lost.get(), 5U);
  EXPECT_EQ(health.samples.get(), 0U);
}

// 16550s count the end of a ring alone.
TEST_F(Edges, ThatOnlyTheOtherEdgeComesIsSaid) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(health.awaited(), "");
    EXPECT_FALSE(change(1, false, milliseconds(800 * i)));
  }
  EXPECT_THAT(health.awaited(), HasSubstr("only the falling edge comes"));
}

TEST_F(Edges, NoChangeIsNothing) {
  EXPECT_FALSE(change(0, false, milliseconds(0), false));
  EXPECT_EQ(health.lost.get(), 0U);
}

TEST(FallingEdges, AreRPeaksWhenTheMonitorIsThatWay) {
  DeviceHealth health;
  TriggerEdges edges({.path = "", .rising = false}, health);
  edges.restart({5, true});
  EXPECT_TRUE(edges.observe_line({6, false}, true, kStart));
  EXPECT_FALSE(edges.observe_line({7, true}, true, kStart + milliseconds(100)));
}

// A port whose line does as it is told.
class FakePort final : public ModemPort {
 public:
  struct Step {
    bool woken = true;
    std::uint32_t changes = 1;
    bool on = true;
    std::string error = {};
  };
  FakePort(std::deque<Step>& steps, Interrupt& interrupt) : steps_(steps), interrupt_(interrupt) {}

  Expected<bool> wait_for_change() override {
    if (steps_.empty()) {
      interrupt_.request();
      return false;
    }
    const Step step = steps_.front();
    steps_.pop_front();
    if (!step.error.empty()) return fail(step.error);
    line_.changes += step.changes;
    line_.on = step.on;
    return step.woken;
  }
  Expected<Line> read() override { return line_; }

 private:
  std::deque<Step>& steps_;
  Interrupt& interrupt_;
  Line line_;
};

TEST(ModemLineTrigger, GivesRPeaksAndOpensAnUnpluggedPortAgain) {
  Interrupt interrupt;
  DeviceHealth health;
  std::deque<FakePort::Step> steps{{}, {.on = false}, {.error = "unplugged"}, {}, {.on = false}};
  std::vector<std::uint64_t> counts;
  int openings = 0;
  const ModemPortOpener open = [&](const std::string&, ModemLine) -> Expected<std::unique_ptr<ModemPort>> {
    if (++openings == 2) return fail("no such device");
    return std::make_unique<FakePort>(steps, interrupt);
  };
  serve_modem_line_trigger(
      {.path = "/dev/ttyS9", .shortest_interval = Duration(0)},
      [&](const RTriggerPulse& trigger) {
        counts.push_back(trigger.device_count);
        EXPECT_LE(trigger.time, trigger.arrival);
      },
      health, interrupt, open);
  EXPECT_THAT(counts, ::testing::ElementsAre(1, 2));
  EXPECT_EQ(openings, 3);
  EXPECT_EQ(health.reason(), "no such device");
  EXPECT_EQ(health.state(), DeviceState::kClosed);
}

// A terminal has no modem lines, which is found out last: what comes before can be seen on one.
TEST(ModemPort, IsItsOwnersAloneAndNoCarrierHangsItUp) {
  auto device = PseudoTerminal::open("");
  ASSERT_TRUE(device) << device.error().message;
  const std::string path = (*device)->path();
  {
    const auto taken = open_serial_port(path, 9600);
    ASSERT_TRUE(taken) << taken.error().message;
    const auto refused = open_modem_port(path, ModemLine::kCarrierDetect);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("in use by another program"));
  }
  const auto settings_of = [&path] {
    const Descriptor line(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
    termios settings{};
    EXPECT_EQ(::tcgetattr(line.get(), &settings), 0);
    return settings;
  };
  termios settings = settings_of();
  settings.c_cflag &= ~static_cast<tcflag_t>(CLOCAL);
  {
    const Descriptor line(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
    ASSERT_EQ(::tcsetattr(line.get(), TCSANOW, &settings), 0);
  }
  ASSERT_EQ(settings_of().c_cflag & CLOCAL, 0U);
  EXPECT_FALSE(open_modem_port(path, ModemLine::kCarrierDetect));
  EXPECT_NE(settings_of().c_cflag & CLOCAL, 0U);
  EXPECT_TRUE(open_serial_port(path, 9600)) << "it is given back";
}

TEST(ModemPort, SaysThatATerminalWithoutModemLinesHasNone) {
  auto device = PseudoTerminal::open("");
  ASSERT_TRUE(device) << device.error().message;
  const auto port = open_modem_port((*device)->path(), ModemLine::kCarrierDetect);
  ASSERT_FALSE(port);
  EXPECT_THAT(port.error().message, HasSubstr("cannot watch modem lines"));
  const auto none = open_modem_port("/dev/no-such-port", ModemLine::kClearToSend);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no such device"));
}

}  // namespace
}  // namespace perimap

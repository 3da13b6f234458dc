#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "drivers/device/device_link.hpp"
#include "drivers/transport/can_socket.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/host_lookup.hpp"
#include "drivers/transport/pseudo_terminal.hpp"
#include "drivers/transport/serial_port.hpp"
#include "drivers/transport/tcp_stream.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr int kBaud = 115200;

std::string error_of(const auto& result) { return result ? "none" : result.error().message; }

// What arrives until there are `count` bytes, or nothing more for two seconds.
std::vector<std::byte> read_bytes(ByteStream& stream, std::size_t count) {
  std::vector<std::byte> all;
  std::array<std::byte, 512> buffer;
  for (int i = 0; i < 2000 && all.size() < count; ++i) {
    const auto got = stream.read(buffer);
    if (!got) break;
    all.insert(all.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*got));
    if (*got == 0) std::this_thread::sleep_for(milliseconds(1));
  }
  return all;
}

TEST(Endpoint, WhatAUserWritesIsReadAndWrittenBack) {
  for (const std::string text :
       {"/dev/serial/by-id/usb-FTDI_x-if00", "tcp:tracker.local:8765", "tcp:[fe80::1]:8765", "can:can0"}) {
    const auto endpoint = parse_endpoint(text);
    ASSERT_TRUE(endpoint) << endpoint.error().message;
    EXPECT_EQ(format_endpoint(*endpoint), text);
  }
}

TEST(Endpoint, AnythingElseIsRefusedInOneLine) {
  for (const std::string text :
       {"", "ttyUSB0", "tcp:", "tcp:host", "tcp:host:", "tcp:host:0", "tcp:host:65536", "tcp:host:1x", "tcp::80",
        "tcp:a b:80", "can:", "can:a-name-too-long-for-linux", "can:a b", "udp:x:1", "can:\n"}) {
    const auto endpoint = parse_endpoint(text);
    ASSERT_FALSE(endpoint) << text;
    EXPECT_THAT(endpoint.error().message, HasSubstr("tcp:HOST:PORT"));
    EXPECT_EQ(endpoint.error().message.find('\n'), std::string::npos);
  }
}

TEST(SerialPort, CarriesEveryByteBothWays) {
  auto device = PseudoTerminal::open("");
  ASSERT_TRUE(device) << device.error().message;
  auto port = open_serial_port((*device)->path(), kBaud);
  ASSERT_TRUE(port) << port.error().message;
  EXPECT_EQ((*device)->line_rate(), kBaud);
  std::vector<std::byte> every;
  for (int i = 0; i < 256; ++i) every.push_back(static_cast<std::byte>(i));
  ASSERT_EQ((*device)->write(every), every.size());
  EXPECT_EQ(read_bytes(**port, 256), every);
  ASSERT_EQ((*port)->write(every), every.size());
  EXPECT_EQ(read_bytes(**device, 256), every);
}

TEST(SerialPort, SilenceIsNoErrorAndUnpluggingIs) {
  auto device = PseudoTerminal::open("");
  ASSERT_TRUE(device);
  auto port = open_serial_port((*device)->path(), kBaud);
  ASSERT_TRUE(port);
  std::array<std::byte, 8> buffer;
  EXPECT_EQ((*port)->read(buffer), std::size_t{0});
  device->reset();
  EXPECT_THAT(error_of((*port)->read(buffer)), HasSubstr("unplugged"));
}

TEST(SerialPort, SaysWhyItCannotBeOpened) {
  EXPECT_THAT(error_of(open_serial_port("/dev/no-such-port", kBaud)), HasSubstr("no such device"));
  EXPECT_THAT(error_of(open_serial_port("/dev/null", kBaud)), HasSubstr("not a serial line"));
  auto device = PseudoTerminal::open("");
  ASSERT_TRUE(device);
  auto first = open_serial_port((*device)->path(), kBaud);
  ASSERT_TRUE(first);
  EXPECT_THAT(error_of(open_serial_port((*device)->path(), kBaud)), HasSubstr("in use by another program"));
  first->reset();
  EXPECT_TRUE(open_serial_port((*device)->path(), kBaud));
}

TEST(SerialPort, MissingPermissionIsSaidSo) {
  if (geteuid() == 0) GTEST_SKIP() << "root may open everything";
  const auto path = std::filesystem::temp_directory_path() / "perimap-no-permission";
  std::ofstream(path) << "x";
  std::filesystem::permissions(path, std::filesystem::perms::none);
  EXPECT_THAT(error_of(open_serial_port(path.string(), kBaud)), HasSubstr("permission denied"));
  std::filesystem::remove(path);
}

TEST(PseudoTerminal, KeepsItsLinkAndRefusesToReplaceAFile) {
  const auto folder = std::filesystem::temp_directory_path() / ("perimap-pty-" + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const std::string link = (folder / "ecg").string();
  {
    auto device = PseudoTerminal::open(link);
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_TRUE(open_serial_port(link, kBaud));
  }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(link)));
  std::ofstream(link) << "precious";
  EXPECT_THAT(error_of(PseudoTerminal::open(link)), HasSubstr("is not a link"));
  std::filesystem::remove_all(folder);
}

TEST(Tcp, ConnectsAndNoticesThatThePeerHasGone) {
  const Interrupt interrupt;
  auto listener = TcpListener::open(0);
  ASSERT_TRUE(listener) << listener.error().message;
  HostLookup host("127.0.0.1", listener->port());
  auto client = connect_tcp(host, seconds(2), interrupt);
  ASSERT_TRUE(client) << client.error().message;
  auto server = listener->accept();
  ASSERT_TRUE(server && *server);
  const std::array<std::byte, 3> word{std::byte{1}, std::byte{0}, std::byte{255}};
  ASSERT_EQ((*server)->write(word), word.size());
  EXPECT_EQ(read_bytes(**client, 3), std::vector<std::byte>(word.begin(), word.end()));
  server->reset();
  EXPECT_TRUE(read_bytes(**client, 1).empty());
  std::array<std::byte, 1> buffer;
  EXPECT_THAT(error_of((*client)->read(buffer)), HasSubstr("gone"));
}

TEST(Tcp, SaysWhyItCannotConnect) {
  const Interrupt interrupt;
  std::uint16_t free_port = 0;
  {
    auto listener = TcpListener::open(0);
    ASSERT_TRUE(listener);
    free_port = listener->port();
  }
  HostLookup here("127.0.0.1", free_port);
  EXPECT_THAT(error_of(connect_tcp(here, seconds(2), interrupt)), HasSubstr("refused"));
  HostLookup nowhere("no-such-host.invalid", 80);
  EXPECT_THAT(error_of(connect_tcp(nowhere, seconds(2), interrupt)), HasSubstr("unknown host"));
}

// A name server that never answers, as one behind a cut cable.
struct DeafNameServer {
  std::atomic<int> asked{0};
  std::atomic<int> done{0};
  Interrupt release;

  int operator()(const char* /*host*/, const char* /*port*/, const addrinfo* /*hints*/, addrinfo** /*found*/) {
    ++asked;
    wait_unless_interrupted(seconds(60), release);
    ++done;
    return EAI_AGAIN;
  }
};

TEST(HostLookup, ANameServerThatDoesNotAnswerHoldsUpNeitherStopNorStart) {
  const auto server = std::make_shared<DeafNameServer>();
  {
    HostLookup lookup("tracker.local", 8765, [server](auto... arguments) { return (*server)(arguments...); });
    const Interrupt none;
    EXPECT_THAT(error_of(lookup.addresses(milliseconds(50), none)), HasSubstr("no answer from the name server"));
    Interrupt stop;
    std::jthread stopping([&] {
      while (server->asked < 1) std::this_thread::sleep_for(milliseconds(1));
      stop.request();
    });
    EXPECT_THAT(error_of(lookup.addresses(seconds(3600), stop)), HasSubstr("interrupted"));
  }
  EXPECT_EQ(server->done, 0) << "the name server had answered";
  server->release.request();
  while (server->done < 1) std::this_thread::sleep_for(milliseconds(1));
}

TEST(HostLookup, IsOneAtATimeAndItsLateAnswerIsTaken) {
  const auto server = std::make_shared<DeafNameServer>();
  HostLookup lookup("tracker.local", 8765, [server](auto... arguments) { return (*server)(arguments...); });
  const Interrupt none;
  for (int i = 0; i < 5; ++i) {
    EXPECT_THAT(error_of(lookup.addresses(milliseconds(20), none)), HasSubstr("no answer from the name server"));
  }
  EXPECT_LE(server->asked, 1);
  server->release.request();
  EXPECT_THAT(error_of(lookup.addresses(seconds(60), none)), HasSubstr("unknown host"));
  EXPECT_EQ(server->asked, 1);
  // With that answer taken the next question is a new one.
  EXPECT_THAT(error_of(lookup.addresses(seconds(60), none)), HasSubstr("unknown host"));
  EXPECT_EQ(server->asked, 2);
}

// SCHED_BATCH, which anyone may have, stands for the priority that a driver's thread may have.
TEST(HostLookup, RunsOnTheNormalSchedulerWhoeverAsks) {
  std::atomic<int> policy{-1};
  std::jthread([&policy] {
    const sched_param none{};
    ASSERT_EQ(pthread_setschedparam(pthread_self(), SCHED_BATCH, &none), 0);
    HostLookup lookup("tracker.local", 8765, [&policy](auto...) {
      sched_param parameters{};
      int mine = -1;
      (void)pthread_getschedparam(pthread_self(), &mine, &parameters);
      policy = mine;
      return EAI_FAIL;
    });
    EXPECT_THAT(error_of(lookup.addresses(seconds(60), Interrupt())), HasSubstr("unknown host"));
  }).join();
  EXPECT_EQ(policy, SCHED_OTHER);
}

TEST(HostLookup, AnAddressInDigitsNeedsNoNameServer) {
  const Interrupt none;
  const AddressSource source = [](auto...) { return EAI_FAIL; };
  for (const std::string host : {"127.0.0.1", "::1"}) {
    const auto addresses = HostLookup(host, 8765, source).addresses(seconds(2), none);
    ASSERT_TRUE(addresses) << addresses.error().message;
    EXPECT_EQ((*addresses)->ai_socktype, SOCK_STREAM);
  }
  EXPECT_THAT(error_of(HostLookup("tracker.local", 8765, source).addresses(seconds(2), none)),
              HasSubstr("unknown host"));
}

TEST(CanSocket, OpensOrSaysWhyNot) {
  const auto socket = CanSocket::open("no-such-can", 0x2E0, false);
  ASSERT_FALSE(socket);
  EXPECT_THAT(socket.error().message, ::testing::AnyOf(HasSubstr("no such CAN interface"),
                                                       HasSubstr("this kernel has no CAN"), HasSubstr("permission")));
}

// A peer that answers every byte with its successor, and asks to close after a "!".
class Successor final : public DeviceProtocol {
 public:
  void on_open(LinkControl&, Instant) override { ++opened; }
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant) override {
    for (const std::byte b : bytes) {
      if (b == std::byte{'!'}) return link.fail("asked to");
      const std::array<std::byte, 1> answer{static_cast<std::byte>(std::to_integer<unsigned>(b) + 1)};
      link.send(answer);
    }
  }
  void on_time(LinkControl&, Instant) override {}
  Instant next_time() const noexcept override { return kNever; }
  std::atomic<int> opened{0};
};

// A line whose driver knows no break.
class WithoutBreak final : public ByteStream {
 public:
  explicit WithoutBreak(std::unique_ptr<ByteStream> stream) : stream_(std::move(stream)) {}
  Expected<std::size_t> read(std::span<std::byte> buffer) override { return stream_->read(buffer); }
  Expected<std::size_t> write(std::span<const std::byte> bytes) override { return stream_->write(bytes); }
  int descriptor() const noexcept override { return stream_->descriptor(); }
  Expected<void> send_break() override { return fail("cannot send a break"); }

 private:
  std::unique_ptr<ByteStream> stream_;
};

// Ends by itself at its first instant.
class BreaksAtTheStart final : public DeviceProtocol {
 public:
  void on_open(LinkControl& link, Instant now) override {
    link.send_break();
    due_ = now;
  }
  void on_bytes(LinkControl& /*link*/, std::span<const std::byte> /*bytes*/, Instant /*arrival*/) override {}
  void on_time(LinkControl& link, Instant /*now*/) override { link.fail("went on"); }
  Instant next_time() const noexcept override { return due_; }

 private:
  Instant due_{};
};

TEST(DeviceLink, ALineWithoutABreakGoesOnWithout) {
  auto device = PseudoTerminal::open("");
  ASSERT_TRUE(device) << device.error().message;
  auto port = open_serial_port((*device)->path(), kBaud);
  ASSERT_TRUE(port) << port.error().message;
  WithoutBreak stream(std::move(*port));
  BreaksAtTheStart protocol;
  const Interrupt interrupt;
  EXPECT_EQ(converse(stream, protocol, interrupt), "went on");
}

TEST(DeviceLink, OpensAgainAfterEveryFailureAndEndsWhenInterrupted) {
  auto listener = TcpListener::open(0);
  ASSERT_TRUE(listener);
  Successor protocol;
  DeviceHealth health;
  Interrupt interrupt;
  std::jthread serving([&] {
    serve_device(opener_of(TcpEndpoint{"127.0.0.1", listener->port()}, 0), protocol, health, interrupt);
  });
  for (int round = 1; round <= 3; ++round) {
    std::unique_ptr<ByteStream> peer;
    for (int i = 0; i < 5000 && !peer; ++i) {
      auto accepted = listener->accept();
      ASSERT_TRUE(accepted);
      peer = std::move(*accepted);
      if (!peer) std::this_thread::sleep_for(milliseconds(1));
    }
    ASSERT_TRUE(peer);
    const std::array<std::byte, 2> question{std::byte{'a'}, std::byte{'b'}};
    ASSERT_TRUE(peer->write(question));
    EXPECT_EQ(read_bytes(*peer, 2), (std::vector<std::byte>{std::byte{'b'}, std::byte{'c'}}));
    EXPECT_EQ(protocol.opened, round);
    const std::array<std::byte, 1> end{std::byte{'!'}};
    ASSERT_TRUE(peer->write(end));
    EXPECT_TRUE(read_bytes(*peer, 1).empty());
    for (int i = 0; i < 5000 && health.reason().empty(); ++i) std::this_thread::sleep_for(milliseconds(1));
    EXPECT_EQ(health.reason(), "asked to");
  }
  interrupt.request();
}

}  // namespace
}  // namespace perimap

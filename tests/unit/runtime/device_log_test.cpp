// What the log says of a device.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <sstream>

#include "daemon/runtime/device_feeder.hpp"
#include "drivers/tracker/igtl_message.hpp"
#include "drivers/transport/tcp_stream.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

// The log, while this is there.
class KeptLog {
 public:
  KeptLog() : before_(spdlog::default_logger()) {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("kept", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
  }
  KeptLog(const KeptLog&) = delete;
  KeptLog& operator=(const KeptLog&) = delete;
  ~KeptLog() { spdlog::set_default_logger(before_); }
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::shared_ptr<spdlog::logger> before_;
};

std::vector<std::byte> status(std::uint8_t code, std::string_view name) {
  std::vector<std::byte> content(30);
  content[1] = static_cast<std::byte>(code);
  for (std::size_t i = 0; i < name.size(); ++i) content[10 + i] = static_cast<std::byte>(name[i]);
  return encode_igtl({1, "STATUS", "Server", 0, content, {}});
}

TEST(DeviceLog, WhatAnOpenDeviceComplainsOfIsToldOnce) {
  const KeptLog log;
  auto listener = TcpListener::open(0);
  ASSERT_TRUE(listener) << listener.error().message;
  Devices devices;
  devices.tracker = TrackerDevice{TcpEndpoint{"127.0.0.1", listener->port()},
                                  IgtlSettings{.sensor = "Scope", .reference = std::nullopt, .world = {}}};
  DeviceFeeder feeder(std::move(devices), nullptr, {});
  ThreadLauncher threads{SchedulingSettings{}};
  feeder.start(threads);
  std::unique_ptr<ByteStream> server;
  ASSERT_TRUE(wait_until([&] {
    auto accepted = listener->accept();
    if (accepted) server = std::move(*accepted);
    return server != nullptr;
  }));
  const auto say = [&server](const std::vector<std::byte>& message) {
    ASSERT_EQ(server->write(message), message.size());
  };
  const auto pose = encode_igtl({1, "TRANSFORM", "Scope", 0, encode_igtl_transform(Pose{}), {}});
  // The device goes on meanwhile: a stream that pauses falls silent, and that is another word.
  const auto told = [&](const std::string& what) {
    return wait_until([&] {
      say(pose);
      feeder.tick();
      return log.text().find(what) != std::string::npos;
    });
  };
  EXPECT_TRUE(told("tracker: streaming"));
  say(status(13, "no camera"));
  EXPECT_TRUE(told("tracker: Server reports status 13 no camera"));
  for (int i = 0; i < 3; ++i) feeder.tick();
  const std::string text = log.text();
  const std::string complaint = "status 13 no camera";
  EXPECT_EQ(text.find(complaint), text.rfind(complaint)) << text;
  feeder.stop();
}

}  // namespace
}  // namespace perimap

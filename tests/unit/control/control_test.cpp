#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "daemon/control/control_request.hpp"
#include "daemon/control/control_server.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;
using testing::HasSubstr;

TEST(ControlRequest, EachCommandIsReadBackByItsName) {
  for (const auto command : {ControlCommand::kStatus, ControlCommand::kNewPatient, ControlCommand::kOrganMoved,
                             ControlCommand::kRecordOn, ControlCommand::kRecordOff, ControlCommand::kReload}) {
    const auto read = parse_control_request(std::string(name_of(command)) + "\n");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, command);
  }
}

struct Garbled {
  const char* name;
  std::string request;
};

class GarbledRequest : public testing::TestWithParam<Garbled> {};

TEST_P(GarbledRequest, IsRefusedInOnePrintableLine) {
  const auto read = parse_control_request(GetParam().request);
  ASSERT_FALSE(read);
  const std::string& message = read.error().message;
  EXPECT_THAT(message, HasSubstr("expected"));
  EXPECT_TRUE(std::all_of(message.begin(), message.end(), [](char c) { return c >= ' ' && c <= '~'; })) << message;
}

INSTANTIATE_TEST_SUITE_P(
    Control, GarbledRequest,
    testing::Values(Garbled{"Nothing", ""}, Garbled{"Newline", "\n"}, Garbled{"NoNewline", "status"},
                    Garbled{"TwoLines", "status\nreload\n"}, Garbled{"Longer", "status now\n"},
                    Garbled{"Shorter", "statu\n"}, Garbled{"Case", "Status\n"}, Garbled{"CarriageReturn", "status\r\n"},
                    Garbled{"Nul", "status\0\n"s}, Garbled{"Space", " status\n"}, Garbled{"Bytes", "\xFF\xFE\x01\n"},
                    Garbled{"Escape", "\x1B[2Jstatus\n"}, Garbled{"NotThere", "stop\n"}, Garbled{"Half", "record\n"},
                    Garbled{"TwoSpaces", "record  on\n"}, Garbled{"TooLong", std::string(kLongestRequest, 'a') + "\n"},
                    Garbled{"Endless", std::string(100'000, '\n')}),
    [](const auto& param) { return param.param.name; });

class ControlSocket : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "perimap-control-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
    path_ = (folder_ / "control").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
  std::string path_;
};

// A server that is served while it lives.
struct Served {
  explicit Served(ControlServer server) : server_(std::move(server)), thread_([this] { server_.serve(interrupt_); }) {}
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;
  ~Served() {
    interrupt_.request();
    thread_.join();
  }
  ControlServer server_;
  Interrupt interrupt_;
  std::thread thread_;
};

ControlServer::Answer answers() {
  return [](ControlCommand command) -> Expected<std::string> {
    if (command == ControlCommand::kReload) return fail("not now");
    return std::string(name_of(command)) + " is done\n";
  };
}

TEST_F(ControlSocket, AnswersItsOwnerAndGroupAloneAndGoesWithTheServer) {
  {
    auto server = ControlServer::create(path_, answers());
    ASSERT_TRUE(server) << server.error().message;
    const Served served(std::move(*server));
    struct stat there {};
    ASSERT_EQ(stat(path_.c_str(), &there), 0);
    EXPECT_EQ(there.st_mode & 07777, 0660U);
    const auto done = ask_control(path_, "status");
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_EQ(*done, "status is done\n");
    const auto refused = ask_control(path_, "reload");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "not now");
    const auto unknown = ask_control(path_, "stop");
    ASSERT_FALSE(unknown);
    EXPECT_THAT(unknown.error().message, HasSubstr("got 'stop'"));
  }
  EXPECT_FALSE(fs::exists(path_));
  const auto nobody = ask_control(path_, "status");
  ASSERT_FALSE(nobody);
  EXPECT_THAT(nobody.error().message, HasSubstr(path_));
}

TEST_F(ControlSocket, AClientThatSaysNothingOrGoesKeepsNobodyElseOut) {
  auto server = ControlServer::create(path_, answers());
  ASSERT_TRUE(server) << server.error().message;
  const Served served(std::move(*server));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path_.begin(), path_.end(), address.sun_path);
  const auto connected = [&address] {
    Descriptor client(socket(AF_UNIX, SOCK_STREAM, 0));
    EXPECT_EQ(connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return client;
  };
  const Descriptor silent = connected();
  connected().reset();
  const Descriptor half = connected();
  EXPECT_EQ(send(half.get(), "stat", 4, 0), 4);
  const auto done = ask_control(path_, "status");
  ASSERT_TRUE(done) << done.error().message;
}

TEST_F(ControlSocket, ReplacesWhatACrashLeftButNotALivingServer) {
  {
    const Descriptor left(socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(path_.begin(), path_.end(), address.sun_path);
    ASSERT_EQ(bind(left.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  auto first = ControlServer::create(path_, answers());
  ASSERT_TRUE(first) << first.error().message;
  const auto second = ControlServer::create(path_, answers());
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another process"));
  EXPECT_FALSE(ControlServer::create((folder_ / "nowhere" / "control").string(), answers()));
  EXPECT_FALSE(ControlServer::create(std::string(200, 'x'), answers()));
}

}  // namespace
}  // namespace perimap

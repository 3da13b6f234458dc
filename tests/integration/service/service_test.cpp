// perimapd under a service manager: readiness, status line and watchdog as sd_notify(3) has them.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;

constexpr Duration kPatience = std::chrono::seconds(60);

// The manager's end of $NOTIFY_SOCKET.
class FakeServiceManager {
 public:
  explicit FakeServiceManager(fs::path path) : path_(std::move(path)), socket_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.string().copy(address.sun_path, sizeof address.sun_path - 1);
    bound_ = bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  FakeServiceManager(const FakeServiceManager&) = delete;
  FakeServiceManager& operator=(const FakeServiceManager&) = delete;
  ~FakeServiceManager() { close(socket_); }

  [[nodiscard]] bool bound() const { return bound_; }
  [[nodiscard]] const fs::path& path() const { return path_; }

  // Whether a message with `text` in it comes in time.
  bool hears(const std::string& text, Duration patience = kPatience) {
    const Instant until = MonotonicClock::now() + patience;
    for (Instant now = MonotonicClock::now(); now < until; now = MonotonicClock::now()) {
      const std::string message = receive(until - now);
      if (message.find(text) != std::string::npos) return true;
      if (!message.empty()) last_ = message;
    }
    return false;
  }
  [[nodiscard]] const std::string& last() const { return last_; }

  int count(const std::string& text, Duration duration) {
    int n = 0;
    const Instant until = MonotonicClock::now() + duration;
    while (hears(text, until - MonotonicClock::now())) ++n;
    return n;
  }

 private:
  std::string receive(Duration longest) {
    pollfd waited{socket_, POLLIN, 0};
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(longest).count() + 1;
    if (poll(&waited, 1, static_cast<int>(ms)) <= 0) return "";
    std::array<char, 4096> bytes{};
    const ssize_t size = recv(socket_, bytes.data(), bytes.size(), 0);
    return size > 0 ? std::string(bytes.data(), static_cast<std::size_t>(size)) : "";
  }

  fs::path path_;
  int socket_;
  bool bound_ = false;
  std::string last_;
};

class Service : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "perimap-service-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
    manager_ = std::make_unique<FakeServiceManager>(folder_ / "notify");
    ASSERT_TRUE(manager_->bound());
  }
  void TearDown() override {
    if (daemon_ > 0) {
      kill(daemon_, SIGKILL);
      waitpid(daemon_, nullptr, 0);
    }
    fs::remove_all(folder_);
  }

  // Devices that are not there. The camera's frames begin so long after now.
  void start(Duration camera_begins_after) {
    const double begin_s = to_seconds((MonotonicClock::now() + camera_begins_after).time_since_epoch());
    std::ofstream(folder_ / "perimapd.toml")
        << "version = 1\n[camera]\nplayback = \"" PERIMAP_TEST_RECORDING "\"\nplayback_start_s = "
        << std::to_string(begin_s)
        << "\n[tracker]\nprotocol = \"ndi\"\nport = \"tcp:127.0.0.1:1\"\n"
           "[ecg]\nprotocol = \"cyton\"\nport = \"/dev/perimap-is-not-there\"\n[dds]\ndomain = "
        << 40 + getpid() % 150 << "\n";
    daemon_ = fork();
    if (daemon_ != 0) return;
    const int log = open((folder_ / "log").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    setenv("NOTIFY_SOCKET", manager_->path().c_str(), 1);
    setenv("WATCHDOG_USEC", "800000", 1);
    unsetenv("WATCHDOG_PID");
    setenv("CYCLONEDDS_URI", "file://" PERIMAP_CYCLONEDDS_XML, 1);
    execl(PERIMAPD, "perimapd", "-c", (folder_ / "perimapd.toml").c_str(), nullptr);
    _exit(127);
  }

  // Whether the log says so in time.
  [[nodiscard]] bool logs(const std::string& text) const {
    const Instant until = MonotonicClock::now() + kPatience;
    while (MonotonicClock::now() < until) {
      std::ifstream log(folder_ / "log");
      const std::string all{std::istreambuf_iterator<char>(log), {}};
      if (all.find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }

  // Of the daemon's thread of that name; 0 when there is none.
  [[nodiscard]] pid_t thread_named(const std::string& name) const {
    for (const auto& entry : fs::directory_iterator("/proc/" + std::to_string(daemon_) + "/task")) {
      std::string comm;
      std::getline(std::ifstream(entry.path() / "comm"), comm);
      if (comm == name) return static_cast<pid_t>(std::stol(entry.path().filename().string()));
    }
    return 0;
  }

  fs::path folder_;
  std::unique_ptr<FakeServiceManager> manager_;
  pid_t daemon_ = 0;
};

TEST_F(Service, IsReadyAndFeedsTheWatchdogThoughNoDeviceAnswersAndNoFrameComes) {
  start(std::chrono::hours(1));
  ASSERT_TRUE(manager_->hears("READY=1")) << manager_->last();
  EXPECT_TRUE(manager_->hears("tracker closed")) << manager_->last();
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(manager_->hears("WATCHDOG=1")) << i;
  kill(daemon_, SIGTERM);
  EXPECT_TRUE(manager_->hears("STOPPING=1"));
  int status = 0;
  ASSERT_EQ(waitpid(daemon_, &status, 0), daemon_);
  daemon_ = 0;
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

// systemd takes an end by either for a clean one, and starts nothing again.
TEST_F(Service, AHangupReloadsTheConfigurationAndABrokenPipeIsNothing) {
  start(std::chrono::hours(1));
  ASSERT_TRUE(manager_->hears("READY=1")) << manager_->last();
  kill(daemon_, SIGPIPE);
  std::ofstream(folder_ / "perimapd.toml", std::ios::app) << "surface_lifespan_ms = 20\n[log]\nlevel = \"debug\"\n";
  kill(daemon_, SIGHUP);
  EXPECT_TRUE(
      logs("SIGHUP: the configuration is read again: in effect but for what needs a restart: "
           "dds.surface_lifespan_ms"));
  std::ofstream(folder_ / "perimapd.toml", std::ios::app) << "levle = 3\n";
  kill(daemon_, SIGHUP);
  EXPECT_TRUE(logs("SIGHUP: the configuration stays as it was: "));
  EXPECT_TRUE(logs("did you mean 'level'?"));
  EXPECT_TRUE(manager_->hears("WATCHDOG=1")) << "it has ended";
  kill(daemon_, SIGTERM);
  int status = 0;
  ASSERT_EQ(waitpid(daemon_, &status, 0), daemon_);
  daemon_ = 0;
  EXPECT_TRUE(WIFEXITED(status)) << "by signal " << WTERMSIG(status);
}

TEST_F(Service, FeedsTheWatchdogWhileFramesCome) {
  start(Duration(0));
  ASSERT_TRUE(manager_->hears("READY=1")) << manager_->last();
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(manager_->hears("WATCHDOG=1")) << i;
}

TEST_F(Service, AHungPublisherLetsTheWatchdogStarve) {
  start(std::chrono::hours(1));
  ASSERT_TRUE(manager_->hears("READY=1")) << manager_->last();
  ASSERT_TRUE(manager_->hears("WATCHDOG=1"));
  const pid_t publisher = thread_named("publisher");
  ASSERT_NE(publisher, 0);
  ASSERT_EQ(ptrace(PTRACE_SEIZE, publisher, nullptr, nullptr), 0) << "this system lets no process stop a thread";
  ASSERT_EQ(ptrace(PTRACE_INTERRUPT, publisher, nullptr, nullptr), 0);
  ASSERT_EQ(waitpid(publisher, nullptr, __WALL), publisher);
  // The beats before it hung are fed once.
  EXPECT_LE(manager_->count("WATCHDOG=1", std::chrono::seconds(2)), 2);
  EXPECT_EQ(manager_->count("WATCHDOG=1", std::chrono::seconds(1)), 0);
  ASSERT_EQ(ptrace(PTRACE_DETACH, publisher, nullptr, nullptr), 0);
  EXPECT_TRUE(manager_->hears("WATCHDOG=1")) << "it hangs no longer";
}

}  // namespace
}  // namespace perimap

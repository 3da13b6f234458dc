// Devices are unplugged and plugged in again 20 times, and fall silent, while every processor is busy: a subscriber is
// told each time, surfaces go on and say what they lack, each device recovers, and perimapd's descriptors and memory
// stay what they are. How long each word takes is printed, and asks for no more than patience; what surfaces say of a
// device that is gone is held to what is promised of it.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/publishing/wire_names.hpp"
#include "drivers/standins/emulator/ecg_emulator.hpp"
#include "drivers/standins/emulator/igtl_emulator.hpp"
#include "drivers/standins/emulator/ndi_emulator.hpp"
#include "drivers/standins/emulator/played_session.hpp"
#include "drivers/transport/tcp_stream.hpp"
#include "plugged_device.hpp"
#include "process_figures.hpp"
#include "told_states.hpp"

namespace perimap::test {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kUnplugs = 20;
constexpr int kSilences = 5;
constexpr int kRoundsToGood = 5;  // after so many rounds the surface is to be good again before the next
constexpr Duration kPatience = seconds(60);
constexpr Duration kOut = milliseconds(1000);  // longer than every word below takes
// What docs/design/phase.md and tracker.maximum_extrapolation_ms promise, and as much again for a busy machine: an ECG
// of which nothing has come for 250 ms is gone, and a pose is carried on for 20 ms.
constexpr Duration kEcgGone = milliseconds(500);
constexpr Duration kPoseGone = milliseconds(70);

// Takes a processor each, until it ends.
class Load {
 public:
  Load() {
    for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i) {
      threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
        }
      });
    }
  }

 private:
  std::vector<std::jthread> threads_;
};

class Daemon {
 public:
  Daemon(const fs::path& configuration, const fs::path& log) {
    pid_ = fork();
    if (pid_ != 0) return;
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    execl(PERIMAP_TEST_PERIMAPD, "perimapd", "-c", configuration.c_str(), nullptr);
    _exit(127);
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon() {
    if (pid_ > 0) (void)stop();
  }

  // The status that it ended with.
  int stop() {
    int status = 0;
    kill(pid_, SIGTERM);
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return status;
  }
  [[nodiscard]] bool runs() const { return kill(pid_, 0) == 0 && waitpid(pid_, nullptr, WNOHANG) == 0; }
  [[nodiscard]] long descriptors() const { return descriptors_of(pid_); }
  [[nodiscard]] long own_memory_kB() const { return own_memory_kB_of(pid_); }

 private:
  pid_t pid_ = 0;
};

enum class TrackerKind { kNdiOverTcp, kNdiOverATerminal, kIgtlOverTcp };
enum class EcgKind { kCyton, kMedlab, kBitalino };

struct Pair {
  std::string name;
  TrackerKind tracker;
  EcgKind ecg;
};

std::unique_ptr<DeviceProtocol> tracker_of(const Pair& pair, const PlayedSession& session, Instant start) {
  if (pair.tracker == TrackerKind::kIgtlOverTcp) {
    return std::make_unique<IgtlEmulator>(session.poses(start), IgtlEmulatorSettings{}, EmulatorFaults{});
  }
  return std::make_unique<NdiEmulator>(session.poses(start), NdiEmulatorSettings{.wired_tools = 1}, EmulatorFaults{});
}

std::unique_ptr<DeviceProtocol> ecg_of(const Pair& pair, const PlayedSession& session, Instant start) {
  if (pair.ecg == EcgKind::kMedlab) return emulate_medlab(session.ecg_device(start), {});
  if (pair.ecg == EcgKind::kBitalino) return emulate_bitalino(session.ecg_device(start), {});
  return emulate_cyton(session.ecg_device(start), {});
}

const char* name_of(EcgKind kind) {
  return kind == EcgKind::kMedlab ? "medlab" : kind == EcgKind::kBitalino ? "bitalino" : "cyton";
}

// While one was gone.
struct Gap {
  Instant cut;
  Instant plugged;
};

// A device on its line, and what was told of it.
class Watched {
 public:
  Watched(std::string name, perimap_SourceKind kind, std::unique_ptr<DeviceProtocol> device, Endpoint where,
          const ToldStates& told)
      : name_(std::move(name)), kind_(kind), device_(std::move(device), std::move(where)), told_(told) {}

  void plug() { since_ = device_.plug(); }
  void unplug() { since_ = device_.unplug(); }
  void silence(bool silent) { since_ = device_.silence(silent); }
  [[nodiscard]] Instant since() const { return since_; }

  // Of the last thing done to it; the times are kept. Whether the word came at all.
  [[nodiscard]] bool told_gone() { return told({perimap_SOURCE_CLOSED, perimap_SOURCE_STALLED}, gone_); }
  [[nodiscard]] bool told_back() { return told({perimap_SOURCE_OK}, back_); }
  // Prints the times since the last print, which were those of `what`.
  void print(const std::string& what) {
    fmt::print("{:<24} {:>2} times {}: told {} after {}; OK again after {}\n", name_, gone_.size(), what, states_,
               spread(gone_), spread(back_));
    (void)std::fflush(stdout);
    gone_.clear();
    back_.clear();
    states_.clear();
  }

 private:
  bool told(const std::vector<perimap_SourceState>& states, std::vector<Duration>& times) {
    const Instant deadline = MonotonicClock::now() + kPatience;
    std::optional<ToldChange> change;
    while (!(change = told_.first(kind_, states, since_))) {
      if (MonotonicClock::now() > deadline) return false;
      std::this_thread::sleep_for(milliseconds(2));
    }
    times.push_back(change->receipt - since_);
    const std::string state(perimap::name_of(change->state));
    if (change->state != perimap_SOURCE_OK && states_.find(state) == std::string::npos) {
      states_ += (states_.empty() ? "" : " or ") + state;
    }
    return true;
  }

  std::string name_;
  perimap_SourceKind kind_;
  PluggedDevice device_;
  const ToldStates& told_;
  Instant since_{};
  std::vector<Duration> gone_;
  std::vector<Duration> back_;
  std::string states_;
};

bool of_the_phase(perimap_SurfaceReason reason) {
  constexpr std::array kReasons{perimap_SURFACE_REASON_PHASE_UNKNOWN,      perimap_SURFACE_REASON_PHASE_LOST,
                                perimap_SURFACE_REASON_PHASE_FREE_RUNNING, perimap_SURFACE_REASON_PHASE_CONTRADICTED,
                                perimap_SURFACE_REASON_PHASE_FROM_IMAGE,   perimap_SURFACE_REASON_NOTHING_MAPPED};
  return std::find(kReasons.begin(), kReasons.end(), reason) != kReasons.end();
}

class DevicesGone : public ::testing::TestWithParam<Pair> {
 protected:
  void SetUp() override {
    folder_ = (fs::temp_directory_path() / "perimap-gone-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder_.data()), nullptr);
    // The domain is this process's own, so that nobody else's daemon is heard.
    domain_ = 40 + static_cast<int>(getpid() % 150);
    auto listener = TcpListener::open(0);
    ASSERT_TRUE(listener) << listener.error().message;
    port_ = listener->port();
  }
  void TearDown() override {
    if (HasFailure()) {
      std::ifstream log(fs::path(folder_) / "log");
      fmt::print("{}\n", std::string(std::istreambuf_iterator<char>(log), {}));
    }
    fs::remove_all(folder_);
  }

  [[nodiscard]] fs::path write_configuration(const Pair& pair, Instant start) const {
    const bool igtl = pair.tracker == TrackerKind::kIgtlOverTcp;
    fs::path path = fs::path(folder_) / "devices.toml";
    std::ofstream(path) << fmt::format(
        "version = 1\n"
        "[camera]\nplayback = \"{}\"\nplayback_start_s = {:.6f}\n"
        "[tracker]\nprotocol = \"{}\"\nport = \"{}\"\nframe_rate_hz = 100\n{}"
        "[ecg]\nprotocol = \"{}\"\nport = \"{}\"\n"
        "[dds]\ndomain = {}\n",
        PERIMAP_TEST_RECORDING, 1e-9 * static_cast<double>(to_ns(start)), igtl ? "igtl" : "ndi",
        format_endpoint(tracker_place(pair)), igtl ? "sensor = \"Scope\"\n" : "", name_of(pair.ecg),
        format_endpoint(ecg_place()), domain_);
    return path;
  }
  [[nodiscard]] Endpoint tracker_place(const Pair& pair) const {
    if (pair.tracker == TrackerKind::kNdiOverATerminal) return SerialEndpoint{folder_ + "/tracker"};
    return TcpEndpoint{"127.0.0.1", port_};
  }
  [[nodiscard]] Endpoint ecg_place() const { return SerialEndpoint{folder_ + "/ecg"}; }

  std::string folder_;
  int domain_ = 0;
  std::uint16_t port_ = 0;
};

// One round: both are gone, one after the other, and both come back.
void unplug_and_replug(Watched& tracker, Watched& ecg, std::vector<Gap>& tracker_gaps, std::vector<Gap>& ecg_gaps) {
  tracker.unplug();
  const Instant tracker_cut = MonotonicClock::now();
  ASSERT_TRUE(tracker.told_gone()) << "nobody is told that the tracker is gone";
  ecg.unplug();
  const Instant ecg_cut = MonotonicClock::now();
  ASSERT_TRUE(ecg.told_gone()) << "nobody is told that the ECG is gone";
  std::this_thread::sleep_until(ecg_cut + kOut);
  tracker_gaps.push_back({tracker_cut, MonotonicClock::now()});
  tracker.plug();
  ecg_gaps.push_back({ecg_cut, MonotonicClock::now()});
  ecg.plug();
  ASSERT_TRUE(tracker.told_back()) << "the tracker does not recover";
  ASSERT_TRUE(ecg.told_back()) << "the ECG does not recover";
}

void be_silent(Watched& tracker, Watched& ecg) {
  tracker.silence(true);
  ASSERT_TRUE(tracker.told_gone()) << "nobody is told that the tracker is silent";
  tracker.silence(false);
  ASSERT_TRUE(tracker.told_back()) << "the tracker does not speak again";
  ecg.silence(true);
  ASSERT_TRUE(ecg.told_gone()) << "nobody is told that the ECG is silent";
  ecg.silence(false);
  ASSERT_TRUE(ecg.told_back()) << "the ECG does not speak again";
}

// Surfaces went on while a device was gone, and none of them claims what it had not.
void expect_honest(const std::vector<ToldSurface>& surfaces, const std::vector<Gap>& tracker_gaps,
                   const std::vector<Gap>& ecg_gaps) {
  for (const Gap& gap : tracker_gaps) {
    int told = 0;
    for (const ToldSurface& s : surfaces) {
      if (s.capture < gap.cut + kPoseGone || s.capture > gap.plugged) continue;
      ++told;
      EXPECT_NE(s.state, perimap_SURFACE_GOOD) << to_seconds(s.capture - gap.cut) << " s after the tracker went";
      EXPECT_FALSE(s.camera_pose_known) << to_seconds(s.capture - gap.cut) << " s after the tracker went";
    }
    EXPECT_GT(told, 0) << "no surface while the tracker was gone";
  }
  for (const Gap& gap : ecg_gaps) {
    int told = 0;
    for (const ToldSurface& s : surfaces) {
      if (s.release < gap.cut + kEcgGone || s.release > gap.plugged) continue;
      ++told;
      EXPECT_NE(s.state, perimap_SURFACE_GOOD) << to_seconds(s.release - gap.cut) << " s after the ECG went";
      EXPECT_TRUE(of_the_phase(s.reason)) << perimap::name_of(s.reason) << " while the ECG is gone";
    }
    EXPECT_GT(told, 0) << "no surface while the ECG was gone";
  }
}

TEST_P(DevicesGone, AreToldOfAndRecoverUnderLoadTwentyTimes) {
  const Pair& pair = GetParam();
  const auto session = PlayedSession::read(PERIMAP_TEST_RECORDING);
  ASSERT_TRUE(session) << session.error().message;
  auto readers = SampleReaders::create(domain_, false);
  ASSERT_TRUE(readers) << readers.error().message;
  ToldStates told(std::move(*readers));
  // Devices and daemon are ready by then.
  const Instant start = MonotonicClock::now() + seconds(6);
  Watched tracker(pair.tracker == TrackerKind::kNdiOverTcp         ? "NDI over TCP"
                  : pair.tracker == TrackerKind::kNdiOverATerminal ? "NDI over a terminal"
                                                                   : "OpenIGTLink over TCP",
                  perimap_SOURCE_TRACKER, tracker_of(pair, *session, start), tracker_place(pair), told);
  Watched ecg(fmt::format("{} over a terminal", name_of(pair.ecg)), perimap_SOURCE_ECG, ecg_of(pair, *session, start),
              ecg_place(), told);
  tracker.plug();
  ecg.plug();
  Daemon daemon(write_configuration(pair, start), fs::path(folder_) / "log");
  const Load load;

  const auto good_again = [&] {
    const Instant since = MonotonicClock::now();
    while (!told.good_since(since) && MonotonicClock::now() < since + kPatience && daemon.runs()) {
      std::this_thread::sleep_for(milliseconds(20));
    }
    return told.good_since(since);
  };
  ASSERT_TRUE(good_again()) << "nothing is mapped to begin with";
  std::vector<Gap> tracker_gaps;
  std::vector<Gap> ecg_gaps;
  // Of moments in which both devices are there and the surface is good.
  std::vector<long> descriptors;
  std::vector<long> memory_kB;
  for (int round = 1; round <= kUnplugs; ++round) {
    ASSERT_NO_FATAL_FAILURE(unplug_and_replug(tracker, ecg, tracker_gaps, ecg_gaps)) << "round " << round;
    ASSERT_TRUE(daemon.runs()) << "round " << round;
    if (round % kRoundsToGood != 0) continue;
    ASSERT_TRUE(good_again()) << "round " << round;
    descriptors.push_back(daemon.descriptors());
    memory_kB.push_back(daemon.own_memory_kB());
  }
  tracker.print("unplugged");
  ecg.print("unplugged");
  for (int round = 0; round < kSilences; ++round) ASSERT_NO_FATAL_FAILURE(be_silent(tracker, ecg));
  tracker.print("silent");
  ecg.print("silent");
  ASSERT_TRUE(good_again());

  const std::vector<ToldSurface> surfaces = told.surfaces();
  expect_honest(surfaces, tracker_gaps, ecg_gaps);
  const std::uint64_t sent = surfaces.back().sequence - surfaces.front().sequence + 1;
  Duration longest{0};
  for (std::size_t i = 1; i < surfaces.size(); ++i) {
    longest = std::max(longest, surfaces[i].receipt - surfaces[i - 1].receipt);
  }
  fmt::print("{} of {} surfaces received, the longest pause {:.0f} ms\n", surfaces.size(), sent,
             1e3 * to_seconds(longest));
  fmt::print("descriptors {}, memory of its own {} kB, after {} rounds each\n", fmt::join(descriptors, " "),
             fmt::join(memory_kB, " "), kRoundsToGood);
  EXPECT_LT(longest, seconds(10));
  EXPECT_EQ(descriptors.back(), descriptors.front());
  EXPECT_LE(memory_kB.back() - memory_kB.front(), 4096);
  EXPECT_EQ(daemon.stop(), 0) << "it did not end by itself";
}

INSTANTIATE_TEST_SUITE_P(
    Pairs, DevicesGone,
    ::testing::Values(Pair{"NdiOverTcpAndCyton", TrackerKind::kNdiOverTcp, EcgKind::kCyton},
                      Pair{"NdiOverATerminalAndMedlab", TrackerKind::kNdiOverATerminal, EcgKind::kMedlab},
                      Pair{"OpenIgtlinkAndBitalino", TrackerKind::kIgtlOverTcp, EcgKind::kBitalino}),
    [](const auto& pair) { return pair.param.name; });

}  // namespace
}  // namespace perimap::test

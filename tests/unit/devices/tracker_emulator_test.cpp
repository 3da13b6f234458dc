// Tracker drivers and emulators together over pseudo-terminals and TCP, in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <mutex>
#include <thread>

#include "drivers/device/device_link.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "drivers/standins/emulator/igtl_emulator.hpp"
#include "drivers/standins/emulator/ndi_emulator.hpp"
#include "drivers/tracker/igtl_session.hpp"
#include "drivers/tracker/ndi_session.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

enum class Setup { kNdiOverTcp, kNdiOverATerminal, kIgtlOverTcp };

// Driver and emulated device, each on its thread.
class Session {
 public:
  Session(Setup setup, const EmulatorFaults& faults) : track_(PoseTrack::swaying(MonotonicClock::now(), 100.0)) {
    const TrackerSink sink = [this](const TrackerSample& sample) {
      const std::lock_guard lock(mutex_);
      samples_.push_back(sample);
    };
    if (setup == Setup::kIgtlOverTcp) {
      device_ = std::make_unique<IgtlEmulator>(track_, IgtlEmulatorSettings{}, faults);
      protocol_ = std::make_unique<IgtlSession>(IgtlSettings{"Scope", std::nullopt, {}}, sink, health);
    } else {
      NdiSettings settings;
      settings.frame_rate_hz = 100.0;
      device_ = std::make_unique<NdiEmulator>(track_, NdiEmulatorSettings{.wired_tools = 1}, faults);
      protocol_ = std::make_unique<NdiSession>(std::move(settings), sink, health);
    }
    const bool tcp = setup != Setup::kNdiOverATerminal;
    const std::string link =
        (std::filesystem::temp_directory_path() / ("perimap-" + std::to_string(getpid()) + "-ndi")).string();
    emulating_ = std::jthread([this, tcp, link, faults] {
      const auto ready = [this](const std::string& where) {
        const std::lock_guard lock(mutex_);
        where_ = where;
      };
      const auto done = tcp ? emulate_on_tcp(0, *device_, faults, ready, interrupt_)
                            : emulate_on_terminal(link, *device_, faults, ready, interrupt_);
      EXPECT_TRUE(done) << done.error().message;
    });
    EXPECT_TRUE(wait_until([this] { return !where().empty(); }, seconds(30)));
    driving_ = std::jthread([this] {
      const auto endpoint = parse_endpoint(where());
      ASSERT_TRUE(endpoint) << endpoint.error().message;
      serve_device(opener_of(*endpoint, NdiSettings::kFirstBaud), *protocol_, health, interrupt_);
    });
  }
  ~Session() { interrupt_.request(); }

  std::vector<TrackerSample> samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }
  std::string where() const {
    const std::lock_guard lock(mutex_);
    return where_;
  }
  const PoseTrack& track() const { return track_; }

  DeviceHealth health;

 private:
  PoseTrack track_;
  std::unique_ptr<DeviceProtocol> device_;
  std::unique_ptr<DeviceProtocol> protocol_;
  mutable std::mutex mutex_;
  std::vector<TrackerSample> samples_;
  std::string where_;
  Interrupt interrupt_;
  std::jthread emulating_;
  std::jthread driving_;
};

class OverALine : public ::testing::TestWithParam<Setup> {};

TEST_P(OverALine, PosesAreThoseOfTheInstantThatTheyAreStampedWith) {
  Session session(GetParam(), {});
  ASSERT_TRUE(wait_until([&] { return session.health.samples.get() >= 150; }, seconds(30))) << session.health.reason();
  std::vector<double> errors_mm;
  for (const TrackerSample& sample : session.samples()) {
    ASSERT_EQ(sample.state, ToolState::kOk);
    ASSERT_LE(sample.source_time, sample.arrival);
    const auto frame = (sample.source_time - session.track().start()) / milliseconds(10);
    errors_mm.push_back((session.track().at(frame).X_TO.t - sample.X_WS.t).norm());
  }
  std::nth_element(errors_mm.begin(), errors_mm.begin() + static_cast<std::ptrdiff_t>(errors_mm.size() / 2),
                   errors_mm.end());
  // The tool moves by 0.3 mm a frame; a busy machine delays device and driver, so the bound is wide.
  EXPECT_LT(errors_mm[errors_mm.size() / 2], 1.0);
  EXPECT_EQ(session.health.damaged.get(), 0U);
}

TEST_P(OverALine, UnpluggedAndPluggedInAgainItGoesOn) {
  EmulatorFaults faults;
  // Over a line without a break, an NDI session waits a second for the answer to it.
  faults.unplug_every = milliseconds(GetParam() == Setup::kNdiOverATerminal ? 1700 : 300);
  faults.unplug_for = milliseconds(100);
  Session session(GetParam(), faults);
  ASSERT_TRUE(wait_until([&] { return session.health.openings.get() >= 3; }, seconds(30))) << session.health.reason();
  const std::uint64_t before = session.health.samples.get();
  EXPECT_GT(before, 0U);
  ASSERT_TRUE(wait_until([&] { return session.health.samples.get() > before + 5; }, seconds(30)))
      << session.health.reason();
}

INSTANTIATE_TEST_SUITE_P(Tracker, OverALine,
                         ::testing::Values(Setup::kNdiOverTcp, Setup::kNdiOverATerminal, Setup::kIgtlOverTcp));

}  // namespace
}  // namespace perimap

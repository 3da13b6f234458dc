// Drivers and emulators together over real pseudo-terminals, in real time.
#include "drivers/standins/emulator/ecg_emulator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>

#include "drivers/device/device_link.hpp"
#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/cyton.hpp"
#include "drivers/ecg/medlab.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct Case {
  const char* name;
  int baud;
  double rate_hz;
  float resolution_mV;
  std::unique_ptr<EcgEmulator> (*emulate)(EcgDeviceSignals, const EmulatorFaults&);
  std::function<std::unique_ptr<EcgProtocol>(EcgSinks, DeviceHealth&)> drive;
  float full_breath = 0.0F;  // what the driver makes of a signal of 1; 0: it has no channel for it
};

const Case kCases[] = {
    {"medlab", MedlabProtocol::kBaud, 300.0, 0.02F, &emulate_medlab,
     [](EcgSinks sinks, DeviceHealth& health) {
       return std::make_unique<MedlabProtocol>(MedlabSettings{}, std::move(sinks), health);
     }},
    {"bitalino", BitalinoProtocol::kBaud, 1000.0, 0.003F, &emulate_bitalino,
     [](EcgSinks sinks, DeviceHealth& health) {
       return std::make_unique<BitalinoProtocol>(BitalinoSettings{.respiration_channel = 1}, std::move(sinks), health);
     },
     400.0F * 3300.0F / 1024.0F},
    {"cyton", CytonProtocol::kBaud, 250.0, 0.0001F, &emulate_cyton,
     [](EcgSinks sinks, DeviceHealth& health) {
       return std::make_unique<CytonProtocol>(CytonSettings{.respiration_channel = 8}, std::move(sinks), health);
     },
     1.0F},
};

// A driver and an emulated device, each on its thread.
class Session {
 public:
  Session(const Case& c, const EmulatorFaults& faults)
      : link_(
            (std::filesystem::temp_directory_path() / ("perimap-" + std::to_string(getpid()) + "-" + c.name)).string()),
        // A straight rise of 1 mV/s to 2 mV and again: a sample tells when it was measured.
        waveform_(MonotonicClock::now(), 1000.0, ramp(), true),
        // The same signal for respiration: either tells when it was measured.
        device_(c.emulate({waveform_, waveform_}, faults)),
        protocol_(c.drive({[this](const EcgBlock& block) {
                             const std::lock_guard lock(mutex_);
                             blocks_.push_back(block);
                           },
                           [this](const RespirationBlock& block) {
                             const std::lock_guard lock(mutex_);
                             breaths_.push_back(block);
                           }},
                          health)) {
    emulating_ = std::jthread([this, faults] {
      const auto done = emulate_on_terminal(
          link_, *device_, faults, [](const std::string&) {}, interrupt_);
      EXPECT_TRUE(done) << done.error().message;
    });
    driving_ = std::jthread([this, baud = c.baud] {
      serve_device(opener_of(SerialEndpoint{link_}, baud), *protocol_, health, interrupt_);
    });
  }
  ~Session() { interrupt_.request(); }

  std::vector<EcgBlock> blocks() const {
    const std::lock_guard lock(mutex_);
    return blocks_;
  }
  std::vector<RespirationBlock> breaths() const {
    const std::lock_guard lock(mutex_);
    return breaths_;
  }
  const SampledWaveform& waveform() const { return waveform_; }

  DeviceHealth health;

 private:
  static std::vector<float> ramp() {
    std::vector<float> mV;
    for (int i = 0; i < 2000; ++i) mV.push_back(-1.0F + 0.001F * static_cast<float>(i));
    return mV;
  }

  std::string link_;
  SampledWaveform waveform_;
  std::unique_ptr<EcgEmulator> device_;
  std::unique_ptr<EcgProtocol> protocol_;
  mutable std::mutex mutex_;
  std::vector<EcgBlock> blocks_;
  std::vector<RespirationBlock> breaths_;
  Interrupt interrupt_;
  std::jthread emulating_;
  std::jthread driving_;
};

class OverATerminal : public ::testing::TestWithParam<Case> {};

TEST_P(OverATerminal, SamplesArriveInOrderWithTheTimeAtWhichTheyWereMeasured) {
  Session session(GetParam(), {});
  const auto wanted = static_cast<std::uint64_t>(1.5 * GetParam().rate_hz);
  ASSERT_TRUE(wait_until([&] { return session.health.samples.get() >= wanted; })) << session.health.reason();
  std::vector<double> errors_ms;
  std::uint32_t next = 0;
  for (const EcgBlock& block : session.blocks()) {
    ASSERT_EQ(block.device_sequence, next);
    next += block.count;
    ASSERT_FALSE(block.lead_off);
    if (block.device_sequence < wanted / 3) continue;
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const float mV = block.mV[i];
      if (std::abs(mV) > 0.9F) continue;  // near the ramp's jump
      const auto true_mV = session.waveform().at(block.time_of(i));
      ASSERT_TRUE(true_mV);
      errors_ms.push_back(static_cast<double>(mV - *true_mV) * 1000.0);
    }
  }
  ASSERT_GT(errors_ms.size(), wanted / 3);
  std::nth_element(errors_ms.begin(), errors_ms.begin() + static_cast<std::ptrdiff_t>(errors_ms.size() / 2),
                   errors_ms.end());
  // Resolution of the samples, and a busy machine that delays device and driver.
  EXPECT_NEAR(errors_ms[errors_ms.size() / 2], 0.0, 22.0);
  EXPECT_EQ(session.health.damaged.get(), 0U);
  EXPECT_EQ(session.health.lost.get(), 0U);
}

TEST_P(OverATerminal, RespirationComesSampleForSampleWithTheEcg) {
  Session session(GetParam(), {});
  const auto wanted = static_cast<std::uint64_t>(GetParam().rate_hz);
  ASSERT_TRUE(wait_until([&] { return session.health.samples.get() >= wanted; })) << session.health.reason();
  std::map<std::uint32_t, std::pair<float, Instant>> breaths;
  for (const RespirationBlock& block : session.breaths()) {
    for (std::uint32_t i = 0; i < block.count; ++i) {
      breaths[block.device_sequence + i] = {block.values[i], block.time_of(i)};
    }
  }
  if (GetParam().full_breath == 0.0F) {
    EXPECT_TRUE(breaths.empty());
    return;
  }
  std::size_t compared = 0;
  for (const EcgBlock& block : session.blocks()) {
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const auto breath = breaths.find(block.device_sequence + i);
      if (breath == breaths.end()) continue;  // given after the others were asked for
      ++compared;
      EXPECT_EQ(block.time_of(i), breath->second.second);
      EXPECT_NEAR(breath->second.first / GetParam().full_breath, block.mV[i], 0.005);
    }
  }
  EXPECT_GE(compared, wanted);
}

TEST_P(OverATerminal, UnpluggedAndPluggedInAgainItGoesOn) {
  EmulatorFaults faults;
  faults.unplug_every = milliseconds(1000);  // the slowest start takes half of it
  faults.unplug_for = milliseconds(100);
  Session session(GetParam(), faults);
  ASSERT_TRUE(wait_until([&] { return session.health.openings.get() >= 3; })) << session.health.reason();
  const std::uint64_t before = session.health.samples.get();
  ASSERT_TRUE(wait_until([&] { return session.health.samples.get() > before + 20; })) << session.health.reason();
  Instant last{};
  for (const EcgBlock& block : session.blocks()) {
    EXPECT_GT(block.first_sample_time, last);
    EXPECT_LE(block.first_sample_time, block.arrival);
    last = block.first_sample_time;
  }
}

TEST_P(OverATerminal, LeadOffIsAStateOfItsOwn) {
  EmulatorFaults faults;
  faults.missing_every = milliseconds(1300);
  faults.missing_for = milliseconds(700);
  Session session(GetParam(), faults);
  const auto changes = [&] {
    int count = 0;
    bool off = false;
    for (const EcgBlock& block : session.blocks()) count += std::exchange(off, block.lead_off) != off ? 1 : 0;
    return count;
  };
  ASSERT_TRUE(wait_until([&] { return changes() >= 2; })) << session.health.reason();
}

INSTANTIATE_TEST_SUITE_P(Ecg, OverATerminal, ::testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(EcgOverATerminal, FaultsAreCountedAndDamagedFramesGiveNoSample) {
  EmulatorFaults faults;
  faults.bad_check = 0.01;
  faults.truncated = 0.01;
  faults.lost = 0.02;
  Session session(kCases[1], faults);
  ASSERT_TRUE(wait_until([&] { return session.health.samples.get() >= 2000; })) << session.health.reason();
  EXPECT_GT(session.health.damaged.get(), 0U);
  EXPECT_GT(session.health.lost.get(), 30U);
  // On a ramp of 1 mV/s two samples of a block differ by the resolution at most.
  for (const EcgBlock& block : session.blocks()) {
    for (std::uint32_t i = 1; i < block.count; ++i) {
      const float step = block.mV[i] - block.mV[i - 1];
      EXPECT_TRUE(std::abs(step) < 0.01F || step < -1.9F) << step;
    }
  }
}

}  // namespace
}  // namespace perimap

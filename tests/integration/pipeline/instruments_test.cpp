// A recording of a colour camera with an instrument in view, replayed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {
namespace {

// Where each feature of the last model was found.
class Found final : public Publication {
 public:
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& model) override {
    u_px.clear();
    for (std::uint32_t i = 0; i < model.features._length; ++i) {
      u_px.push_back(model.features._buffer[i].first_observed_px[0]);
    }
  }
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  std::vector<double> u_px;
};

class ColourReplay : public ::testing::Test {
 protected:
  static constexpr int kEdge = 120;  // px; left of it the picture is grey like an instrument

  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-colour-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // The simulated recording with its grey as the luma of a colour picture.
  std::string record() {
    const std::string file = (folder_ / "colour.mcap").string();
    const auto basis = recorded_basis(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
    EXPECT_TRUE(basis);
    auto reader = ReplayReader::open(PERIMAP_TEST_RECORDING, ReadMode::kStrict).value();
    auto event = reader.next().value();
    auto writer =
        SensorWriter::create(file, recording_facts(basis->configuration, basis->camera, "test"), arrival_of(*event))
            .value();
    for (; event; event = reader.next().value()) {
      const Instant arrival = arrival_of(*event);
      if (const auto* pose = std::get_if<TrackerSample>(&*event)) {
        EXPECT_TRUE(writer.write(*pose, arrival));
      }
      if (const auto* ecg = std::get_if<EcgBlock>(&*event)) {
        EXPECT_TRUE(writer.write(*ecg, arrival));
      }
      if (const auto* frame = std::get_if<FrameEvent>(&*event)) {
        EXPECT_TRUE(writer.write(coloured(*frame), arrival));
      }
    }
    EXPECT_TRUE(writer.finish());
    return file;
  }

  static std::vector<double> replay(const std::string& file, int workers) {
    auto setup = prepare_replay(file, std::nullopt, ReadMode::kStrict);
    EXPECT_TRUE(setup) << setup.error().error.message;
    setup->pipeline.lockstep = true;
    setup->pipeline.workers = workers;
    Found found;
    Pipeline pipeline(setup->pipeline);
    LockstepRuntime runtime(pipeline, setup->identity, setup->utc_minus_monotonic, found);
    for (auto event = setup->reader.next().value(); event; event = setup->reader.next().value()) {
      runtime.deliver(*event);
    }
    runtime.finish();
    return found.u_px;
  }

 private:
  CameraFrame coloured(const FrameEvent& frame) {
    constexpr std::uint8_t kNone = 128, kBluish = 115, kReddish = 165;
    yuyv_.clear();
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
      const bool grey = static_cast<int>(i) % frame.width < kEdge;
      const std::uint8_t chroma = grey ? kNone : i % 2 == 0 ? kBluish : kReddish;
      yuyv_.push_back(static_cast<std::byte>(40 + frame.pixels[i] * 3 / 4));  // what is dark has no colour to tell
      yuyv_.push_back(static_cast<std::byte>(chroma));
    }
    CameraFrame as_it_came;
    as_it_came.stamp = frame.stamp;
    as_it_came.format = PixelFormat::kYuyv;
    as_it_came.width = frame.width;
    as_it_came.height = frame.height;
    as_it_came.stride = row_bytes(PixelFormat::kYuyv, frame.width);
    as_it_came.bytes = yuyv_;
    return as_it_came;
  }

  std::filesystem::path folder_;
  std::vector<std::byte> yuyv_;
};

TEST_F(ColourReplay, NoFeatureBeginsOnAnInstrumentWhateverTheNumberOfWorkers) {
  const auto on_left = [](const std::vector<double>& u_px) {
    return std::count_if(u_px.begin(), u_px.end(), [](double u) { return u < kEdge; });
  };
  const std::vector<double> of_grey = replay(PERIMAP_TEST_RECORDING, 1);
  EXPECT_GT(on_left(of_grey), 10) << "nothing is to be found there anyhow";
  const std::string file = record();
  const std::vector<double> one = replay(file, 1);
  EXPECT_GT(one.size(), 10U);
  for (const double u : one) EXPECT_GE(u, kEdge + 10) << "a template reaches onto it";
  EXPECT_EQ(replay(file, 3), one);
}

}  // namespace
}  // namespace perimap

// Writes a recording with every channel that the project uses, and what it holds as JSON, for a reader to compare.
#include <cstdio>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "tests/unit/recording/samples.hpp"

namespace perimap {
namespace {

constexpr std::string_view kCalibration = "camera_matrix: [500, 0, 320]\n";
constexpr std::uint32_t kSamples = 3;

// The value, or the error as an exception.
template <class T>
T check(Expected<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

McapWriterOptions small_chunks() {
  McapWriterOptions options;
  options.chunk_bytes = 2000;
  return options;
}

class ExpectingWriter {
 public:
  explicit ExpectingWriter(const std::string& path) : writer_(check(RecordingWriter::create(path, small_chunks()))) {
    expected_ = {{"messages", nlohmann::json::array()}, {"channels", nlohmann::json::object()}};
  }

  template <class T>
  void write_channel(std::string_view name) {
    const ChannelId channel = check(writer_.add_channel<T>(name));
    expected_["channels"][std::string(name)] = topic_type<T>().schema_name();
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const auto sample = test::make_sample<T>(i);
      write(name, channel, *sample, i);
    }
    // With empty sequences and strings.
    write(name, channel, *Sample<T>(), kSamples);
  }

  void finish(const std::string& json_path) {
    check(writer_.write_attachment(attachments::kCalibration, "application/yaml",
                                   std::as_bytes(std::span(kCalibration))));
    expected_["attachments"] = {{attachments::kCalibration, kCalibration}};
    check(writer_.finish());
    std::ofstream json(json_path);
    json << expected_.dump(1) << '\n';
    if (!json.flush()) throw std::runtime_error("cannot write " + json_path);
  }

 private:
  template <class T>
  void write(std::string_view name, ChannelId channel, const T& sample, std::uint32_t sequence) {
    const Instant source_time = from_ns((std::int64_t{1} << 60) + written_++);
    const Instant arrival = source_time + std::chrono::milliseconds(5);
    check(writer_.write(channel, sample, arrival, source_time, sequence));
    expected_["messages"].push_back({{"channel", name},
                                     {"logTime", std::to_string(to_ns(arrival))},
                                     {"publishTime", std::to_string(to_ns(source_time))},
                                     {"sequence", sequence},
                                     {"value", test::to_json(sample)}});
  }

  RecordingWriter writer_;
  nlohmann::json expected_;
  int written_ = 0;
};

void run(const std::string& recording_path, const std::string& json_path) {
  ExpectingWriter writer(recording_path);
  writer.write_channel<foxglove_RawImage>(channels::kCameraImage);
  writer.write_channel<foxglove_CompressedImage>("camera/jpeg");
  writer.write_channel<perimap_TrackerPose>(channels::kTrackerPose);
  writer.write_channel<foxglove_PoseInFrame>(channels::kTrackerViewer);
  writer.write_channel<perimap_EcgSamples>(channels::kEcgSamples);
  writer.write_channel<perimap_RTriggerPulse>(channels::kRTrigger);
  writer.write_channel<perimap_RecordingInfo>(channels::kRecordingInfo);
  writer.write_channel<perimap_TruthMesh>(channels::kTruthMesh);
  writer.write_channel<perimap_TruthMotion>(channels::kTruthMotion);
  writer.write_channel<perimap_TruthCamera>(channels::kTruthCamera);
  writer.write_channel<perimap_Surface>(channels::kSurface);
  writer.write_channel<perimap_SurfaceModel>(channels::kSurfaceModel);
  writer.write_channel<perimap_SurfaceMesh>(channels::kSurfaceMesh);
  writer.write_channel<perimap_Phase>(channels::kPhase);
  writer.write_channel<perimap_Status>(channels::kStatus);
  writer.finish(json_path);
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: write_recording OUT.mcap OUT.json\n", stderr);
    return 2;
  }
  try {
    perimap::run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "write_recording: %s\n", error.what());
    return 1;
  }
  return 0;
}

// A recording of devices and of what was published of them: two seconds, whose values a test can compute by itself.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "made_publication.hpp"

namespace perimap::test {

struct MadeRecording {
  static constexpr int kFrames = 20;  // at 10 Hz; surfaces of 5 to 9 are invalid, of 10 on degraded
  static constexpr int kWidth = 64;
  static constexpr int kHeight = 48;
  static constexpr int kEcgBlock = 25;  // values of a frame's time, at 250 Hz
  static constexpr Duration kPeriod = std::chrono::milliseconds(100);

  static CameraModel lens() {
    CameraModel lens;
    lens.width = kWidth;
    lens.height = kHeight;
    lens.fx = 60.0;
    lens.fy = 61.0;
    lens.cx = 31.5;
    lens.cy = 23.5;
    lens.k1 = -0.01;
    return lens;
  }
  static Instant begin() { return from_ns(100'000'000'000); }
  static Instant release(int frame) { return begin() + frame * kPeriod; }
  static Instant capture(int frame) { return release(frame) - std::chrono::milliseconds(50); }
  static perimap_SurfaceState state(int frame) {
    if (frame < 5) return perimap_SURFACE_GOOD;
    return frame < 10 ? perimap_SURFACE_INVALID : perimap_SURFACE_DEGRADED;
  }
  static std::uint8_t pixel(int frame, int i) { return static_cast<std::uint8_t>(frame * 7 + i); }
  static float ecg_mV(int frame, int i) { return 0.01F * static_cast<float>(frame * kEcgBlock + i); }

  bool devices = true;
  bool published = true;
  bool calibration = true;
  Duration devices_clock{0};  // what has to be added to the publisher's instants to have the devices'
  McapWriterOptions options = {};

  void write(const std::string& file) const {
    auto writer = RecordingWriter::create(file, options);
    ASSERT_TRUE(writer) << writer.error().message;
    if (devices && calibration) {
      const std::string text = format_calibration(lens());
      ASSERT_TRUE(writer->write_attachment(attachments::kCalibration, "application/yaml",
                                           std::as_bytes(std::span(text.data(), text.size()))));
    }
    const ChannelId info = *writer->add_channel<perimap_RecordingInfo>(channels::kRecordingInfo);
    std::string nothing, world = "tracker";
    const perimap_RecordingInfo facts{nothing.data(), nothing.data(),
                                      published ? MadePublication::kUtcMinusMonotonic_ns : 1'000'000'000, world.data()};
    ASSERT_TRUE(writer->write(info, facts, begin(), begin(), 0));
    Channels to;
    if (devices) {
      to.image = *writer->add_channel<foxglove_RawImage>(channels::kCameraImage);
      to.pose = *writer->add_channel<perimap_TrackerPose>(channels::kTrackerPose);
      to.ecg = *writer->add_channel<perimap_EcgSamples>(channels::kEcgSamples);
    }
    if (published) {
      to.surface = *writer->add_channel<perimap_Surface>(channels::kSurface);
      to.model = *writer->add_channel<perimap_SurfaceModel>(channels::kSurfaceModel);
      to.mesh = *writer->add_channel<perimap_SurfaceMesh>(channels::kSurfaceMesh);
    }
    MadePublication made;
    for (int frame = 0; frame < kFrames; ++frame) {
      if (devices) write_devices(*writer, to, frame);
      if (published) write_published(*writer, to, made, frame);
    }
    ASSERT_TRUE(writer->finish());
  }

 private:
  struct Channels {
    ChannelId image, pose, ecg, surface, model, mesh;
  };

  void write_devices(RecordingWriter& writer, const Channels& to, int frame) const {
    const Instant at = capture(frame) + devices_clock;
    const Instant arrival = at + std::chrono::milliseconds(20);
    const auto sequence = static_cast<std::uint32_t>(frame);
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < kWidth * kHeight; ++i) pixels.push_back(pixel(frame, i));
    std::string frame_id = "endoscope", encoding = "mono8";
    foxglove_RawImage image{};
    image.frame_id = frame_id.data();
    image.width = kWidth;
    image.height = kHeight;
    image.encoding = encoding.data();
    image.step = kWidth;
    image.data = {static_cast<std::uint32_t>(pixels.size()), static_cast<std::uint32_t>(pixels.size()), pixels.data(),
                  false};
    ASSERT_TRUE(writer.write(to.image, image, arrival, at, sequence));
    perimap_TrackerPose pose{};
    pose.source_time_ns = to_ns(at);
    pose.state = frame % 4 == 3 ? perimap_TOOL_MISSING : perimap_TOOL_OK;
    pose.translation_WS_mm[0] = frame;
    pose.rotation_WS_wxyz[0] = 1.0;
    ASSERT_TRUE(writer.write(to.pose, pose, arrival, at, sequence));
    std::array<float, kEcgBlock> values{};
    for (int i = 0; i < kEcgBlock; ++i) values[static_cast<std::size_t>(i)] = ecg_mV(frame, i);
    perimap_EcgSamples ecg{};
    ecg.first_sample_time_ns = to_ns(at);
    ecg.sample_period_ns = 4'000'000;
    ecg.lead_off = frame == 7;
    ecg.ecg_mV = {kEcgBlock, kEcgBlock, values.data(), false};
    ASSERT_TRUE(writer.write(to.ecg, ecg, arrival, at, sequence));
  }

  static void write_published(RecordingWriter& writer, const Channels& to, MadePublication& made, int frame) {
    const Instant at = release(frame);
    const auto sequence = static_cast<std::uint64_t>(frame);
    const auto number = static_cast<std::uint32_t>(frame);
    ASSERT_TRUE(writer.write(to.model, made.model_at(at, sequence + 1), at, at, number));
    if (frame % 10 == 2) {
      ASSERT_TRUE(writer.write(to.mesh, made.mesh_at(at, sequence + 1), at, at, number));
    }
    perimap_Surface& surface = made.surface_at(at, sequence);
    surface.state = state(frame);
    if (surface.state == perimap_SURFACE_INVALID) surface.reason = perimap_SURFACE_REASON_PHASE_LOST;
    if (surface.state == perimap_SURFACE_DEGRADED) surface.reason = perimap_SURFACE_REASON_ECTOPIC_BEAT;
    ASSERT_TRUE(writer.write(to.surface, surface, at, at, number));
  }
};

}  // namespace perimap::test

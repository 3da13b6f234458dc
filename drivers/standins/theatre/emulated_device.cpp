#include "drivers/standins/theatre/emulated_device.hpp"

#include <fmt/format.h>

#include <array>
#include <map>
#include <utility>
#include <variant>

#include "core/error/nearest_name.hpp"
#include "drivers/transport/camera_endpoint.hpp"

namespace perimap {
namespace {

const std::map<std::string, std::string> kUsualPlaces{
    {"ndi", "tcp:127.0.0.1:8765"},         {"igtl", "tcp:127.0.0.1:18944"}, {"medlab", "/tmp/perimap-medlab"},
    {"bitalino", "/tmp/perimap-bitalino"}, {"cyton", "/tmp/perimap-cyton"}, {"can-ecg", "can:vcan0"}};

Expected<EmulatedDevice> parse_camera(const std::string& where) {
  const auto endpoint = parse_camera_endpoint(where);
  const auto* output = endpoint ? std::get_if<V4l2Endpoint>(&*endpoint) : nullptr;
  if (output == nullptr) {
    return fail(fmt::format("device 'camera': expected camera=v4l2:/dev/videoN of a video output, got '{}'", where));
  }
  return EmulatedDevice{"camera", {}, output->path};
}

}  // namespace

Expected<EmulatedDevice> parse_emulated_device(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  if (name == "camera") return parse_camera(equals == std::string::npos ? "" : text.substr(equals + 1));
  const auto usual = kUsualPlaces.find(name);
  if (usual == kUsualPlaces.end()) {
    static constexpr std::array<std::string_view, 7> kNames{"ndi",   "igtl",    "medlab", "bitalino",
                                                            "cyton", "can-ecg", "camera"};
    return fail(
        fmt::format("device '{}': expected ndi, igtl, medlab, bitalino, cyton, can-ecg or camera, then =WHERE{}", name,
                    did_you_mean(name, kNames)));
  }
  auto where = parse_endpoint(equals == std::string::npos ? usual->second : text.substr(equals + 1));
  if (!where) return fail(fmt::format("device '{}': {}", name, where.error().message));
  if (std::holds_alternative<CanEndpoint>(*where) != (name == "can-ecg")) {
    return fail(fmt::format("device '{}': cannot be at {}", name, format_endpoint(*where)));
  }
  if (const auto* tcp = std::get_if<TcpEndpoint>(&*where)) {
    if (tcp->host != "127.0.0.1" && tcp->host != "localhost") {
      return fail(fmt::format("device '{}': listens on this host alone, at tcp:127.0.0.1:{}", name, tcp->port));
    }
  }
  return EmulatedDevice{name, std::move(*where)};
}

Expected<void> check_faults(const EmulatedDevice& device, const EmulatorFaults& faults) {
  const bool can = device.name == "can-ecg";
  const bool camera = !device.video_output.empty();
  const auto refuse = [&device](const char* option, const char* why) {
    return fail(fmt::format("device '{}': cannot do {}: {}", device.name, option, why));
  };
  constexpr const char* kWholeFrames = "CAN controllers pass on whole, undamaged frames only";
  constexpr const char* kPictures = "frames of a video output have no check sums and no protocol";
  if (faults.bad_check > 0.0 && (can || camera)) return refuse("--bad-check", can ? kWholeFrames : kPictures);
  if (faults.garbled > 0.0 && (can || camera)) return refuse("--garbled", can ? kWholeFrames : kPictures);
  if (faults.truncated > 0.0 && can) return refuse("--truncated", kWholeFrames);
  return {};
}

}  // namespace perimap

// A recording of live devices for a calibration, while the user is told what is missing.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/sensors/grey_image.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/live_guide.hpp"

namespace perimap {

struct LiveSettings {
  std::string configuration;  // whose devices
  double longest_s = 120.0;
  std::string keep;           // where the recording stays; empty: it is taken away
  bool unregistered = false;  // poses are recorded as without the configuration's registration, which is to be measured
};

// The recording of a capture; taken away with it, unless it is to be kept.
class LiveRecording {
 public:
  explicit LiveRecording(std::filesystem::path file, bool kept) : file_(std::move(file)), kept_(kept) {}
  LiveRecording(LiveRecording&& other) noexcept : file_(std::move(other.file_)), kept_(other.kept_) {
    other.kept_ = true;
  }
  LiveRecording& operator=(LiveRecording&&) = delete;
  LiveRecording(const LiveRecording&) = delete;
  LiveRecording& operator=(const LiveRecording&) = delete;
  ~LiveRecording();

  [[nodiscard]] std::string file() const { return file_.string(); }

 private:
  std::filesystem::path file_;
  bool kept_;
};

// How it goes, for those who look.
struct LiveMoment {
  double elapsed_s = 0.0;
  std::string line;
  std::vector<double> seen_of_ninths;  // LiveGuide's
  GreyImage picture;                   // the newest frame that the guide has seen, borrowed; none: empty
};

// Several times a second.
using LiveTold = std::function<void(const LiveMoment&)>;

// Records what the configuration's devices give until the guide has enough, the longest time is over, or a signal
// comes. `tool`: whose poses the guide follows. Fails when the configuration names no such device, or nothing comes.
[[nodiscard]] SetupExpected<LiveRecording> record_live(const LiveSettings& settings, const std::string& tool,
                                                       LiveGuide& guide, const LiveTold& told);

}  // namespace perimap

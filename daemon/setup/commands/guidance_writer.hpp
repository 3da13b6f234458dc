// Tells pages elsewhere (perimap view) how a calibration from live devices goes.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/writer.hpp"
#include "daemon/setup/live_recording.hpp"

extern "C" {
#include "perimap_guidance.h"
}

namespace perimap {

// The picture as a JPEG for looking at, `most_px` wide at most; empty where there is none.
[[nodiscard]] std::string small_jpeg(const GreyImage& picture, int most_px);

// Of one thread.
class GuidanceWriter {
 public:
  // `what`: "calibrate hand-eye". `longest_s`: when the recording is ended, enough or not.
  [[nodiscard]] static Expected<GuidanceWriter> create(const dds::Membership& membership, std::string what,
                                                       double longest_s);

  // A picture is made and sent only while somebody looks. Fails when DDS does not take it.
  [[nodiscard]] Expected<void> tell(const LiveMoment& moment);
  // After the last moment: what was recorded is being measured.
  [[nodiscard]] Expected<void> recorded();

 private:
  GuidanceWriter(dds::Participant participant, dds::Writer<perimap_Guidance> writer, std::string what, double longest_s)
      : participant_(std::move(participant)),
        writer_(std::move(writer)),
        what_(std::move(what)),
        longest_s_(longest_s) {}
  [[nodiscard]] Expected<void> write(unsigned char stage, const std::string& picture);

  dds::Participant participant_;
  dds::Writer<perimap_Guidance> writer_;
  std::string what_;
  double longest_s_;
  // What was told last.
  double elapsed_s_ = 0.0;
  std::string line_;
  std::vector<unsigned char> seen_percent_;
};

}  // namespace perimap

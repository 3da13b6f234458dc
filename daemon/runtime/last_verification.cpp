#include "daemon/runtime/last_verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/time/instant.hpp"
#include "drivers/calibration/calibration_facts.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {

VerifiedSetUp verified_set_up_of(const Configuration& configuration, const std::optional<CameraModel>& camera) {
  const TrackerConfiguration& tracker = configuration.tracker;
  VerifiedSetUp set_up;
  std::copy(std::begin(tracker.translation_SC_mm), std::end(tracker.translation_SC_mm),
            set_up.translation_SC_mm.begin());
  std::copy(std::begin(tracker.rotation_SC_wxyz), std::end(tracker.rotation_SC_wxyz), set_up.rotation_SC_wxyz.begin());
  set_up.time_offset_ms = 1e3 * to_seconds(tracker.time_offset);
  if (camera) set_up.lens = lens_numbers(*camera);
  if (configuration.camera.turned_scope) {
    set_up.turned_scope = calibration_fact(*configuration.camera.turned_scope, "date").value_or("");
  }
  return set_up;
}

LastVerification last_verification(const std::filesystem::path& configuration_file, const Configuration& configuration,
                                   const std::optional<CameraModel>& camera) {
  LastVerification last;
  if (configuration.tracker.protocol == TrackerConfiguration::Protocol::kNone) return last;
  const std::filesystem::path file = verification_file_of(configuration_file);
  auto text = read_verification(file);
  if (!text || !*text) {
    last.doubtful = !text;
    last.line = text ? fmt::format("the set-up has not been verified: perimap verify {} says whether it is right",
                                   configuration_file.string())
                     : text.error().message;
    return last;
  }
  auto record = parse_verification(**text, file.string());
  if (!record) {
    last.doubtful = true;
    last.line = record.error().message;
    return last;
  }
  record->changed_since = !(record->set_up == verified_set_up_of(configuration, camera));
  last.text = record->changed_since ? as_changed_since(**text) : **text;
  last.line = "set-up verified: " + words_of(*record);
  last.doubtful = record->is_doubtful();
  return last;
}

LastVerification last_verification(const std::filesystem::path& configuration_file,
                                   const Configuration& configuration) {
  std::optional<CameraModel> camera;
  if (configuration.camera.calibration) {
    if (auto read = read_calibration(*configuration.camera.calibration)) camera = *read;
  }
  return last_verification(configuration_file, configuration, camera);
}

}  // namespace perimap

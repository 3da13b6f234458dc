#include "daemon/config/session_keys.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace perimap {
namespace {

struct SessionSection {
  std::string_view section;
  std::array<std::string_view, 11> keys;  // empty: all but `except`
  std::string_view except;
};

constexpr std::array<SessionSection, 7> kSessionSections{
    {{"", {"version"}, ""},
     {"camera", {"width", "height", "frame_rate_hz", "exposure_ms", "gain", "repeats_allowed"}, ""},
     {"tracker",
      {"position_deviation_mm", "rotation_deviation_deg", "error_correlation_s", "time_offset_ms",
       "maximum_extrapolation_ms", "hand_eye_translation_SC_mm", "hand_eye_rotation_SC_wxyz", "sensor", "pointer",
       "second_sensor", "patient_tool"},
      ""},
     {"ecg", {"repeats_allowed", "r_trigger", "r_trigger_delay_ms", "r_trigger_deviation_ms"}, ""},
     {"phase", {}, ""},
     {"respiration", {}, "device_channel"},
     {"estimation", {}, ""}}};

}  // namespace

bool describes_session(const ConfigurationKey& key) {
  return std::any_of(kSessionSections.begin(), kSessionSections.end(), [&key](const SessionSection& s) {
    if (key.section != s.section) return false;
    if (s.keys.front().empty()) return key.name != s.except;
    return std::find(s.keys.begin(), s.keys.end(), key.name) != s.keys.end();
  });
}

}  // namespace perimap

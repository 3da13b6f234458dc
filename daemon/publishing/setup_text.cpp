#include "daemon/publishing/setup_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/setup_watch/setup_deviation.hpp"
#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

bool is_blamed(const perimap_SetupWatch& setup, SetupPart part) { return setup.blamed[static_cast<std::size_t>(part)]; }

std::string_view key_of(SetupPart part) {
  switch (part) {
    case SetupPart::kHandEyeTurn:
      return "hand_eye_turn";
    case SetupPart::kHandEyeAcross:
      return "hand_eye_across";
    case SetupPart::kHandEyeAlong:
      return "hand_eye_along";
    case SetupPart::kFocalLength:
      return "focal_length";
    case SetupPart::kPrincipalPoint:
      return "principal_point";
    case SetupPart::kTimeOffset:
      return "time_offset";
  }
  return "unknown";
}

std::string words_of(const perimap_SetupWatch& setup, SetupPart part) {
  const double* n = setup.numbers;
  const double* d = setup.deviations;
  switch (part) {
    case SetupPart::kHandEyeTurn:
      return fmt::format(
          "the camera is turned by {:.1f} deg against the hand-eye ({:+.1f}, {:+.1f}, {:+.1f} about its x, y, z, +- "
          "{:.1f})",
          std::hypot(n[0], n[1], n[2]) / kDegree, n[0] / kDegree, n[1] / kDegree, n[2] / kDegree,
          std::max({d[0], d[1], d[2]}) / kDegree);
    case SetupPart::kHandEyeAcross:
      return fmt::format(
          "the camera is {:.1f} mm beside where the hand-eye has it ({:+.1f}, {:+.1f} along its x, y, +- {:.1f})",
          std::hypot(n[3], n[4]), n[3], n[4], std::max(d[3], d[4]));
    case SetupPart::kHandEyeAlong:
      return fmt::format("the camera is {:.1f} mm {} where the hand-eye has it (+- {:.1f})", std::abs(n[5]),
                         n[5] < 0 ? "behind" : "before", d[5]);
    case SetupPart::kFocalLength:
      return fmt::format("the focal length is {:.1f} % {} than calibrated (+- {:.1f})", std::abs(n[6]) * 100.0,
                         n[6] < 0 ? "shorter" : "longer", d[6] * 100.0);
    case SetupPart::kPrincipalPoint:
      return fmt::format("the principal point is ({:+.0f}, {:+.0f}) px beside the calibrated one (+- {:.0f})", n[7],
                         n[8], std::max(d[7], d[8]));
    case SetupPart::kTimeOffset:
      return fmt::format("tracker.time_offset_ms is {:.0f} too {} (+- {:.0f})", std::abs(n[9]) * 1e3,
                         n[9] < 0 ? "large" : "small", d[9] * 1e3);
  }
  return {};
}

std::string_view remedy_of(SetupPart part) {
  switch (part) {
    case SetupPart::kHandEyeTurn:
    case SetupPart::kHandEyeAcross:
    case SetupPart::kHandEyeAlong:
      return "has the sensor slipped on the scope, or the scope been turned in its head? perimap calibrate hand-eye";
    case SetupPart::kFocalLength:
    case SetupPart::kPrincipalPoint:
      return "has zoom, focus or the scope been changed, or the picture been cropped? perimap calibrate camera";
    case SetupPart::kTimeOffset:
      return "has the video's processing been changed? perimap calibrate time";
  }
  return {};
}

Json numbers_json(const double (&n)[kSetupNumbers]) {
  return {{"hand_eye_turn_deg", {n[0] / kDegree, n[1] / kDegree, n[2] / kDegree}},
          {"hand_eye_move_mm", {n[3], n[4], n[5]}},
          {"focal_length_percent", n[6] * 100.0},
          {"principal_point_px", {n[7], n[8]}},
          {"time_offset_ms", n[9] * 1e3}};
}

}  // namespace

std::string setup_words(const perimap_SetupWatch& setup) {
  std::vector<std::string> blamed;
  std::vector<std::string_view> remedies;
  for (const SetupPart part : kSetupParts) {
    if (!is_blamed(setup, part)) continue;
    blamed.push_back(words_of(setup, part));
    const std::string_view remedy = remedy_of(part);
    if (std::find(remedies.begin(), remedies.end(), remedy) == remedies.end()) remedies.push_back(remedy);
  }
  switch (setup.state) {
    case perimap_SETUP_DOUBTED:
      return fmt::format("doubted, positions are off by {:.1f} mm: {}; {}", setup.surface_mm,
                         fmt::join(blamed, ", and "), fmt::join(remedies, "; "));
    case perimap_SETUP_CONSISTENT:
      return "agrees with what is seen";
    case perimap_SETUP_UNDETERMINED:
      return "not told yet: a wrong one would not show, or has shown once; move the scope sideways";
    case perimap_SETUP_UNKNOWN:
      return setup.windows == 0 ? "not judged yet"
                                : "not told: no motions explain what is seen with it; was the hand-eye ever measured? "
                                  "perimap calibrate hand-eye";
  }
  return "unknown";
}

Json setup_json(const perimap_SetupWatch& setup) {
  std::vector<std::string_view> blamed;
  for (const SetupPart part : kSetupParts) {
    if (is_blamed(setup, part)) blamed.push_back(key_of(part));
  }
  const bool ever = setup.first_doubted_ns != 0;
  return {{"state", name_of(setup.state)},
          {"asked", setup.asked},
          {"doubted", setup.state == perimap_SETUP_DOUBTED},
          {"number", blamed.empty() ? Json(nullptr) : Json(fmt::format("{}", fmt::join(blamed, "+")))},
          {"deviation", numbers_json(setup.numbers)},
          {"uncertainty", numbers_json(setup.deviations)},
          {"surface_mm", setup.surface_mm},
          {"surface_deviation_mm", setup.surface_deviation_mm},
          {"widened_mm", setup.widened_mm},
          {"windows", setup.windows},
          {"doubted_after_s", ever ? Json(static_cast<double>(setup.first_doubted_ns) / 1e9) : Json(nullptr)},
          {"words", setup_words(setup)}};
}

}  // namespace perimap

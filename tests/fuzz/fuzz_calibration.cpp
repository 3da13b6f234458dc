// Any bytes as a calibration file: an error of one line, or a camera that prints and reads back to itself.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/calibration/calibration_file.hpp"
#include "tests/fuzz/one_line_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Expected<CameraModel> camera = parse_calibration(text, "fuzz.yaml");
  if (!fuzz::is_value(camera)) return 0;
  const Expected<CameraModel> again = parse_calibration(format_calibration(*camera), "again.yaml");
  if (!again || again->fx != camera->fx || again->cy != camera->cy || again->k3 != camera->k3) std::abort();
  return 0;
}

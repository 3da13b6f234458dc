// What `perimap calibrate camera` says of a lens: as text, as JSON, and as a calibration file.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/setup/board.hpp"
#include "daemon/setup/camera_calibration.hpp"

namespace perimap {

// `without`: the pictures in which the board is not seen.
[[nodiscard]] std::string text_of(const CameraCalibration& result, const Board& board,
                                  const std::vector<std::string>& without);
[[nodiscard]] nlohmann::json json_of(const CameraCalibration& result, const Board& board,
                                     const std::vector<std::string>& without);

// As OpenCV writes calibrations, with date, figures and board in keys of their own.
[[nodiscard]] std::string calibration_text_of(const CameraCalibration& result, const Board& board,
                                              const std::string& date);

}  // namespace perimap

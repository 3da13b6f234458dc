#include "daemon/setup/commands/calibrate_time.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/board_motion.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "daemon/setup/signal_offset.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

struct TimeOptions {
  BoardMotionOptions motion;
  std::vector<std::string> signals;
  double largest_offset_s = 1.0;
};

// By the motion of a board in view: what hand-eye calibration says of the clocks.
SetupExpected<Measurement> measure_recorded(const TimeOptions& options, const Console& console) {
  HandEyeSettings settings;
  settings.largest_offset_s = options.largest_offset_s;
  const auto result = hand_eye_of(options.motion, settings, console);
  if (!result) return tl::unexpected(result.error());
  const std::string& recording = options.motion.recorded.recording;
  if (!result->offset_measured) {
    return fail(recording +
                ": the board is seen too seldom to lay its motion over the tracker's: keep it in view and swing the "
                "scope on and on");
  }
  if (!result->is_brisk()) {
    return fail(fmt::format(
        "{}: nothing moved briskly ({:.2f} rad/s within half a second, {:g} and more are needed), and what is wrong "
        "with the lens then passes for time: swing the scope briskly now and then, and record again",
        recording, result->brisk_rad_per_s, HandEyeCalibration::kLeastBrisk_rad_per_s));
  }
  Measurement measured{
      offset_text_of(*result), offset_json_of(*result), {{"time_offset_ms", number_of(1e3 * result->offset_s)}}};
  measured.plots = plots_of(*result);
  return measured;
}

SetupExpected<Measurement> measure(const TimeOptions& options, const Console& console) {
  if (options.motion.is_recorded()) return measure_recorded(options, console);
  if (options.signals.size() != 2) {
    return wrong_setup("calibrate time takes two signals, --signal A.csv --signal B.csv, or a recording with --from");
  }
  const auto first = read_signal_table(options.signals[0], options.motion.common.unit_of_times());
  if (!first) return tl::unexpected(first.error());
  const auto second = read_signal_table(options.signals[1], options.motion.common.unit_of_times());
  if (!second) return tl::unexpected(second.error());
  const auto result = measure_signal_offset(first->values, second->values, options.largest_offset_s);
  if (!result) return tl::unexpected(result.error());
  Measurement measured{text_of(*result), json_of(*result), {{"time_offset_ms", number_of(1e3 * result->offset_s)}}};
  measured.plots = plots_of(*result, first->values, second->values);
  return measured;
}

}  // namespace

void add_calibrate_time(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<TimeOptions>();
  Command& command = commands.add(
      calibrate, "time", "The offset of two clocks, from a motion that both devices recorded",
      [options](const Console& console) {
        return measure_motion(options->motion, options->signals, console, [&] { return measure(*options, console); });
      });
  command.add_option("--signal", options->signals,
                     "Time and value, twice: first the camera's, then the tracker's. Gain and sign are found");
  add_board_motion(command, options->motion);
  command.add_option("--largest-offset-s", options->largest_offset_s, "The clocks differ by no more")
      ->check(Range(0.0, 3600.0))
      ->capture_default_str();
  add_time_unit(command, options->motion.common);
  add_common(command, options->motion.common, false, true);
}

}  // namespace perimap

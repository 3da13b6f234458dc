#include "daemon/setup/commands/recorded_options.hpp"

#include <utility>

#include "daemon/command_line/command.hpp"
#include "daemon/setup/commands/frame_progress.hpp"

namespace perimap {

void add_from(Command& command, std::string& recording) {
  command.add_option("--from", recording, "A recording of perimap record (MCAP) in place of files");
}

void add_lens_and_board(Command& command, RecordedOptions& options) {
  command.add_option("--calibration", options.calibration,
                     "With --from: the lens, as perimap calibrate camera writes it [what the configuration names]");
  add_board(command, options.board);
  command.add_option("--board-tool", options.board_tool,
                     "With --from: the tracked tool that is fast on the board, as instrument/board; the board may be "
                     "moved then [it lies still]");
}

bool has_lens_or_board(const RecordedOptions& options) {
  return !options.calibration.empty() || !options.board_tool.empty() || options.board != BoardOptions{};
}

SetupExpected<MotionSource> source_of(const RecordedOptions& options, const std::string& configuration) {
  auto board = wish_of(options.board);
  if (!board) return tl::unexpected(board.error());
  return MotionSource{
      options.recording, options.calibration, {configuration, options.live}, *std::move(board), options.board_tool};
}

SetupExpected<void> check_motion_options(const RecordedOptions& options, const std::string& configuration) {
  if (!options.board_tool.empty() && options.recording.empty()) {
    return wrong_setup("--board-tool: expected --from; what is guided live is told by a board that lies still");
  }
  const auto source = source_of(options, configuration);
  if (!source) return tl::unexpected(source.error());
  return check_source(*source);
}

SetupExpected<RecordedMotion> motion_of(const RecordedOptions& options, const std::string& configuration,
                                        const Console& console) {
  const auto source = source_of(options, configuration);
  if (!source) return tl::unexpected(source.error());
  return recorded_motion(*source, FrameProgress(console));
}

}  // namespace perimap

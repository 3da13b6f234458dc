#include "daemon/setup/commands/calibrate_target.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/board_options.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/marker_dictionary.hpp"
#include "daemon/setup/printed_target.hpp"
#include "drivers/board/board_pattern.hpp"

namespace perimap {
namespace {

struct CalibrateTargetOptions {
  BoardOptions board{"charuco", "", 8.0, 0.0, "4X4_100"};
  std::string page = "A4";
  std::string pdf;
};

Expected<BoardPattern> pattern_of(const CalibrateTargetOptions& options) {
  const auto wish = wish_of(options.board);
  if (!wish) return tl::unexpected(wish.error().error);
  const bool sized = wish->columns > 0;
  if (wish->kind == BoardKind::kChessboard) {
    return chessboard_pattern(sized ? wish->columns : 9, sized ? wish->rows : 6, wish->square_mm);
  }
  if (wish->kind != BoardKind::kCharuco)
    return fail("--board: expected charuco or chessboard, the boards that are made");
  const auto dictionary = dictionary_named(wish->dictionary);
  if (!dictionary) return tl::unexpected(dictionary.error());
  const double marker_mm = wish->marker_mm > 0.0 ? wish->marker_mm : 0.75 * wish->square_mm;
  auto pattern =
      charuco_pattern(sized ? wish->columns : 12, sized ? wish->rows : 9, wish->square_mm, marker_mm, *dictionary);
  if (pattern) pattern->name += ", dictionary " + wish->dictionary;
  return pattern;
}

Outcome run(const CalibrateTargetOptions& options) {
  const auto pattern = pattern_of(options);
  if (!pattern) return refuse(pattern.error(), ExitCode::kWrongUsage);
  const auto paper = paper_named(options.page);
  if (!paper) return refuse(paper.error(), ExitCode::kWrongUsage);
  const auto target = print_target(*pattern, *paper);
  if (!target) return refuse(target.error(), ExitCode::kWrongUsage);
  if (const auto written = write_kept(options.pdf, target->pdf); !written) return refuse(written.error());
  fmt::print(
      "{}: {} on {} ({:g} x {:g} mm). Print it at 100 %, measure its line of 100 mm, glue it on something flat.\n",
      options.pdf, pattern->name, paper->name, target->page_width_mm, target->page_height_mm);
  return {};
}

}  // namespace

void add_calibrate_target(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<CalibrateTargetOptions>();
  Command& command = commands.add(calibrate, "target", "A board to print: exact millimetres, as PDF",
                                  [options](const Console&) { return run(*options); });
  command.add_option("--pdf", options->pdf, "The file to write")->required();
  add_board(command, options->board);
  command.add_option("--page", options->page, "A4, A3, A2 or letter")->capture_default_str();
}

}  // namespace perimap

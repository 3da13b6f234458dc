#include "daemon/setup/commands/board_options.hpp"

#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/command_line/command.hpp"

namespace perimap {
namespace {

const std::vector<std::pair<std::string, BoardKind>>& kinds() {
  static const std::vector<std::pair<std::string, BoardKind>> all = {
      {"chessboard", BoardKind::kChessboard},
      {"charuco", BoardKind::kCharuco},
      {"markers", BoardKind::kMarkers},
      {"circles", BoardKind::kCircles},
      {"asymmetric-circles", BoardKind::kAsymmetricCircles}};
  return all;
}

}  // namespace

void add_board(Command& command, BoardOptions& options) {
  std::vector<std::string> names{"auto"};
  for (const auto& [name, kind] : kinds()) names.push_back(name);
  command.add_option("--board", options.board, "What the board is; auto: it is looked for")
      ->check(OneOf(names))
      ->capture_default_str();
  command.add_option(
      "--size", options.size,
      "COLUMNSxROWS: a chessboard's inner corners, a ChArUco board's squares, markers or circles; none: looked for");
  command.add_option("--square-mm", options.square_mm, "Side of a square, or distance of neighbours")
      ->check(Range(0.01, 1e4));
  command.add_option("--marker-mm", options.marker_mm, "Side of a marker")->check(Range(0.01, 1e4));
  command.add_option("--dictionary", options.dictionary, "Of the markers, such as 4X4_250 or APRILTAG_36h11");
}

SetupExpected<BoardWish> wish_of(const BoardOptions& options) {
  BoardWish wish;
  wish.square_mm = options.square_mm;
  wish.marker_mm = options.marker_mm;
  wish.dictionary = options.dictionary;
  for (const auto& [name, kind] : kinds()) {
    if (options.board == name) wish.kind = kind;
  }
  if (options.size.empty()) return wish;
  const std::size_t cross = options.size.find('x');
  const auto side = [](std::string_view text, int& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && value >= 2 && value <= 100;
  };
  const std::string_view size = options.size;
  if (cross == std::string::npos || !side(size.substr(0, cross), wish.columns) ||
      !side(size.substr(cross + 1), wish.rows)) {
    return wrong_setup("--size: expected COLUMNSxROWS, such as 9x6, got " + options.size);
  }
  return wish;
}

}  // namespace perimap

// What a command is told of the board that is to be found in pictures.
#pragma once

#include <string>

#include "daemon/config/setup_error.hpp"
#include "daemon/setup/board.hpp"

namespace perimap {

class Command;
struct BoardOptions {
  std::string board = "auto";
  std::string size;
  double square_mm = 0.0;
  double marker_mm = 0.0;
  std::string dictionary;

  friend bool operator==(const BoardOptions&, const BoardOptions&) = default;
};

// --board, --size, --square-mm, --marker-mm and --dictionary.
void add_board(Command& command, BoardOptions& options);

[[nodiscard]] SetupExpected<BoardWish> wish_of(const BoardOptions& options);

}  // namespace perimap

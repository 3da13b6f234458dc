#include "daemon/standins/options/bench_options.hpp"

#include <map>

namespace perimap {

void BenchOptions::add_to(Command& command) {
  command
      .add_option_function<std::string>(
          "--scene",
          [this](const std::string& name) {
            const std::map<std::string, BenchAct> acts{
                {"board", BenchAct::kBoard}, {"still", BenchAct::kStill}, {"landmarks", BenchAct::kLandmarks}};
            const auto act = acts.find(name);
            act_ = act == acts.end() ? std::nullopt : std::optional(act->second);
          },
          "heart; or what calibrations are made from: board (the scope is swung about a board, a pointer about the "
          "board's origin), still (both lie still), landmarks (six of a patient's are touched) [heart]")
      ->check(OneOf({"heart", "board", "still", "landmarks"}));
  command.add_option("--board", board_, "The board of such a scene: squares of 8 mm, 10x7 or 12x9 of them")
      ->check(OneOf({"chessboard", "charuco"}))
      ->capture_default_str();
  command.add_flag("--board-held", board_is_held_,
                   "Of --scene board: another hand holds the board, on which there is a tracked sensor, "
                   "instrument/board [it lies still]");
  command.add_option("--truth", truth_, "Of such a scene: write to this file what is to be found (JSON)");
  command.add_option("--landmarks", landmarks_,
                     "Of such a scene: write the landmarks of the patient's image to this file, for perimap register");
}

Expected<void> BenchOptions::check() const {
  if (!act_ && (!truth_.empty() || !landmarks_.empty())) {
    return fail("--truth, --landmarks: expected --scene board, still or landmarks");
  }
  if (board_is_held_ && act_ != BenchAct::kBoard) return fail("--board-held: expected --scene board");
  return {};
}

Expected<BoardPattern> BenchOptions::board() const {
  constexpr int kDictionary4x4_100 = 1;
  return board_ == "chessboard" ? chessboard_pattern(9, 6, 8.0) : charuco_pattern(12, 9, 8.0, 6.0, kDictionary4x4_100);
}

}  // namespace perimap

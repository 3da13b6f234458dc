// What the command line may say of a simulated bench on which a set-up is measured.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/command_line/command.hpp"
#include "drivers/standins/simulator/bench_scene.hpp"

namespace perimap {

class BenchOptions {
 public:
  // The command writes into this object when it is parsed.
  void add_to(Command& command);

  [[nodiscard]] const std::optional<BenchAct>& act() const noexcept { return act_; }  // none: a heart
  // That nothing is asked of a heart that only a bench has. Errors name the option.
  [[nodiscard]] Expected<void> check() const;
  // A4 paper takes either; a scope at 15 cm sees most of it.
  [[nodiscard]] Expected<BoardPattern> board() const;
  [[nodiscard]] bool board_is_held() const noexcept { return board_is_held_; }

  // To be written; empty: not asked for.
  [[nodiscard]] const std::filesystem::path& truth() const noexcept { return truth_; }
  [[nodiscard]] const std::filesystem::path& landmarks() const noexcept { return landmarks_; }

 private:
  std::optional<BenchAct> act_;
  std::string board_ = "charuco";
  bool board_is_held_ = false;
  std::filesystem::path truth_;
  std::filesystem::path landmarks_;
};

}  // namespace perimap

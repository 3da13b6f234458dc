#include "daemon/standins/options/unrecorded_options.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/nested_options.hpp"
#include "daemon/command_line/shell_words.hpp"
#include "daemon/standins/options/heart_settings.hpp"

namespace perimap {
namespace {

constexpr std::array<std::string_view, 4> kOfFiles{"--force", "--tracker-noises", "--untold", "--write-procedure"};
constexpr std::array<std::string_view, 5> kOfBench{"--scene", "--board", "--board-held", "--truth", "--landmarks"};

bool is_option(const std::string& word, std::string_view name) {
  return word.starts_with(name) && (word.size() == name.size() || word[name.size()] == '=');
}

// What perimap simulate takes, and a session without a file does not.
Expected<void> check_words(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    for (const std::string_view name : kOfFiles) {
      if (is_option(word, name)) {
        return fail(
            fmt::format("{}: expected no option of what perimap simulate writes, since no file is written", name));
      }
    }
    for (const std::string_view name : kOfBench) {
      if (is_option(word, name)) return fail(fmt::format("{}: expected a heart, since a bench is not replayed", name));
    }
  }
  return {};
}

Expected<UnrecordedOptions> parse_words(const std::vector<std::string>& words) {
  if (auto known = check_words(words); !known) return tl::unexpected(known.error());
  SimulationOptions simulation;
  ScopeOptions scope;
  unsigned threads = 0;
  bool tool = false;
  const auto parsed = parse_nested_options(words, [&](Command& command) {
    simulation.add_to(command);
    simulation.add_procedure_to(command);
    scope.add_to(command);
    command.add_option("--threads", threads)->check(Range(1U, 256U));
    command.add_flag("--tool", tool);
  });
  if (!parsed) return tl::unexpected(parsed.error());
  if (auto sound = scope.check(std::nullopt); !sound) return tl::unexpected(sound.error());
  auto settings = heart_settings(simulation, scope);
  if (!settings) return tl::unexpected(settings.error());
  return UnrecordedOptions{*std::move(settings), simulation.noise(), rendering_threads(threads), tool};
}

}  // namespace

Expected<UnrecordedOptions> parse_unrecorded(const std::string& option, const std::string& text) {
  auto parsed = split_as_a_shell(text).and_then(parse_words);
  if (parsed) return parsed;
  return tl::unexpected(told_of_option(option, parsed.error()));
}

}  // namespace perimap

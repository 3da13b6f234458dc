// A command's options. CLI11 parses them; its headers, which take longer to compile than most commands, stay in
// command.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace perimap {

// Numbers from the first to the last, both included.
struct Range {
  using Bounds = std::variant<std::pair<double, double>, std::pair<std::int64_t, std::int64_t>,
                              std::pair<std::uint64_t, std::uint64_t>>;
  Bounds bounds;

  Range(double first, double last) : bounds(std::pair(first, last)) {}
  Range(int first, int last) : bounds(std::pair<std::int64_t, std::int64_t>(first, last)) {}
  Range(unsigned first, unsigned last) : bounds(std::pair<std::uint64_t, std::uint64_t>(first, last)) {}
  Range(std::uint64_t first, std::uint64_t last) : bounds(std::pair(first, last)) {}
};

// One of these words.
struct OneOf {
  std::vector<std::string> words;

  OneOf(std::initializer_list<std::string> of) : words(of) {}
  template <class Words>
  explicit OneOf(const Words& of) : words(std::begin(of), std::end(of)) {}
};

// One option, or one argument without a name. What it returns is itself, so that all can be said in one expression.
class Option {
 public:
  explicit Option(CLI::Option& option) noexcept : option_(&option) {}

  Option* required();
  // The help tells the value that is there before anything is parsed.
  Option* capture_default_str();
  Option* check(const Range& range);
  Option* check(const OneOf& words);
  // So many values.
  Option* expected(int count);
  // Several values in one, with this between them.
  Option* delimiter(char separator);
  // One value each time that it is given; what comes after is another's.
  Option* one_at_a_time();
  // Not both.
  Option* excludes(const Option* other);
  // What it does is done when it is met, not when all is parsed.
  Option* trigger_on_parse();

  // How often it was given.
  [[nodiscard]] std::size_t count() const;

 private:
  CLI::Option* option_;
};

class Command {
 public:
  explicit Command(CLI::App& app);
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  ~Command();

  // `names`: "--long", "-s,--long", or "NAME" of an argument without dashes. The value is set when the command line is
  // parsed. Text, paths, numbers, several of them, and optional ones; command.cpp has the list.
  template <class Value>
  Option* add_option(const std::string& names, Value& value, const std::string& description = "");
  // Given or not.
  Option* add_flag(const std::string& names, bool& given, const std::string& description = "");
  // For what has to be taken apart: text, or several texts or numbers.
  template <class Value>
  Option* add_option_function(const std::string& names, const std::function<void(const Value&)>& take,
                              const std::string& description = "");
  // Options under a heading of their own in the help.
  Command& add_option_group(const std::string& name);
  // The heading under which the command itself stands in its program's help; empty: it is not told of.
  void group(const std::string& name);
  // What the help ends with.
  void footer(const std::string& text);

  [[nodiscard]] CLI::App& app() noexcept { return app_; }

 private:
  Option* keep(CLI::Option* option);

  CLI::App& app_;
  std::vector<std::unique_ptr<Option>> options_;
  std::vector<std::unique_ptr<Command>> groups_;
};

}  // namespace perimap

#include "daemon/command_line/command.hpp"

#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <optional>

namespace perimap {

Option* Option::required() {
  option_->required();
  return this;
}

Option* Option::capture_default_str() {
  option_->capture_default_str();
  return this;
}

Option* Option::check(const Range& range) {
  std::visit([this](const auto& bounds) { option_->check(CLI::Range(bounds.first, bounds.second)); }, range.bounds);
  return this;
}

Option* Option::check(const OneOf& words) {
  option_->check(CLI::IsMember(words.words));
  return this;
}

Option* Option::expected(int count) {
  option_->expected(count);
  return this;
}

Option* Option::delimiter(char separator) {
  option_->delimiter(separator);
  return this;
}

Option* Option::one_at_a_time() {
  option_->allow_extra_args(false);
  return this;
}

Option* Option::excludes(const Option* other) {
  option_->excludes(other->option_);
  return this;
}

Option* Option::trigger_on_parse() {
  option_->trigger_on_parse();
  return this;
}

std::size_t Option::count() const { return option_->count(); }

Command::Command(CLI::App& app) : app_(app) {}

Command::~Command() = default;

Option* Command::keep(CLI::Option* option) { return options_.emplace_back(std::make_unique<Option>(*option)).get(); }

template <class Value>
Option* Command::add_option(const std::string& names, Value& value, const std::string& description) {
  return keep(app_.add_option(names, value, description));
}

template Option* Command::add_option(const std::string&, std::string&, const std::string&);
template Option* Command::add_option(const std::string&, std::filesystem::path&, const std::string&);
template Option* Command::add_option(const std::string&, int&, const std::string&);
template Option* Command::add_option(const std::string&, unsigned&, const std::string&);
template Option* Command::add_option(const std::string&, std::uint64_t&, const std::string&);
template Option* Command::add_option(const std::string&, double&, const std::string&);
template Option* Command::add_option(const std::string&, std::vector<std::string>&, const std::string&);
template Option* Command::add_option(const std::string&, std::vector<double>&, const std::string&);
template Option* Command::add_option(const std::string&, std::vector<int>&, const std::string&);
template Option* Command::add_option(const std::string&, std::optional<std::string>&, const std::string&);
template Option* Command::add_option(const std::string&, std::optional<int>&, const std::string&);
template Option* Command::add_option(const std::string&, std::optional<double>&, const std::string&);

Option* Command::add_flag(const std::string& names, bool& given, const std::string& description) {
  return keep(app_.add_flag(names, given, description));
}

template <class Value>
Option* Command::add_option_function(const std::string& names, const std::function<void(const Value&)>& take,
                                     const std::string& description) {
  return keep(app_.add_option_function<Value>(names, take, description));
}

template Option* Command::add_option_function(const std::string&, const std::function<void(const std::string&)>&,
                                              const std::string&);
template Option* Command::add_option_function(const std::string&,
                                              const std::function<void(const std::vector<double>&)>&,
                                              const std::string&);
template Option* Command::add_option_function(const std::string&,
                                              const std::function<void(const std::vector<std::string>&)>&,
                                              const std::string&);

Command& Command::add_option_group(const std::string& name) {
  return *groups_.emplace_back(std::make_unique<Command>(*app_.add_option_group(name)));
}

void Command::group(const std::string& name) { app_.group(name); }

void Command::footer(const std::string& text) { app_.footer(text); }

}  // namespace perimap

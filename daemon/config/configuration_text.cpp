#include "daemon/config/configuration_text.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "daemon/config/configuration_keys.hpp"
#include "daemon/config/session_keys.hpp"

namespace perimap {
namespace {

std::string printed(const ConfigurationValue& value) {
  const auto number = [](double x) {
    std::string text = fmt::format("{}", x);
    return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
  };
  const auto list = [](const auto& elements, auto print) {
    std::string text;
    for (const auto& element : elements) {
      text += fmt::format("{}{}", text.empty() ? "" : ", ", print(element));
    }
    return fmt::format("[{}]", text);
  };
  struct Printer {
    decltype(number)& print_number;
    decltype(list)& print_list;
    std::string operator()(bool flag) const { return flag ? "true" : "false"; }
    std::string operator()(std::int64_t integer) const { return fmt::format("{}", integer); }
    std::string operator()(double x) const { return print_number(x); }
    std::string operator()(const std::string& text) const {
      std::string escaped;
      for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\') {
          escaped += fmt::format("\\{}", c);
        } else if (byte < 0x20 || byte == 0x7F) {
          escaped += fmt::format("\\u{:04X}", byte);
        } else {
          escaped += c;
        }
      }
      return fmt::format("\"{}\"", escaped);
    }
    std::string operator()(const std::vector<std::string>& texts) const {
      return print_list(texts, [this](const std::string& text) { return (*this)(text); });
    }
    std::string operator()(const std::vector<std::int64_t>& integers) const {
      return print_list(integers, [](std::int64_t integer) { return fmt::format("{}", integer); });
    }
    std::string operator()(const std::vector<double>& numbers) const { return print_list(numbers, print_number); }
  };
  return std::visit(Printer{number, list}, value);
}

std::string printed(const Configuration& configuration, bool (*wanted)(const ConfigurationKey&)) {
  std::string text;
  std::string section;
  for (const ConfigurationKey& key : configuration_keys()) {
    if (key.is_former || !wanted(key)) continue;
    if (key.section != section) {
      section = key.section;
      text += fmt::format("\n[{}]\n", section);
    }
    const std::optional<ConfigurationValue> value = key.write(configuration);
    text += fmt::format("# {} ({})\n", key.meaning, key.expected);
    text += value ? fmt::format("{} = {}\n", key.name, printed(*value)) : fmt::format("# {} =\n", key.name);
  }
  return text;
}

}  // namespace

std::string to_toml(const Configuration& configuration) {
  return printed(configuration, [](const ConfigurationKey&) { return true; });
}

std::string session_toml(const Configuration& configuration) { return printed(configuration, &describes_session); }

}  // namespace perimap

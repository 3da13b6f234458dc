#include "daemon/config/wrong_key.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include "core/error/one_line.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/toml/toml_text.hpp"

namespace perimap {
namespace {

struct Placed {
  std::optional<std::pair<std::uint32_t, std::uint32_t>> where;  // line and column
  WrongKey wrong;
};

// Of the key, or else of its section.
std::optional<std::pair<std::uint32_t, std::uint32_t>> place_in(const toml::table& root, std::string_view key) {
  for (const std::string_view name : {key, key.substr(0, key.find('.'))}) {
    const toml::node* node = toml::at_path(root, name).node();
    if (node == nullptr) continue;
    const toml::source_position where = node->source().begin;
    return std::pair(where.line, where.column);
  }
  return std::nullopt;
}

// Two that look at one key may say the same, one of them with what to do next: that one stays.
WrongKeys said_once(WrongKeys wrong) {
  WrongKeys once;
  for (WrongKey& one : wrong) {
    const auto before = std::find_if(once.begin(), once.end(), [&](const WrongKey& other) {
      return other.key == one.key && (other.what.starts_with(one.what) || one.what.starts_with(other.what));
    });
    if (before == once.end()) {
      once.push_back(std::move(one));
    } else if (one.what.size() > before->what.size()) {
      before->what = std::move(one.what);
    }
  }
  return once;
}

}  // namespace

Error told_in(const std::filesystem::path& file, std::string_view text, WrongKeys wrong) {
  const auto root = parse_toml(text, file);
  std::vector<Placed> placed;
  for (WrongKey& one : said_once(std::move(wrong))) {
    placed.push_back({root ? place_in(*root, one.key) : std::nullopt, std::move(one)});
  }
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    if (!a.where || !b.where) return a.where.has_value() && !b.where;
    return *a.where < *b.where;
  });
  std::string all;
  for (const auto& [where, one] : placed) {
    const std::string place = where ? fmt::format(":{}:{}", where->first, where->second) : "";
    all += all.empty() ? "" : "\n";
    all += on_one_line(fmt::format("{}{}: key '{}': {}", file.string(), place, one.key, one.what));
  }
  return {all};
}

Error told_in(const std::filesystem::path& file, WrongKeys wrong) {
  const auto text = read_text_file(file, kLargestToml, "configuration file");
  return told_in(file, text ? std::string_view(*text) : std::string_view(), std::move(wrong));
}

void append(WrongKeys& wrong, WrongKeys more) {
  wrong.insert(wrong.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace perimap

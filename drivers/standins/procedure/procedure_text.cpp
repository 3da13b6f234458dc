#include "drivers/standins/procedure/procedure_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/error/nearest_name.hpp"
#include "drivers/standins/procedure/procedure_keys.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/toml/toml_text.hpp"
#include "drivers/toml/wrong_toml_keys.hpp"

namespace perimap {
namespace {

constexpr double kLatest_s = 7200.0;
constexpr double kShortest_s = 0.05;
constexpr std::size_t kMostEvents = 1000;

// A number, or so many of them; none for all others.
std::optional<double> number_of(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return static_cast<double>(integer->get());
  if (const auto* number = node.as_floating_point()) return number->get();
  return std::nullopt;
}

// Walks one parsed file, keeps what is good and remembers what is wrong.
class ProcedureFile {
 public:
  explicit ProcedureFile(const std::string& file) : wrong_(file) {}

  Expected<Procedure> read(const toml::table& root) {
    const toml::node* version = root.get("version");
    if (version == nullptr || version->value<std::int64_t>() != 1) {
      refuse(version != nullptr ? version->source().begin : toml::source_position{1, 1}, "version", "1",
             version != nullptr ? describe(*version) : "nothing");
    }
    for (const auto& [key, node] : root) {
      if (key.str() == "version") continue;
      if (key.str() != "event") {
        refuse_unknown(key, key.str(), {"version", "event"});
        continue;
      }
      const toml::array* events = node.as_array();
      if (events == nullptr || !all_are_tables(*events)) {
        refuse(node.source().begin, "event", "tables [[event]]", describe(node));
        continue;
      }
      if (events->size() > kMostEvents) {
        refuse(node.source().begin, "event", fmt::format("at most {}", kMostEvents), fmt::format("{}", events->size()));
        continue;
      }
      for (std::size_t i = 0; i < events->size(); ++i) read_event(*events->get(i)->as_table(), i + 1);
    }
    if (wrong_.empty()) refuse_overlaps();
    if (!wrong_.empty()) return tl::unexpected(wrong_.told());
    Procedure procedure;
    std::stable_sort(read_.begin(), read_.end(), [](const Read& a, const Read& b) { return a.event.at < b.event.at; });
    for (Read& read : read_) procedure.events.push_back(std::move(read.event));
    return procedure;
  }

 private:
  struct Read {
    ProcedureEvent event;
    toml::source_position where;
    std::size_t number = 0;  // in the file
  };

  static bool all_are_tables(const toml::array& array) {
    return std::all_of(array.begin(), array.end(), [](const toml::node& node) { return node.is_table(); });
  }

  void read_event(const toml::table& table, std::size_t number) {
    const std::string prefix = fmt::format("event[{}].", number);
    const toml::node* kind = table.get("kind");
    const auto name = kind != nullptr ? kind->value<std::string>() : std::nullopt;
    const auto found = name ? std::find(kEventKinds.begin(), kEventKinds.end(), *name) : kEventKinds.end();
    if (found == kEventKinds.end()) {
      refuse(kind != nullptr ? kind->source().begin : table.source().begin, prefix + "kind",
             fmt::format("one of {}", fmt::join(kEventKinds, ", ")),
             kind == nullptr ? "nothing" : describe(*kind) + (name ? did_you_mean(*name, kEventKinds) : ""));
      return;
    }
    Read read{{}, table.source().begin, number};
    read.event.what = happening_of(static_cast<std::size_t>(found - kEventKinds.begin()));
    std::vector<std::string_view> known = {"kind"};
    double at_s = 0.0, for_s = 0.0;
    const auto needed = [&](const ProcedureKey& key, double& value) {
      known.push_back(key.name);
      if (table.contains(key.name)) {
        take(table, prefix, key, value);
      } else {
        refuse(table.source().begin, prefix + std::string(key.name), expected(key, 1), "nothing");
      }
    };
    needed({"at_s", 0.0, kLatest_s}, at_s);
    needed({"for_s", kShortest_s, kLatest_s}, for_s);
    read.event.at = from_seconds(at_s);
    read.event.length = from_seconds(for_s);
    std::visit(
        [&](auto& what) {
          visit_keys(what, [&](const ProcedureKey& key, auto& value) {
            known.push_back(key.name);
            if (table.contains(key.name)) take(table, prefix, key, value);
          });
        },
        read.event.what);
    for (const auto& [key, node] : table) {
      if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
        refuse_unknown(key, prefix + std::string(key.str()), known);
      }
    }
    read_.push_back(std::move(read));
  }

  static std::string expected(const ProcedureKey& key, int count) {
    const std::string range = fmt::format("{:.6g} to {:.6g}", key.least, key.most);
    return count == 1 ? fmt::format("a number, {}", range) : fmt::format("[{} numbers, each {}]", count, range);
  }

  void take(const toml::table& table, const std::string& prefix, const ProcedureKey& key, double& value) {
    const toml::node& node = *table.get(key.name);
    const std::optional<double> number = number_of(node);
    if (number && *number >= key.least && *number <= key.most) {
      value = *number;
    } else {
      refuse(node.source().begin, prefix + std::string(key.name), expected(key, 1), describe(node));
    }
  }

  template <int N>
  void take(const toml::table& table, const std::string& prefix, const ProcedureKey& key,
            Eigen::Matrix<double, N, 1>& value) {
    const toml::node& node = *table.get(key.name);
    const toml::array* array = node.as_array();
    bool good = array != nullptr && array->size() == static_cast<std::size_t>(N);
    for (int i = 0; good && i < N; ++i) {
      const std::optional<double> number = number_of(*array->get(static_cast<std::size_t>(i)));
      good = number && *number >= key.least && *number <= key.most;
      if (good) value[i] = *number;
    }
    if (!good) refuse(node.source().begin, prefix + std::string(key.name), expected(key, N), describe(node));
  }

  // What moves from where it is to a place can not begin before it has come to the last.
  void refuse_overlaps() {
    std::map<std::size_t, std::vector<const Read*>> by_kind;
    for (const Read& read : read_) {
      const Happening& what = read.event.what;
      const bool withdraws = std::holds_alternative<Wiped>(what) || std::holds_alternative<Withdrawn>(what);
      by_kind[withdraws ? happening_index<Withdrawn>() : what.index()].push_back(&read);
    }
    for (auto& [kind, reads] : by_kind) {
      std::stable_sort(reads.begin(), reads.end(),
                       [](const Read* a, const Read* b) { return a->event.at < b->event.at; });
      for (std::size_t i = 1; i < reads.size(); ++i) {
        if (reads[i]->event.at >= reads[i - 1]->event.end()) continue;
        refuse(reads[i]->where, fmt::format("event[{}].at_s", reads[i]->number),
               fmt::format("at least {:.6g}, when event[{}] of its kind has ended",
                           to_seconds(reads[i - 1]->event.end()), reads[i - 1]->number),
               fmt::format("{:.6g}", to_seconds(reads[i]->event.at)));
      }
    }
  }

  template <class Kind>
  static std::size_t happening_index() {
    return Happening(Kind{}).index();
  }

  void refuse_unknown(const toml::key& key, std::string_view name, const std::vector<std::string_view>& known) {
    refuse(key.source().begin, name, fmt::format("one of {}", fmt::join(known, ", ")),
           "an unknown key" + did_you_mean(key.str(), known));
  }

  void refuse(toml::source_position where, std::string_view key, std::string_view wanted, std::string_view got) {
    wrong_.add(where, key, wanted, got);
  }

  std::vector<Read> read_;
  WrongTomlKeys wrong_;
};

}  // namespace

Expected<Procedure> parse_procedure(std::string_view text, const std::string& file) {
  const auto root = parse_toml(text, file);
  if (!root) return tl::unexpected(root.error());
  return ProcedureFile(file).read(*root);
}

Expected<Procedure> load_procedure(const std::filesystem::path& file) {
  const auto text = read_text_file(file, kLargestToml, "procedure");
  if (!text) return tl::unexpected(text.error());
  return parse_procedure(*text, file.string());
}

// With a point or an exponent always, so that TOML takes it for a number with a fraction; the shortest that reads back
// as the same.
std::string value_text(double value) { return fmt::format("{:#}", value); }

std::string value_text(const Vector2d& value) {
  return fmt::format("[{}, {}]", value_text(value.x()), value_text(value.y()));
}

std::string value_text(const Vector3d& value) {
  return fmt::format("[{}, {}, {}]", value_text(value.x()), value_text(value.y()), value_text(value.z()));
}

std::string to_toml(const Procedure& procedure) {
  std::string text = "version = 1\n";
  for (const ProcedureEvent& event : procedure.events) {
    text += fmt::format("\n[[event]]\nkind = \"{}\"\nat_s = {}\nfor_s = {}\n", kind_of(event.what),
                        value_text(to_seconds(event.at)), value_text(to_seconds(event.length)));
    std::visit(
        [&text](const auto& what) {
          visit_keys(what, [&text](const ProcedureKey& key, const auto& value) {
            text += fmt::format("{} = {}\n", key.name, value_text(value));
          });
        },
        event.what);
  }
  return text;
}

}  // namespace perimap

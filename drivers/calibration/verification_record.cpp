#include "drivers/calibration/verification_record.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "drivers/json/json_seal.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr const char* kSetUp = "set_up";
constexpr const char* kChangedSince = "changed_since";

// Reads the keys of one object; remembers the first one that is wrong.
class VerifiedKeys {
 public:
  VerifiedKeys(const nlohmann::json& object, std::string prefix) : object_(object), prefix_(std::move(prefix)) {}

  void number(const char* key, double& value) {
    const auto found = object_.find(key);
    if (found == object_.end() || !found->is_number() || !std::isfinite(found->get<double>())) {
      return wrong(key, "a number");
    }
    value = found->get<double>();
  }

  void truth(const char* key, bool& value) {
    const auto found = object_.find(key);
    if (found == object_.end() || !found->is_boolean()) return wrong(key, "true or false");
    value = found->get<bool>();
  }

  void text(const char* key, std::string& value) {
    const auto found = object_.find(key);
    constexpr std::size_t kLongest = 64;
    if (found == object_.end() || !found->is_string() || found->get_ref<const std::string&>().size() > kLongest) {
      return wrong(key, "a text of 64 bytes at most");
    }
    value = found->get<std::string>();
  }

  // `least`, `most`: how many numbers.
  void numbers(const char* key, std::size_t least, std::size_t most, std::vector<double>& values) {
    const auto found = object_.find(key);
    const bool is_list = found != object_.end() && found->is_array() && found->size() >= least && found->size() <= most;
    if (!is_list) return wrong(key, "a list of numbers");
    for (const auto& value : *found) {
      if (!value.is_number()) return wrong(key, "a list of numbers");
      values.push_back(value.get<double>());
    }
  }

  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  void wrong(const char* key, const char* expected) {
    if (error_.empty()) error_ = fmt::format("key '{}{}': expected {}", prefix_, key, expected);
  }

  const nlohmann::json& object_;
  std::string prefix_;
  std::string error_;
};

}  // namespace

std::vector<double> lens_numbers(const CameraModel& c) {
  return {static_cast<double>(c.width),
          static_cast<double>(c.height),
          c.fx,
          c.fy,
          c.cx,
          c.cy,
          c.k1,
          c.k2,
          c.p1,
          c.p2,
          c.k3,
          c.k4,
          c.lens == Lens::kKannalaBrandt ? 1.0 : 0.0};
}

std::filesystem::path verification_file_of(const std::filesystem::path& configuration_file) {
  std::filesystem::path file = configuration_file;
  return file.replace_extension(".verified.json");
}

std::string format_verification(std::string_view result_json, const VerifiedSetUp& set_up) {
  nlohmann::json json = nlohmann::json::parse(result_json);
  json[kSetUp] = {{"hand_eye_translation_SC_mm", set_up.translation_SC_mm},
                  {"hand_eye_rotation_SC_wxyz", set_up.rotation_SC_wxyz},
                  {"time_offset_ms", set_up.time_offset_ms},
                  {"lens", set_up.lens},
                  {"turned_scope", set_up.turned_scope}};
  return json_document(sealed_json(std::move(json)));
}

std::string as_changed_since(std::string_view record_json) {
  nlohmann::json json = nlohmann::json::parse(record_json);
  json[kChangedSince] = true;
  return json_document(sealed_json(std::move(json)));
}

Expected<VerificationRecord> parse_verification(std::string_view text, std::string_view name) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const auto wrong = [&](const std::string& what) {
    return fail(fmt::format("{}: {}; perimap verify writes it anew", name, what));
  };
  if (!json.is_object()) return wrong("expected what perimap verify wrote, a JSON object");
  if (const auto whole = check_json_seal(json); !whole) return wrong(whole.error().message);
  VerificationRecord record;
  VerifiedKeys keys(json, "");
  keys.text("date", record.date);
  keys.truth("passed", record.passed);
  keys.number("bound_mm", record.bound_mm);
  keys.number("board_error_mm", record.board_mm.error);
  keys.number("board_error_mm_deviation", record.board_mm.deviation);
  keys.number("clock_error_ms", record.clocks_ms.error);
  keys.number("clock_error_ms_deviation", record.clocks_ms.deviation);
  if (const auto touch = json.find("touch_error_mm"); touch != json.end() && !touch->is_null()) {
    record.touch_mm = VerificationRecord::Figure{};
    keys.number("touch_error_mm", record.touch_mm->error);
    keys.number("touch_error_mm_deviation", record.touch_mm->deviation);
  }
  if (json.contains(kChangedSince)) keys.truth(kChangedSince, record.changed_since);
  if (!keys.error().empty()) return wrong(keys.error());

  const auto set_up = json.find(kSetUp);
  if (set_up == json.end() || !set_up->is_object()) return wrong("key 'set_up': expected an object");
  VerifiedKeys of(*set_up, "set_up.");
  std::vector<double> translation, rotation;
  of.numbers("hand_eye_translation_SC_mm", 3, 3, translation);
  of.numbers("hand_eye_rotation_SC_wxyz", 4, 4, rotation);
  of.number("time_offset_ms", record.set_up.time_offset_ms);
  of.numbers("lens", 0, lens_numbers({}).size(), record.set_up.lens);
  of.text("turned_scope", record.set_up.turned_scope);
  if (!of.error().empty()) return wrong(of.error());
  for (std::size_t i = 0; i < 3; ++i) record.set_up.translation_SC_mm.at(i) = translation[i];
  for (std::size_t i = 0; i < 4; ++i) record.set_up.rotation_SC_wxyz.at(i) = rotation[i];
  return record;
}

Expected<std::optional<std::string>> read_verification(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::optional<std::string>();
  constexpr std::size_t kLargest = std::size_t{1} << 20;
  auto text = read_text_file(file, kLargest, "verification");
  if (!text) return tl::unexpected(text.error());
  if (text->size() > kLargest) return fail(file.string() + ": is larger than 1 MiB; perimap verify writes it anew");
  return std::optional<std::string>(*std::move(text));
}

std::string words_of(const VerificationRecord& record) {
  std::string words =
      fmt::format("{} on {}, bound {:g} mm: board {:.2f} mm (deviation {:.2f}), clocks {:.1f} ms ({:.1f}), ",
                  record.passed ? "passed" : "FAILED", record.date, record.bound_mm, record.board_mm.error,
                  record.board_mm.deviation, record.clocks_ms.error, record.clocks_ms.deviation);
  words += record.touch_mm
               ? fmt::format("touched point {:.2f} mm ({:.2f})", record.touch_mm->error, record.touch_mm->deviation)
               : std::string("no point was touched");
  if (record.changed_since) {
    words += "; lens, hand-eye or clocks have been changed since: verify it again";
  } else if (!record.passed) {
    words += "; measure again what perimap verify names";
  }
  return words;
}

}  // namespace perimap

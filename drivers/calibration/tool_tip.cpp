#include "drivers/calibration/tool_tip.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "drivers/json/json_seal.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

bool read_three(const nlohmann::json& list, Vector3d& v) {
  if (!list.is_array() || list.size() != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!list[i].is_number()) return false;
    v[static_cast<Eigen::Index>(i)] = list[i].get<double>();
  }
  return v.allFinite();
}

}  // namespace

Expected<ToolTip> read_tool_tip(const std::filesystem::path& file) {
  constexpr std::size_t kLargest = std::size_t{1024} * 1024;
  const auto text = read_text_file(file, kLargest, "tool calibration");
  if (!text) return tl::unexpected(text.error());
  return parse_tool_tip(*text, file.string());
}

Expected<ToolTip> parse_tool_tip(std::string_view text, std::string_view name) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const auto wrong = [&](std::string_view what) {
    return fail(fmt::format("{}: {}; expected a file that perimap calibrate tool --output wrote", name, what));
  };
  if (!json.is_object()) return wrong("is no JSON object");
  if (const auto whole = check_json_seal(json); !whole) return wrong(whole.error().message);
  ToolTip tip;
  constexpr double kLongest_mm = 10'000.0;
  if (!json.contains("tip_mm") || !read_three(json["tip_mm"], tip.tip_T) || tip.tip_T.norm() > kLongest_mm) {
    return wrong("key 'tip_mm' is not three numbers in mm");
  }
  const bool has_rows = json.contains("covariance") && json["covariance"].is_array() && json["covariance"].size() == 3;
  if (!has_rows) return wrong("key 'covariance' is not three rows");
  for (std::size_t i = 0; i < 3; ++i) {
    Vector3d row;
    if (!read_three(json["covariance"][i], row)) return wrong("key 'covariance' has a row that is not three numbers");
    tip.covariance_T.row(static_cast<Eigen::Index>(i)) = row.transpose();
  }
  return tip;
}

std::string format_tool_tip(const ToolTip& tip, const std::string& tool) {
  nlohmann::ordered_json json;
  json["tool"] = tool;
  for (const double value : tip.tip_T) json["tip_mm"].push_back(value);
  for (Eigen::Index row = 0; row < 3; ++row) {
    nlohmann::ordered_json of_row;
    for (Eigen::Index column = 0; column < 3; ++column) of_row.push_back(tip.covariance_T(row, column));
    json["covariance"].push_back(std::move(of_row));
  }
  return json_document(json);
}

}  // namespace perimap

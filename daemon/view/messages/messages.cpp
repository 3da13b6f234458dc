#include "daemon/view/messages/messages.hpp"

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "daemon/publishing/status_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/view/messages/milliseconds.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Json phase_json(const perimap_Phase& phase) {
  return {{"kind", "phase"},
          {"state", name_of(phase.state)},
          {"time_ms", page_ms(phase.time_ns)},
          {"phase_rad", phase.cardiac_phase_rad},
          {"deviation_rad", phase.cardiac_phase_deviation_rad},
          {"rate_rad_per_s", phase.cardiac_phase_rate_rad_per_s},
          {"last_r_ms", page_ms(phase.last_r_peak_time_ns)},
          {"next_r_ms", page_ms(phase.predicted_r_peak_time_ns)},
          {"next_r_deviation_ms", page_ms(phase.predicted_r_peak_deviation_ns)},
          {"beats", phase.beats}};
}

Json status_message_json(const perimap_Status& status) {
  return {{"kind", "status"}, {"time_ms", page_ms(status.time_ns)}, {"status", full_status_json(status)}};
}

Json ecg_json(const perimap_EcgSamples& block) {
  Json values = Json::array();
  for (const float value : std::span(block.ecg_mV._buffer, block.ecg_mV._length)) {
    values.push_back(std::isfinite(value) ? Json(std::round(static_cast<double>(value) * 1e4) / 1e4) : Json(nullptr));
  }
  return {{"kind", "ecg"},
          {"first_ms", page_ms(block.first_sample_time_ns)},
          {"period_ms", page_ms(block.sample_period_ns)},
          {"lead_off", block.lead_off},
          {"mV", std::move(values)}};
}

Json guidance_json(const perimap_Guidance& guidance) {
  const std::span seen(guidance.seen_percent._buffer, guidance.seen_percent._length);
  const bool whole = seen.size() == std::size_t{guidance.columns} * guidance.rows;
  return {{"kind", "guidance"},
          {"what", guidance.what},
          {"line", guidance.line != nullptr ? guidance.line : ""},
          {"elapsed_s", guidance.elapsed_s},
          {"longest_s", guidance.longest_s},
          {"stage", guidance.stage == perimap_GUIDANCE_RECORDED ? "recorded" : "recording"},
          {"columns", whole ? guidance.columns : 0},
          {"rows", whole ? guidance.rows : 0},
          {"seen_percent", whole ? std::vector<int>(seen.begin(), seen.end()) : std::vector<int>()}};
}

PageMessage text_message(const Json& json, std::uint8_t lane) {
  // Text of a publisher may be no UTF-8.
  return {std::make_shared<const std::string>(json_line(json)), false, lane};
}

}  // namespace perimap

// What else the page gets: phases, states of the sources, samples of the ECG, who publishes.
#pragma once

#include <perimap.h>

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/web/page_message.hpp"

namespace perimap {

// Times in ms of the publisher's clock.
[[nodiscard]] nlohmann::ordered_json phase_json(const perimap_Phase& phase);
// With what perimap ctl status tells.
[[nodiscard]] nlohmann::ordered_json status_message_json(const perimap_Status& status);
[[nodiscard]] nlohmann::ordered_json ecg_json(const perimap_EcgSamples& block);

[[nodiscard]] PageMessage text_message(const nlohmann::ordered_json& json, std::uint8_t lane = PageMessage::kNoLane);

}  // namespace perimap

// What else the page gets: phases, states of the sources, samples of the ECG, who publishes, how a calibration goes.
#pragma once

#include <perimap.h>
#include <perimap_guidance.h>

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/web/page_message.hpp"

namespace perimap {

// Times in ms of the publisher's clock.
[[nodiscard]] nlohmann::ordered_json phase_json(const perimap_Phase& phase);
// With what perimap ctl status tells.
[[nodiscard]] nlohmann::ordered_json status_message_json(const perimap_Status& status);
[[nodiscard]] nlohmann::ordered_json ecg_json(const perimap_EcgSamples& block);

// Without the picture. Parts of it that do not fit what is told of them are left out.
[[nodiscard]] nlohmann::ordered_json guidance_json(const perimap_Guidance& guidance);

[[nodiscard]] PageMessage text_message(const nlohmann::ordered_json& json, std::uint8_t lane = PageMessage::kNoLane);

}  // namespace perimap

// A session on one page: what could be trusted when, and what is known of why not.
#pragma once

#include <string>

#include "daemon/evaluation/session/session_record.hpp"

namespace perimap {

// One sentence: for how much of the session surfaces were good.
[[nodiscard]] std::string session_verdict(const SessionRecord& record);

// What somebody should look at, a sentence each; none where nothing is amiss.
[[nodiscard]] std::vector<std::string> session_concerns(const SessionRecord& record);

// Self-contained HTML.
[[nodiscard]] std::string session_page(const SessionRecord& record);

}  // namespace perimap

// A session on one page: what could be trusted when, and what is known of why not.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/evaluation/session/session_record.hpp"

namespace perimap {

// One sentence: for how much of the session surfaces were good.
[[nodiscard]] std::string session_verdict(const SessionRecord& record);

// What a user asks first: what of the session can be relied on; and, in a second sentence, what stood in the way most.
[[nodiscard]] std::string session_answer(const SessionRecord& record);

// What somebody should look at, a sentence each; none where nothing is amiss.
[[nodiscard]] std::vector<std::string> session_concerns(const SessionRecord& record);

// What perimap verify said last before a file was recorded.
struct ToldVerification {
  std::string words;      // or why the attachment cannot be read
  bool doubtful = false;  // to be looked at
};
// None where nothing is attached.
[[nodiscard]] std::optional<ToldVerification> verification_of(const RecordedFile& file);

// Self-contained HTML.
[[nodiscard]] std::string session_page(const SessionRecord& record);

}  // namespace perimap

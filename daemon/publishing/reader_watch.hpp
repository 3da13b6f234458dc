// Readers that want what a topic does not offer, told in the log: they match nothing, and nobody tells them why.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/time/instant.hpp"
#include "daemon/dds/writer.hpp"

namespace perimap {

// What does not fit of a topic, and what to do; one line.
[[nodiscard]] std::string refusal_words(std::string_view topic, dds_qos_policy_id_t policy);

// Of one topic. One thread.
class ReaderWatch {
 public:
  // The log has a line when there are new ones, once a minute at most.
  void look(const char* topic, const dds::RefusedReaders& refused, Instant now);

 private:
  std::uint32_t told_ = 0;
  bool said_ = false;
  Instant last_said_;
};

}  // namespace perimap

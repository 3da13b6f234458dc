// Text into the bounded strings of the wire types.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "daemon/publishing/identity.hpp"

namespace perimap {

// Cuts what does not fit; always terminated.
template <std::size_t N>
void copy_text(std::string_view text, char (&out)[N]) noexcept {
  const std::size_t n = std::min(text.size(), N - 1);
  std::copy_n(text.data(), n, out);
  out[n] = '\0';
}

// Who publishes the message, in which of its runs, and on which stream.
template <class Message>
void name_as(Message& message, const Identity& identity) noexcept {
  copy_text(identity.source, message.source);
  copy_text(name_of(identity.stream), message.stream);
  std::copy(identity.run_id.begin(), identity.run_id.end(), message.run_id);
}

}  // namespace perimap

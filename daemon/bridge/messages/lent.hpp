// What C types of an IDL borrow: they must not outlive it, and must not be freed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace perimap {

template <class Sequence, class Element>
void lend(std::vector<Element>& elements, Sequence& sequence) noexcept {
  sequence._buffer = elements.data();
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(elements.size());
  sequence._release = false;
}

// The generated types hold non-const pointers; a borrowed message is only ever read.
[[nodiscard]] inline char* lent(const char* text) noexcept { return const_cast<char*>(text); }
[[nodiscard]] inline char* lent(const std::string& text) noexcept { return lent(text.c_str()); }

}  // namespace perimap

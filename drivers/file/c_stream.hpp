// C streams that close themselves.
#pragma once

#include <cstdio>
#include <memory>

#include "drivers/file/descriptor.hpp"

namespace perimap {

struct CloseStream {
  void operator()(std::FILE* stream) const noexcept { static_cast<void>(std::fclose(stream)); }
};
using CStream = std::unique_ptr<std::FILE, CloseStream>;

// Of what is open already, in a mode of fopen(3). Nothing, and errno, where there is no memory for one.
[[nodiscard]] inline CStream stream_of(Descriptor opened, const char* mode) noexcept {
  CStream stream(::fdopen(opened.get(), mode));
  if (stream) static_cast<void>(opened.release());
  return stream;
}

}  // namespace perimap

// Signals as a descriptor to read.
#pragma once

#include <initializer_list>

#include "core/error/expected.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

// Blocks the signals for this thread and all that it starts from now on, and gives a descriptor (signalfd(2)) that can
// be read when one of them has come.
[[nodiscard]] Expected<Descriptor> open_signal_descriptor(std::initializer_list<int> signals);

// Takes one signal out of it; false when none has come.
[[nodiscard]] bool take_signal(int descriptor) noexcept;

}  // namespace perimap

// Several devices of one theatre at a time.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "drivers/standins/theatre/theatre.hpp"

namespace perimap {

// Each device on a thread of its own, until `ended`, which may wait for a moment, says so or one of them fails. `told`
// is as in Theatre::serve(); `failed` is given "DEVICE: why" of each that fails. Both of any thread. False where one
// has failed.
[[nodiscard]] bool serve_devices(const Theatre& theatre, const std::vector<EmulatedDevice>& devices,
                                 const std::function<void(const std::string&)>& told,
                                 const std::function<void(const std::string&)>& failed,
                                 const std::function<bool()>& ended);

}  // namespace perimap

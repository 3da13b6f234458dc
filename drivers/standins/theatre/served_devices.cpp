#include "drivers/standins/theatre/served_devices.hpp"

#include <atomic>
#include <thread>

namespace perimap {

bool serve_devices(const Theatre& theatre, const std::vector<EmulatedDevice>& devices,
                   const std::function<void(const std::string&)>& told,
                   const std::function<void(const std::string&)>& failed, const std::function<bool()>& ended) {
  Interrupt interrupt;
  std::atomic<bool> any_failed{false};  // relaxed would do: it is a message by itself
  std::vector<std::jthread> threads;
  threads.reserve(devices.size());
  for (const EmulatedDevice& device : devices) {
    threads.emplace_back([&] {
      const auto served = theatre.serve(device, told, interrupt);
      if (served) return;
      failed(device.name + ": " + served.error().message);
      any_failed = true;
    });
  }
  while (!any_failed && !ended()) {
  }
  interrupt.request();
  threads.clear();
  return !any_failed;
}

}  // namespace perimap

// A configuration file read again while perimapd runs.
#pragma once

#include <filesystem>
#include <mutex>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

class ConfigurationReload {
 public:
  // `running`: what the file came to when it was read last.
  ConfigurationReload(std::filesystem::path file, Configuration running)
      : file_(std::move(file)), running_(std::move(running)) {}

  // Puts into effect what may change while it runs, the log's level, and says what needs a restart. Any thread may call
  // it: a command and a signal may come together.
  [[nodiscard]] Expected<std::string> operator()();

 private:
  std::filesystem::path file_;
  std::mutex mutex_;  // guards what follows
  Configuration running_;
};

}  // namespace perimap

// The process's log: lines on standard error, written by a thread of their own.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/config/configuration.hpp"

namespace perimap {

// While it lives, spdlog's default logger (spdlog::info(...) and so on) puts lines into a bounded queue; when the queue
// is full the oldest line is dropped and counted, so that no caller waits for a slow terminal. On the journal each
// line carries its severity (sd-daemon(3)), elsewhere the program's name, time and severity. Not for the real-time
// path: it locks and formats. One at a time.
class Logging {
 public:
  // `name`: the program's, as Console has it.
  Logging(std::string_view name, LogConfiguration::Level level);
  Logging(const Logging&) = delete;
  Logging& operator=(const Logging&) = delete;
  // Writes what is queued.
  ~Logging();

  // Any thread.
  static void set_level(LogConfiguration::Level level);

  // Each line from now on goes to `other`, too, on the log's thread: its severity ("info") and what it says. Any
  // thread; nothing is told any more once tell_also({}) has returned.
  void tell_also(std::function<void(std::string_view severity, std::string_view line)> other);

  // A line for the log when lines were dropped since this was asked last. One thread.
  [[nodiscard]] std::optional<std::string> next_loss();

 private:
  class OtherSink;

  std::shared_ptr<OtherSink> other_;
  std::size_t told_ = 0;  // dropped lines
};

}  // namespace perimap

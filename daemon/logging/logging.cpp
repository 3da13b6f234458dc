#include "daemon/logging/logging.hpp"

#include <pthread.h>
#include <spdlog/async.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kQueuedLines = 4096;

spdlog::level::level_enum to_spdlog(LogConfiguration::Level level) {
  switch (level) {
    case LogConfiguration::Level::kTrace:
      return spdlog::level::trace;
    case LogConfiguration::Level::kDebug:
      return spdlog::level::debug;
    case LogConfiguration::Level::kInfo:
      return spdlog::level::info;
    case LogConfiguration::Level::kWarning:
      return spdlog::level::warn;
    case LogConfiguration::Level::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

// The journal's severity prefix, sd-daemon(3): "<6>" is informational.
class JournalSeverity : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& destination) override {
    constexpr const char* kPrefixes[] = {"<7>", "<7>", "<6>", "<4>", "<3>", "<2>", "<6>"};
    const std::string_view prefix = kPrefixes[message.level];
    destination.append(prefix.data(), prefix.data() + prefix.size());
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JournalSeverity>();
  }
};

// systemd.exec(5), $JOURNAL_STREAM: device and inode of the stream that leads to the journal.
bool standard_error_is_the_journal() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here writes the environment
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat status {};
  return stream != nullptr && fstat(STDERR_FILENO, &status) == 0 &&
         stream == std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino);
}

}  // namespace

class Logging::OtherSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  void tell(std::function<void(std::string_view, std::string_view)> other) {
    const std::lock_guard lock(mutex_);
    other_ = std::move(other);
  }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (!other_) return;
    const auto severity = spdlog::level::to_string_view(message.level);
    other_({severity.data(), severity.size()}, {message.payload.data(), message.payload.size()});
  }
  void flush_() override {}

  std::function<void(std::string_view, std::string_view)> other_;
};

Logging::Logging(std::string_view name, LogConfiguration::Level level) {
  spdlog::init_thread_pool(kQueuedLines, 1, [] { pthread_setname_np(pthread_self(), "log"); });
  auto logger =
      std::make_shared<spdlog::async_logger>("perimap", std::make_shared<spdlog::sinks::stderr_sink_mt>(),
                                             spdlog::thread_pool(), spdlog::async_overflow_policy::overrun_oldest);
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  if (standard_error_is_the_journal()) {
    formatter->add_flag<JournalSeverity>('*').set_pattern("%*%v");
  } else {
    formatter->set_pattern(std::string(name) + ": %Y-%m-%d %H:%M:%S.%e %l: %v");
  }
  logger->set_formatter(std::move(formatter));
  other_ = std::make_shared<OtherSink>();
  logger->sinks().push_back(other_);
  logger->set_level(to_spdlog(level));
  spdlog::set_default_logger(std::move(logger));
}

Logging::~Logging() { spdlog::shutdown(); }

void Logging::tell_also(std::function<void(std::string_view, std::string_view)> other) {
  other_->tell(std::move(other));
}

void Logging::set_level(LogConfiguration::Level level) { spdlog::set_level(to_spdlog(level)); }

std::optional<std::string> Logging::next_loss() {
  const std::size_t dropped = spdlog::thread_pool()->overrun_counter();
  const std::size_t more = dropped - std::exchange(told_, dropped);
  if (more == 0) return std::nullopt;
  return std::to_string(more) + " lines of this log were dropped, since standard error takes them too slowly";
}

}  // namespace perimap

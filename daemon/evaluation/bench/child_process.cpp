#include "daemon/evaluation/bench/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <system_error>
#include <utility>

namespace perimap::bench {
namespace {

struct Pipe {
  // Nothing, and errno, where the system has none left.
  static std::optional<Pipe> make() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
    return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
  }

  Descriptor read;
  Descriptor write;
};

}  // namespace

std::optional<std::string> find_program(const std::string& name) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here writes the environment
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string program = folder.append("/").append(name);
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  return std::nullopt;
}

Expected<ChildProcess> ChildProcess::start(const std::string& program, const std::vector<std::string>& arguments) {
  const auto failed = [&](int error) {
    return fail(fmt::format("{}: cannot be run: {}", program, std::generic_category().message(error)));
  };
  auto to = Pipe::make();
  auto from = Pipe::make();
  if (!to || !from) return failed(errno);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, to->read.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, from->write.get(), STDOUT_FILENO);
  // The signals that we take by a descriptor are blocked in us; others have to be able to end a child.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);

  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t process = 0;
  const int error = posix_spawn(&process, program.c_str(), &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return failed(error);
  return ChildProcess(process, std::move(to->write), std::move(from->read));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : process_(std::exchange(other.process_, 0)),
      input_(std::move(other.input_)),
      output_(std::move(other.output_)),
      buffer_(std::move(other.buffer_)) {}

ChildProcess::~ChildProcess() {
  if (process_ > 0) {
    terminate();
    wait();
  }
}

void ChildProcess::close_input() noexcept { input_.reset(); }

void ChildProcess::terminate() const noexcept {
  if (process_ > 0) kill(process_, SIGTERM);
}

std::optional<std::string> ChildProcess::read_line() {
  for (;;) {
    if (const auto end = buffer_.find('\n'); end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return line;
    }
    std::array<char, 4096> bytes{};
    const ssize_t n = read(output_.get(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return std::nullopt;
    buffer_.append(bytes.data(), static_cast<std::size_t>(n));
  }
}

std::vector<std::string> ChildProcess::read_lines() {
  std::vector<std::string> lines;
  while (auto line = read_line()) lines.push_back(std::move(*line));
  return lines;
}

int ChildProcess::wait() noexcept {
  if (process_ <= 0) return 0;
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace perimap::bench

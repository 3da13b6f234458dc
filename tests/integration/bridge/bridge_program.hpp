// `perimap bridge` as a process of its own, and a scripted perimapd for it to hear.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap::test {

// Its standard error goes to a file.
class BridgeProgram {
 public:
  explicit BridgeProgram(std::string log) : log_(std::move(log)) {}
  BridgeProgram(const BridgeProgram&) = delete;
  BridgeProgram& operator=(const BridgeProgram&) = delete;
  ~BridgeProgram() {
    if (process_ > 0) {
      kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
    }
    if (output_ >= 0) close(output_);
  }

  void start(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), PERIMAP);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::array<int, 2> pipe_ends{};
    ASSERT_EQ(pipe2(pipe_ends.data(), O_CLOEXEC), 0);
    process_ = fork();
    if (process_ == 0) {
      const int error = open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
      dup2(pipe_ends[1], STDOUT_FILENO);
      dup2(error, STDERR_FILENO);
      execv(PERIMAP, argv.data());
      _exit(127);
    }
    close(pipe_ends[1]);
    output_ = pipe_ends[0];
  }

  // The first line of its standard output; empty when it ended without one.
  [[nodiscard]] std::string first_line() const {
    std::string line;
    char byte = 0;
    while (read(output_, &byte, 1) == 1 && byte != '\n') line += byte;
    return line;
  }
  [[nodiscard]] std::string said() const {
    std::ifstream log(log_);
    return {std::istreambuf_iterator<char>(log), {}};
  }
  [[nodiscard]] bool says(const std::string& text, Duration patience = std::chrono::seconds(30)) const {
    const Instant until = MonotonicClock::now() + patience;
    while (MonotonicClock::now() < until) {
      if (said().find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }
  void interrupt() const { kill(process_, SIGINT); }
  // Its exit code; -1 when a signal ended it.
  [[nodiscard]] int ended() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  std::string log_;
  pid_t process_ = 0;
  int output_ = -1;
};

}  // namespace perimap::test

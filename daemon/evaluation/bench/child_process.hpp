// Another program, run beside the benchmark.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap::bench {

// The program's path, as a shell would find it; nothing when it is not installed.
[[nodiscard]] std::optional<std::string> find_program(const std::string& name);

// Its standard input stays open until close_input(), so that a child of ours can end with us; its standard output comes
// here, its standard error goes where ours goes.
class ChildProcess {
 public:
  // `arguments` without the program itself.
  [[nodiscard]] static Expected<ChildProcess> start(const std::string& program,
                                                    const std::vector<std::string>& arguments);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  // Terminates the program if it is still running, and waits for it.
  ~ChildProcess();

  void close_input() noexcept;
  void terminate() const noexcept;
  // One line without its end; nothing when the output has ended.
  [[nodiscard]] std::optional<std::string> read_line();
  // All that is still to come, until the program closes its output.
  [[nodiscard]] std::vector<std::string> read_lines();
  // Waits for the program's end. Its exit code, or -1 when a signal ended it.
  int wait() noexcept;

 private:
  ChildProcess(pid_t process, Descriptor input, Descriptor output) noexcept
      : process_(process), input_(std::move(input)), output_(std::move(output)) {}

  pid_t process_;
  Descriptor input_;
  Descriptor output_;
  std::string buffer_;
};

}  // namespace perimap::bench

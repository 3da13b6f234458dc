// Holds one thread of another process as a debugger would, until that process ends: the thread hangs, the others go on.
// hold_thread PID NAME
#include <sys/ptrace.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

int main(int argc, char** argv) {
  if (argc != 3) {
    (void)std::fprintf(stderr, "hold_thread PID NAME\n");
    return 2;
  }
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::string(argv[1]) + "/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm") >> std::ws, name);
    if (name != argv[2]) continue;
    const pid_t thread = std::atoi(task.path().filename().c_str());
    if (ptrace(PTRACE_SEIZE, thread, nullptr, nullptr) != 0 ||
        ptrace(PTRACE_INTERRUPT, thread, nullptr, nullptr) != 0) {
      (void)std::fprintf(stderr, "hold_thread: thread %d: %s\n", thread, std::strerror(errno));
      return 1;
    }
    int status = 0;
    while (waitpid(thread, &status, __WALL) == thread && WIFSTOPPED(status)) {
      // A signal that would end the process is let through.
      if (WSTOPSIG(status) == SIGABRT) ptrace(PTRACE_CONT, thread, nullptr, SIGABRT);
    }
    return 0;
  }
  (void)std::fprintf(stderr, "hold_thread: process %s has no thread %s\n", argv[1], argv[2]);
  return 1;
}

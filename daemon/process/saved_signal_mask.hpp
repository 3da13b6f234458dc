// Which signals the calling thread lets through, put back as it was.
#pragma once

#include <csignal>

namespace perimap {

// Of a command that takes signals for a while (StopSignal) and goes on to compute: a signal ends it again then. One
// that came meanwhile and was not taken ends it at once. Threads begun in between keep what they have.
class SavedSignalMask {
 public:
  SavedSignalMask() noexcept { pthread_sigmask(SIG_SETMASK, nullptr, &mask_); }
  SavedSignalMask(const SavedSignalMask&) = delete;
  SavedSignalMask& operator=(const SavedSignalMask&) = delete;
  ~SavedSignalMask() { pthread_sigmask(SIG_SETMASK, &mask_, nullptr); }

 private:
  sigset_t mask_{};
};

}  // namespace perimap

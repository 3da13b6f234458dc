// Progress of what looks through a recording's frames.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/command_line/progress.hpp"

namespace perimap {

// To be called with the frames that were looked at, of all that will be; shown from the first call on.
class FrameProgress {
 public:
  explicit FrameProgress(const Console& console) : console_(console) {}
  void operator()(std::uint64_t done, std::uint64_t all) {
    if (!progress_) progress_ = std::make_shared<Progress>(console_, "frames", all);
    progress_->update(done);
  }

 private:
  Console console_;
  std::shared_ptr<Progress> progress_;  // shared, so that this can be copied into a function
};

}  // namespace perimap

// OpenCV's own threads, of which there are none here.
#pragma once

#include <opencv2/core/utility.hpp>

namespace perimap {

// The process has the threads it made itself, and no others. Call it before anything else of OpenCV. It takes effect
// once: cv::setNumThreads() ends the pool of all threads, so that two at a time, or one beside a call that uses the
// pool, crash.
inline void keep_opencv_to_one_thread() {
  static const bool done = [] {
    cv::setNumThreads(1);
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace perimap

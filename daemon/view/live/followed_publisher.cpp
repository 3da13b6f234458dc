#include "daemon/view/live/followed_publisher.hpp"

namespace perimap {

bool FollowedPublisher::surface(std::uint64_t publisher, std::string_view stream, Instant receipt) {
  const bool silent = !followed_ || receipt - last_ > kSilence;
  const bool of_frames = followed_ == publisher && stream == "frame";
  if (!silent && !of_frames && !follows(publisher, stream)) return false;
  followed_ = publisher;
  stream_ = stream;
  last_ = receipt;
  return true;
}

}  // namespace perimap

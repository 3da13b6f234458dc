#include "daemon/subscribing/followed_publisher.hpp"

namespace perimap {

FollowedPublisher::Verdict FollowedPublisher::surface(std::uint64_t publisher, std::string_view stream,
                                                      Instant receipt) {
  const bool same = follows(publisher, stream);
  const bool silent = !followed_ || receipt - last_ > kSilence;
  const bool of_frames = followed_ == publisher && stream == "frame";
  if (!same && !silent && !of_frames) return Verdict::kOther;
  followed_ = publisher;
  stream_ = stream;
  last_ = receipt;
  return same ? Verdict::kSame : Verdict::kNew;
}

}  // namespace perimap

#include "daemon/bridge/ros2/ros2_bridge.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "daemon/bridge/live/shown_time.hpp"

namespace perimap {
namespace {

// While nothing comes it is said again, for readers that are new.
constexpr Duration kSayAgain = std::chrono::seconds(1);
// So late at most is silence seen, and the end.
constexpr int kLook_ms = 20;

constexpr std::string_view kNotCome = "use no position: no surface has come yet";
constexpr std::string_view kSilent = "use no position: nothing comes from perimapd";
constexpr std::string_view kEnded = "use no position: perimap bridge ros2 has ended";

// Readers of ROS 2 ask for reliable topics or for less.
dds::TopicDescription topic(const char* name, const dds_topic_descriptor_t& descriptor) {
  return {name, &descriptor, true};
}

}  // namespace

Expected<std::unique_ptr<Ros2Bridge>> Ros2Bridge::create(const dds::Membership& membership, int ros_domain, Say say) {
  auto participant = dds::Participant::create(ros_domain);
  if (!participant) return tl::unexpected(participant.error());
  const auto writer = [&participant](const char* name, const dds_topic_descriptor_t& descriptor) {
    return dds::UntypedWriter::create(*participant, topic(name, descriptor), {});
  };
  auto points = writer(ros2_topics::kPoints, sensor_msgs_msg_dds__PointCloud2__desc);
  auto mesh = writer(ros2_topics::kMesh, visualization_msgs_msg_dds__Marker__desc);
  auto tools = writer(ros2_topics::kTools, visualization_msgs_msg_dds__Marker__desc);
  auto transforms = writer(ros2_topics::kTransforms, tf2_msgs_msg_dds__TFMessage__desc);
  auto diagnostics = writer(ros2_topics::kDiagnostics, diagnostic_msgs_msg_dds__DiagnosticArray__desc);
  for (const auto* made : {&points, &mesh, &tools, &transforms, &diagnostics}) {
    if (!*made) return tl::unexpected(made->error());
  }
  std::unique_ptr<Ros2Bridge> bridge(
      new Ros2Bridge(membership.domain,
                     {std::move(*participant), std::move(*points), std::move(*mesh), std::move(*tools),
                      std::move(*transforms), std::move(*diagnostics)},
                     std::move(say)));
  Ros2Bridge* self = bridge.get();
  auto subscriber = SurfaceSubscriber::create(membership, {[self](const ShownSurface& surface) {
                                                             const std::lock_guard lock(self->mutex_);
                                                             self->tell(surface);
                                                           },
                                                           bridge->say_,
                                                           [self] {
                                                             const std::lock_guard lock(self->mutex_);
                                                             self->failed_ = true;
                                                           }});
  if (!subscriber) return tl::unexpected(subscriber.error());
  bridge->subscriber_ = std::move(*subscriber);
  return bridge;
}

Expected<void> Ros2Bridge::run(int stop_descriptor) {
  for (;;) {
    pollfd stop{stop_descriptor, POLLIN, 0};
    const int ready = poll(&stop, 1, kLook_ms);
    if (ready < 0 && errno != EINTR)
      return fail(fmt::format("cannot wait for a signal: {}", std::generic_category().message(errno)));
    const std::lock_guard lock(mutex_);
    if (failed_) return fail("DDS can not be waited for any more");
    if (ready > 0) break;
    look_at_the_clock(MonotonicClock::now());
  }
  subscriber_.reset();
  const std::lock_guard lock(mutex_);
  clear(Ros2Level::kStale, kEnded);
  return {};
}

void Ros2Bridge::tell(const ShownSurface& surface) {
  const Instant now_utc = utc_now();
  until_ = shown_until(surface, MonotonicClock::now());
  // It has waited until it may not be shown any more.
  if (MonotonicClock::now() > until_) return look_at_the_clock(MonotonicClock::now());
  nothing_ = {};
  nothing_.source = surface.source;
  nothing_.frame_id = surface.frame_id;
  if (std::exchange(silent_, false)) say_("surfaces come again");
  write(writers_.points, &messages_.points(surface, now_utc), ros2_topics::kPoints);
  write(writers_.mesh, &messages_.mesh(surface, now_utc), ros2_topics::kMesh);
  write(writers_.tools, &messages_.tools(surface, now_utc), ros2_topics::kTools);
  // Several surfaces may rest on one frame; tf takes an instant once.
  if (surface.X_WC && surface.capture != transformed_) {
    transformed_ = surface.capture;
    write(writers_.transforms, &messages_.transforms(surface, now_utc), ros2_topics::kTransforms);
  }
  diagnose(surface, ros2_level(surface), surface.why.empty() ? "may be used" : surface.why);
}

// On a change, and else once a second.
void Ros2Bridge::diagnose(const ShownSurface& surface, Ros2Level level, const std::string& words) {
  const Instant now = MonotonicClock::now();
  std::vector<Ros2ToolStatus> tools = ros2_tools(surface);
  // One that was told of before and is not any more is said to be stale, once: viewers keep what they heard last.
  std::vector<std::string> gone;
  for (const Ros2ToolStatus& before : tools_) {
    const bool there = std::any_of(tools.begin(), tools.end(), [&](const auto& t) { return t.name == before.name; });
    if (!there) gone.push_back(before.name);
  }
  if (level == level_ && words == words_ && tools == tools_ && now - diagnosed_ < kSayAgain) return;
  tools_ = std::move(tools);
  level_ = level;
  words_ = words;
  diagnosed_ = now;
  write(writers_.diagnostics, &messages_.diagnostics(surface, level, words, gone, utc_now()),
        ros2_topics::kDiagnostics);
}

void Ros2Bridge::clear(Ros2Level level, std::string_view words) {
  const Instant now_utc = utc_now();
  write(writers_.points, &messages_.points(nothing_, now_utc), ros2_topics::kPoints);
  write(writers_.mesh, &messages_.mesh(nothing_, now_utc), ros2_topics::kMesh);
  write(writers_.tools, &messages_.tools(nothing_, now_utc), ros2_topics::kTools);
  diagnose(nothing_, level, std::string(words));
}

void Ros2Bridge::look_at_the_clock(Instant now) {
  const bool came = until_ != Instant();
  if (came && now <= until_) return;
  if (!came && !nobody_ && now - begun_ >= kNobodyAfter) {
    nobody_ = true;
    say_(fmt::format("nobody publishes in DDS domain {}: start perimapd, or name its domain by --domain", domain_));
  }
  if (came && !std::exchange(silent_, true)) {
    say_("nothing has come from perimapd for so long that what came last holds no more");
    cleared_ = {};
  }
  if (now - cleared_ < kSayAgain) return;
  cleared_ = now;
  clear(Ros2Level::kStale, came ? kSilent : kNotCome);
}

void Ros2Bridge::write(dds::UntypedWriter& writer, const void* message, const char* topic_name) {
  const dds_return_t written = writer.write(message);
  if (written == DDS_RETCODE_OK) return;
  if (!std::exchange(unwritten_, true)) {
    say_(fmt::format("DDS topic {}: cannot be written: {}", topic_name, dds_strretcode(written)));
  }
}

}  // namespace perimap

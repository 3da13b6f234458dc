#include "drivers/video/frame_times.hpp"

#include <string_view>

extern "C" {
#include <libavcodec/packet.h>
#include <libavformat/avformat.h>
#include <libavutil/rational.h>
}

namespace perimap {

void FrameTimes::Closing::operator()(AVFormatContext* context) const noexcept { avformat_close_input(&context); }

FrameTimes::FrameTimes(const std::string& path) {
  AVFormatContext* opened = nullptr;
  if (avformat_open_input(&opened, path.c_str(), nullptr, nullptr) < 0) return;
  context_.reset(opened);
  // Some containers tell their streams with the first packets alone.
  if (context_->nb_streams == 0 && avformat_find_stream_info(opened, nullptr) < 0) return;
  for (unsigned i = 0; i < context_->nb_streams && stream_ < 0; ++i) {
    if (context_->streams[i]->codecpar->codec_type == AVMEDIA_TYPE_VIDEO) stream_ = static_cast<int>(i);
  }
  if (stream_ < 0) return;
  unit_s_ = av_q2d(context_->streams[stream_]->time_base);
  shown_ = count_shown();
}

FrameTimes::~FrameTimes() = default;

std::optional<std::uint64_t> FrameTimes::count_shown() const {
  if (!std::string_view(context_->iformat->name).starts_with("mov")) return std::nullopt;
  AVStream* stream = context_->streams[stream_];
  std::uint64_t kept = 0;
  for (int entry = 0; entry < avformat_index_get_entries_count(stream); ++entry) {
    const AVIndexEntry* frame = avformat_index_get_entry(stream, entry);
    if (frame != nullptr && (frame->flags & AVINDEX_DISCARD_FRAME) == 0) ++kept;
  }
  if (kept == 0 || static_cast<std::int64_t>(kept) >= stream->nb_frames) return std::nullopt;
  return kept;
}

bool FrameTimes::read_packet() {
  AVPacket* packet = av_packet_alloc();
  bool taken = false;
  while (packet != nullptr && !taken && av_read_frame(context_.get(), packet) >= 0) {
    // What an edit list leaves out is decoded and not shown.
    if (packet->stream_index == stream_ && (packet->flags & AV_PKT_FLAG_DISCARD) == 0) {
      const std::int64_t time = packet->pts != AV_NOPTS_VALUE ? packet->pts : packet->dts;
      timed_ = timed_ && time != AV_NOPTS_VALUE;
      ahead_.push(time);
      taken = true;
    }
    av_packet_unref(packet);
  }
  av_packet_free(&packet);
  return taken;
}

std::optional<double> FrameTimes::next() {
  constexpr std::size_t kAhead = 64;  // frames are coded out of order by 16 at most (H.264, H.265)
  if (!context_ || stream_ < 0) return std::nullopt;
  while (!ended_ && timed_ && ahead_.size() < kAhead) ended_ = !read_packet();
  if (!timed_) return std::nullopt;
  if (run_.given == run_.frames) {
    if (ahead_.empty()) return std::nullopt;
    run_ = {ahead_.top(), 0, 0, run_.length};
    for (; !ahead_.empty() && ahead_.top() == run_.time; ++run_.frames) ahead_.pop();
    if (!ahead_.empty()) run_.length = ahead_.top() - run_.time;
  }
  const double share = static_cast<double>(run_.given++) / run_.frames;
  return (static_cast<double>(run_.time) + share * static_cast<double>(run_.length)) * unit_s_;
}

}  // namespace perimap

#include "daemon/setup/commands/guidance_writer.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/time/instant.hpp"
#include "daemon/dds/bounded_string.hpp"
#include "drivers/image/jpeg_encoder.hpp"

namespace perimap {

std::string small_jpeg(const GreyImage& picture, int most_px) {
  if (picture.data == nullptr) return {};
  // OpenCV has no matrix over bytes that it may not write.
  const cv::Mat whole(picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data),
                      static_cast<std::size_t>(picture.stride));
  cv::Mat shown = whole;
  if (picture.width > most_px) {
    const double scale = static_cast<double>(most_px) / picture.width;
    cv::resize(whole, shown, {most_px, std::max(1, static_cast<int>(std::lround(scale * picture.height)))}, 0.0, 0.0,
               cv::INTER_AREA);
  }
  constexpr int kQuality = 75;
  const auto jpeg =
      encode_jpeg({shown.data, shown.cols, shown.rows, static_cast<std::ptrdiff_t>(shown.step)}, kQuality);
  return jpeg ? *jpeg : std::string();  // the words are told without it
}

Expected<GuidanceWriter> GuidanceWriter::create(const dds::Membership& membership, std::string what, double longest_s) {
  auto participant = dds::Participant::create(membership);
  if (!participant) return tl::unexpected(participant.error());
  auto writer = dds::Writer<perimap_Guidance>::create(*participant);
  if (!writer) return tl::unexpected(writer.error());
  return GuidanceWriter(std::move(*participant), std::move(*writer), std::move(what), longest_s);
}

Expected<void> GuidanceWriter::tell(const LiveMoment& moment) {
  elapsed_s_ = moment.elapsed_s;
  line_ = moment.line;
  seen_percent_.clear();
  for (const double seen : moment.seen_of_ninths) {
    seen_percent_.push_back(static_cast<unsigned char>(std::lround(100.0 * std::clamp(seen, 0.0, 1.0))));
  }
  constexpr int kMost_px = 480;
  return write(perimap_GUIDANCE_RECORDING,
               writer_.matched_readers() > 0 ? small_jpeg(moment.picture, kMost_px) : std::string());
}

Expected<void> GuidanceWriter::recorded() { return write(perimap_GUIDANCE_RECORDED, {}); }

Expected<void> GuidanceWriter::write(unsigned char stage, const std::string& picture) {
  perimap_Guidance sample{};
  dds::assign(sample.what, what_);
  sample.line = line_.data();
  sample.time_ns = to_ns(MonotonicClock::now());
  sample.elapsed_s = elapsed_s_;
  sample.longest_s = longest_s_;
  sample.stage = stage;
  constexpr unsigned char kNinths = 3;
  if (!seen_percent_.empty()) sample.columns = sample.rows = kNinths;
  const auto lend = [](auto& sequence, const unsigned char* bytes, std::size_t size) {
    // Lent: DDS copies what is written, and frees nothing of it.
    sequence._maximum = sequence._length = static_cast<std::uint32_t>(size);
    sequence._buffer = const_cast<unsigned char*>(bytes);
    sequence._release = false;
  };
  lend(sample.seen_percent, seen_percent_.data(), seen_percent_.size());
  std::vector<unsigned char> bytes(picture.begin(), picture.end());
  lend(sample.picture, bytes.data(), bytes.size());
  const dds_return_t written = writer_.write(sample);
  if (written != DDS_RETCODE_OK) return fail(std::string("DDS: ") + dds_strretcode(-written));
  return {};
}

}  // namespace perimap

#include "daemon/setup/recorded_board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "core/time/instant.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recorded_frame.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

// The recording's frames one after the other, thinned to so many a second.
class ThinnedFrames {
 public:
  static Expected<ThinnedFrames> open(const std::string& recording, double frames_per_s) {
    auto reader = RecordingReader::open(recording);
    if (!reader) return tl::unexpected(reader.error());
    const auto recorded = reader->channels();
    if (std::none_of(recorded.begin(), recorded.end(),
                     [](const RecordedChannel& c) { return c.name == channels::kCameraImage; })) {
      return fail(recording + ": has no camera frames; record with the camera on, and the board in view");
    }
    if (const auto selected = reader->select(std::array{channels::kCameraImage}); !selected) {
      return tl::unexpected(selected.error());
    }
    return ThinnedFrames(recording, *std::move(reader), frames_per_s);
  }

  // The next frame's grey picture, valid until the next call; none at the end. Frames that can not be decoded are
  // passed over.
  Expected<std::optional<GreyImage>> next() {
    for (;;) {
      const auto message = reader_.next();
      if (!message) return tl::unexpected(message.error());
      if (!*message) return std::nullopt;
      const double t_s = to_seconds((*message)->source_time.time_since_epoch());
      // A frame that is stamped far ahead would make all that come after it be passed over.
      constexpr double kMostBack_s = 1.0;
      if (last_s_ && t_s < *last_s_ - kMostBack_s) {
        return fail(fmt::format(
            "{}: the frames' stamps go back by {:.1f} s: the camera's clock was set meanwhile; record again",
            recording_, *last_s_ - t_s));
      }
      last_s_ = t_s;
      if (due_s_ && t_s < *due_s_) continue;
      due_s_ = std::max(t_s, due_s_.value_or(t_s)) + interval_s_ - 1e-3;
      if (const auto read = frame_.read(reader_, **message); !read) return tl::unexpected(read.error());
      const auto grey = frame_.grey();
      if (!grey) continue;
      if (width_ == 0) width_ = grey->width, height_ = grey->height;
      if (grey->width != width_ || grey->height != height_) {
        return fail(fmt::format("{}: the frames change from {}x{} to {}x{}", recording_, width_, height_, grey->width,
                                grey->height));
      }
      t_s_ = t_s;
      return *grey;
    }
  }

  [[nodiscard]] double t_s() const { return t_s_; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  ThinnedFrames(std::string recording, RecordingReader reader, double frames_per_s)
      : recording_(std::move(recording)), reader_(std::move(reader)), interval_s_(1.0 / frames_per_s) {}

  std::string recording_;
  RecordingReader reader_;
  RecordedFrame frame_;
  double interval_s_;
  std::optional<double> due_s_;
  std::optional<double> last_s_;
  double t_s_ = 0.0;
  int width_ = 0;
  int height_ = 0;
};

// A few frames from all over the recording, to tell the board by; and how many there are.
struct Looked {
  std::vector<std::vector<std::uint8_t>> pixels;
  std::size_t frames = 0;
  int width = 0;
  int height = 0;
};

Expected<Looked> look(const std::string& recording, double frames_per_s) {
  std::size_t every = 8;  // of the frames that will be looked at
  constexpr std::size_t kMost = 64;
  auto frames = ThinnedFrames::open(recording, frames_per_s);
  if (!frames) return tl::unexpected(frames.error());
  Looked looked;
  for (;; ++looked.frames) {
    const auto grey = frames->next();
    if (!grey) return tl::unexpected(grey.error());
    if (!*grey) break;
    if (looked.frames % every != 0) continue;
    if (looked.pixels.size() == kMost) {
      // Of a longer recording half as many, so that they are of all of it.
      for (std::size_t i = 1; 2 * i < kMost; ++i) looked.pixels[i] = std::move(looked.pixels[2 * i]);
      looked.pixels.resize(kMost / 2);
      every *= 2;
      if (looked.frames % every != 0) continue;
    }
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < (*grey)->height; ++y) {
      const auto* row = (*grey)->data + y * (*grey)->stride;
      pixels.insert(pixels.end(), row, row + (*grey)->width);
    }
    looked.pixels.push_back(std::move(pixels));
  }
  looked.width = frames->width();
  looked.height = frames->height();
  if (looked.pixels.empty()) return fail(recording + ": has no frames that can be decoded");
  return looked;
}

std::optional<Pose> camera_pose_of(const BoardView& view, const CameraModel& camera) {
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> image;  // on the plane z = 1, free of distortion
  for (std::size_t i = 0; i < view.px.size(); ++i) {
    Vector3d ray;
    if (!camera.unproject(view.px[i], ray) || !(ray.z() > 0.05)) continue;
    const Vector3d& p = view.board_mm[i];
    board.emplace_back(p.x(), p.y(), p.z());
    image.emplace_back(ray.x() / ray.z(), ray.y() / ray.z());
  }
  constexpr std::size_t kFewest = 6;
  if (board.size() < kFewest) return std::nullopt;
  cv::Mat rvec;
  cv::Mat tvec;
  const cv::Mat identity = cv::Mat::eye(3, 3, CV_64F);
  try {
    if (!cv::solvePnP(board, image, identity, cv::noArray(), rvec, tvec, false, cv::SOLVEPNP_IPPE)) return std::nullopt;
    cv::solvePnPRefineLM(board, image, identity, cv::noArray(), rvec, tvec);
  } catch (const cv::Exception&) {
    return std::nullopt;  // points on a line
  }
  const auto at = [](const cv::Mat& m, int i) { return m.reshape(1, 3).at<double>(i, 0); };
  const Pose X_CB{so3_exp({at(rvec, 0), at(rvec, 1), at(rvec, 2)}), {at(tvec, 0), at(tvec, 1), at(tvec, 2)}};
  if (!X_CB.t.allFinite() || !(X_CB.t.z() > 0.0)) return std::nullopt;
  double squares = 0.0;
  for (std::size_t i = 0; i < view.px.size(); ++i) {
    Vector2d px;
    if (camera.project(X_CB * view.board_mm[i], px) != ProjectionStatus::kOk) return std::nullopt;
    squares += (px - view.px[i]).squaredNorm();
  }
  constexpr double kLargestRms_px = 5.0;
  if (std::sqrt(squares / static_cast<double>(view.px.size())) > kLargestRms_px) return std::nullopt;
  return X_CB.inverse();
}

}  // namespace

Expected<void> for_each_recorded_frame(const std::string& recording, double frames_per_s,
                                       const std::function<void(double t_s, const GreyImage& grey)>& look) {
  auto frames = ThinnedFrames::open(recording, frames_per_s);
  if (!frames) return tl::unexpected(frames.error());
  for (;;) {
    const auto grey = frames->next();
    if (!grey) return tl::unexpected(grey.error());
    if (!*grey) return {};
    look(frames->t_s(), **grey);
  }
}

Expected<RecordedBoard> find_recorded_board(
    const std::string& recording, const BoardWish& wish, double frames_per_s,
    const std::function<void(std::uint64_t done, std::uint64_t all)>& progress) {
  const auto looked = look(recording, frames_per_s);
  if (!looked) return tl::unexpected(looked.error());
  std::vector<GreyImage> pictures;
  for (const auto& pixels : looked->pixels) {
    pictures.push_back({pixels.data(), looked->width, looked->height, looked->width});
  }
  const auto board = recognise_board(pictures, wish);
  if (!board) return fail(recording + ": " + board.error().message);
  RecordedBoard found;
  found.board = *board;
  found.width = looked->width;
  found.height = looked->height;
  auto frames = ThinnedFrames::open(recording, frames_per_s);
  if (!frames) return tl::unexpected(frames.error());
  for (;;) {
    const auto grey = frames->next();
    if (!grey) return tl::unexpected(grey.error());
    if (!*grey) break;
    progress(++found.frames, looked->frames);
    auto view = find_board(**grey, *board);
    if (!view) continue;
    view->name = fmt::format("{}, frame at {:.3f} s", recording, frames->t_s());
    found.views.push_back({frames->t_s(), *std::move(view)});
  }
  return found;
}

std::vector<TimedPose> camera_poses_of(const std::vector<TimedView>& views, const CameraModel& camera) {
  std::vector<TimedPose> poses;
  for (const TimedView& seen : views) {
    if (const auto X_BC = camera_pose_of(seen.view, camera)) poses.push_back({seen.t_s, *X_BC});
  }
  return poses;
}

}  // namespace perimap

// What the example subscriber needs to run beside perimapd on a recording, and whether it drew the surface where it
// was.
//
//   overlay_check prepare RECORDING VIDEO CALIBRATION     writes the recording's frames and its camera
//   overlay_check judge RECORDING SAMPLES LINES PICTURE   LINES, PICTURE: what the example printed, and drew last
//
// The judge knows the simulated heart, by true_places.hpp. SAMPLES are of perimap watch --record.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/evaluation/report/recorded_truth.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/video/video_file.hpp"
#include "tests/integration/example/true_places.hpp"

namespace perimap {
namespace {

using test::PublishedPlaces;
using test::read_published_places;
using test::true_pixel;
using test::truth_of;

template <class T>
T value_of(Expected<T> made) {
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

int prepare(const std::string& recording, const std::string& video, const std::string& calibration) {
  const RecordedTruth truth = truth_of(recording);
  std::ofstream(calibration) << format_calibration(truth.camera);
  auto writer = value_of(VideoWriter::create(video, truth.camera.width, truth.camera.height, 30.0));
  auto reader = value_of(ReplayReader::open(recording, ReadMode::kStrict));
  std::uint64_t expected = truth.captures.begin()->first;
  while (const auto event = value_of(reader.next())) {
    const auto* frame = std::get_if<FrameEvent>(&*event);
    if (frame == nullptr) continue;
    if (frame->stamp.sequence != expected++) throw std::runtime_error("a frame is missing in the recording");
    VideoFrame picture;
    picture.grey = frame->image();
    if (auto written = writer->write(picture, {}); !written) throw std::runtime_error(written.error().message);
  }
  if (auto finished = writer->finish(); !finished) throw std::runtime_error(finished.error().message);
  fmt::print("{}\n", truth.captures.begin()->first);
  return 0;
}

// How far from the truth each position of a printed frame is, in px.
struct Off {
  std::vector<double> px;
  std::vector<double> converged_px;  // of those that are converged; others may be what moves otherwise, as a field stop
  double camera_mm = 0.0;            // the largest
};

void judge_frame(const nlohmann::json& frame, const RecordedTruth& truth, const PublishedPlaces& published, Off& off) {
  const auto sequence = frame["frame_sequence"].get<std::uint64_t>();
  const Instant capture = truth.captures.at(sequence);
  const auto true_X_WC = truth.truth.camera_pose(capture);
  if (!true_X_WC) throw std::runtime_error("no true pose of a frame");
  const Pose X_WC = published.cameras.at(sequence);
  off.camera_mm = std::max(off.camera_mm, (X_WC.t - true_X_WC->t).norm());
  for (const auto& feature : frame["features"]) {
    const auto px = true_pixel(truth, published, feature["id"].get<std::uint32_t>(), capture, X_WC);
    if (!px) continue;
    off.px.push_back((*px - Vector2d(feature["u"].get<double>(), feature["v"].get<double>())).norm());
    if (feature["state"] == "converged") off.converged_px.push_back(off.px.back());
  }
}

// The frames are grey: what has a colour was drawn.
int circles_missing(const nlohmann::json& frame, const cv::Mat& picture) {
  int missing = 0;
  for (const auto& feature : frame["features"]) {
    const int u = static_cast<int>(std::lround(feature["u"].get<double>()));
    const int v = static_cast<int>(std::lround(feature["v"].get<double>()));
    if (u < 6 || v < 6 || u >= picture.cols - 6 || v >= picture.rows - 6) continue;
    const auto& pixel = picture.at<cv::Vec3b>(v, u + 4);
    const auto [least, most] = std::minmax({pixel[0], pixel[1], pixel[2]});
    missing += most - least < 40 ? 1 : 0;
  }
  return missing;
}

int judge(const std::string& recording, const std::string& samples_file, const std::string& lines,
          const std::string& drawn) {
  const RecordedTruth truth = truth_of(recording);
  const PublishedPlaces published = read_published_places(samples_file, truth);
  std::ifstream file(lines);
  Off off;
  nlohmann::json last;
  int frames = 0;
  int refused = 0;
  for (std::string line; std::getline(file, line); ++frames) {
    last = nlohmann::json::parse(line);
    if (last.contains("refused")) {
      ++refused;
    } else {
      judge_frame(last, truth, published, off);
    }
  }
  for (auto* px : {&off.px, &off.converged_px}) std::sort(px->begin(), px->end());
  if (off.converged_px.size() < 200) {
    throw std::runtime_error(fmt::format("only {} positions were drawn in {} frames, {} of them converged",
                                         off.px.size(), frames, off.converged_px.size()));
  }
  const double median = off.px[off.px.size() / 2];
  const double most = off.converged_px[off.converged_px.size() * 95 / 100];
  fmt::print(
      "{} frames, {} refused, {} positions, off by {:.2f} px (median), {:.2f} px (95 % of converged ones), camera by "
      "{:.1f} mm at most\n",
      frames, refused, off.px.size(), median, most, off.camera_mm);
  if (refused == 0 || refused == frames)
    throw std::runtime_error("it must refuse until there is a map, and draw from then on");
  if (!(median < 1.0) || !(most < 4.0)) throw std::runtime_error("that is too far");
  if (published.models_for_a_turn < 5) throw std::runtime_error("no model was made for a beat that had become known");
  if (last.contains("refused")) throw std::runtime_error("the last frame was refused");
  const cv::Mat picture = cv::imread(drawn);
  if (picture.empty()) throw std::runtime_error(drawn + ": no picture");
  const int missing = circles_missing(last, picture);
  if (last["features"].empty() || missing > 0)
    throw std::runtime_error(fmt::format("{} circles are not drawn", missing));
  return 0;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  try {
    if (arguments.size() == 4 && arguments[0] == "prepare")
      return perimap::prepare(arguments[1], arguments[2], arguments[3]);
    if (arguments.size() == 5 && arguments[0] == "judge") {
      return perimap::judge(arguments[1], arguments[2], arguments[3], arguments[4]);
    }
    std::fprintf(stderr, "overlay_check prepare RECORDING VIDEO CALIBRATION | judge RECORDING SAMPLES LINES PICTURE\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "overlay_check: %s\n", error.what());
    return 1;
  }
}

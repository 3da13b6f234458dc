// Draws the predicted surface over the video, frame by frame as perimapd releases them.
//
//   overlay VIDEO CALIBRATION OUTPUT [--domain N] [--first-sequence N] [--seconds S]
//
// VIDEO is what the camera of that perimapd sees, from its frame --first-sequence on (0). OUTPUT is a video (.avi), or
// a picture (.png) of the last frame that was drawn. CALIBRATION is the camera's, as OpenCV writes it: its distortion
// alone is taken, for focal length and principal point are those that each surface tells of its own picture (an angled
// scope is turned in its camera head and zoomed; perimapd knows that only where `camera.turned_scope` is calibrated).
// It ends with the video, after --seconds, or when perimapd has been silent for ten seconds. Each frame is told on
// standard output, as JSON in a line.
//
// For each released frame there is a sample of `surface`, which tells when it was captured and where the camera was.
// The newest `surface_model` says where each feature was at that very instant: perimap_client.hpp evaluates it, or
// refuses, and then nothing is drawn but the reason. The newest `surface_mesh` is drawn beneath it, as the surface
// through all features: perimap_mesh_client.hpp evaluates that, by the same model's clock.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <perimap_client.hpp>
#include <perimap_mesh_client.hpp>
#include <string>
#include <vector>

#include "subscriber.hpp"

namespace {

using perimap::client::PredictedFeature;
using perimap::client::PredictedMesh;
using perimap::client::PredictedSurface;

struct Options {
  std::string video, calibration, output;
  int domain = 0;
  std::uint64_t first_sequence = 0;
  double seconds = 1e9;
};

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{1000000000} * now.tv_sec + now.tv_nsec;
}

class Camera {
 public:
  explicit Camera(const std::string& calibration) {
    const cv::FileStorage file(calibration, cv::FileStorage::READ);
    if (!file.isOpened()) throw std::runtime_error(calibration + ": cannot be read");
    file["distortion_coefficients"] >> distortion_;
    const auto model = static_cast<std::string>(file["distortion_model"]);
    fisheye_ = model == "fisheye" || model == "equidistant";
    if (distortion_.empty()) throw std::runtime_error(calibration + ": has no distortion_coefficients");
  }

  // False: not before the camera. p_W in mm; the surface tells where the camera was, and what its lens was then.
  bool project(const perimap_Surface& at, const std::array<double, 3>& p_W, cv::Point2d& px) const {
    const double* q = at.rotation_WC_wxyz;
    const cv::Matx33d R_WC(
        1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] - q[0] * q[3]), 2 * (q[1] * q[3] + q[0] * q[2]),
        2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] - q[0] * q[1]),
        2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2]));
    const double* t = at.translation_WC_mm;
    const cv::Vec3d p_C = R_WC.t() * cv::Vec3d(p_W[0] - t[0], p_W[1] - t[1], p_W[2] - t[2]);
    if (!(p_C[2] > 1.0)) return false;
    const std::vector<cv::Point3d> points{{p_C[0], p_C[1], p_C[2]}};
    const double* f = at.camera_focal_px;
    const double* c = at.camera_principal_point_px;
    const cv::Matx33d matrix(f[0], 0, c[0], 0, f[1], c[1], 0, 0, 1);
    std::vector<cv::Point2d> projected;
    const cv::Vec3d none(0, 0, 0);
    if (fisheye_) {
      cv::fisheye::projectPoints(points, projected, none, none, matrix, distortion_);
    } else {
      cv::projectPoints(points, none, none, matrix, distortion_, projected);
    }
    px = projected[0];
    return true;
  }

 private:
  cv::Mat distortion_;
  bool fisheye_ = false;
};

cv::Scalar colour_of(perimap_FeatureState state) {
  switch (state) {
    case perimap_FEATURE_CONVERGED:
      return {80, 220, 80};
    case perimap_FEATURE_CONVERGING:
      return {60, 200, 255};
    default:
      return {60, 60, 240};
  }
}

// The video's frame of this sequence number; false at its end. Frames come in order.
class Video {
 public:
  Video(const std::string& file, std::uint64_t first_sequence) : capture_(file), next_(first_sequence) {
    if (!capture_.isOpened()) throw std::runtime_error(file + ": cannot be read");
  }

  bool read(std::uint64_t sequence, cv::Mat& picture) {
    if (sequence < next_) return false;
    for (; next_ < sequence; ++next_) {
      if (!capture_.grab()) return false;
    }
    ++next_;
    if (!capture_.read(picture)) return false;
    if (picture.channels() == 1) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
    return true;
  }
  [[nodiscard]] double frames_per_s() const {
    const double rate = capture_.get(cv::CAP_PROP_FPS);
    return rate > 0 ? rate : 30.0;
  }

 private:
  cv::VideoCapture capture_;
  std::uint64_t next_;
};

// A video, or the last picture alone.
class Output {
 public:
  Output(std::string file, double frames_per_s) : file_(std::move(file)), rate_(frames_per_s) {}
  void add(const cv::Mat& picture) {
    picture_ = picture;
    if (is_picture()) return;
    if (!writer_.isOpened() &&
        !writer_.open(file_, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), rate_, picture.size())) {
      throw std::runtime_error(file_ + ": cannot be written");
    }
    writer_.write(picture);
  }
  void finish() {
    if (is_picture() && !picture_.empty() && !cv::imwrite(file_, picture_))
      throw std::runtime_error(file_ + ": cannot be written");
  }

 private:
  [[nodiscard]] bool is_picture() const { return file_.size() > 4 && file_.compare(file_.size() - 4, 4, ".png") == 0; }

  std::string file_;
  double rate_;
  cv::VideoWriter writer_;
  cv::Mat picture_;
};

// The one surface, where there is one: its triangles, the brighter the surer. Returns why there is none.
const char* draw_mesh(const perimap_Surface& frame, const perimap_SurfaceMesh* newest,
                      const perimap_SurfaceModel& model, const Camera& camera, PredictedMesh& mesh, cv::Mat& picture) {
  if (newest == nullptr) return "no surface yet";
  if (!perimap::client::predict(*newest, model, frame.capture_time_ns, monotonic_ns(), {}, mesh)) return describe(mesh);
  std::vector<cv::Point> places(mesh.positions_W_mm.size());
  std::vector<bool> before(places.size());
  constexpr int kShift = 4;  // sixteenths of a pixel
  for (std::size_t v = 0; v < places.size(); ++v) {
    cv::Point2d px;
    before[v] = camera.project(frame, mesh.positions_W_mm[v], px);
    if (before[v]) places[v] = {cvRound(px.x * (1 << kShift)), cvRound(px.y * (1 << kShift))};
  }
  for (const PredictedMesh::Triangle& triangle : mesh.triangles) {
    double deviation_mm = 0.0;
    bool visible = true;
    for (const std::uint32_t v : triangle) {
      deviation_mm = std::max(deviation_mm, mesh.deviations_mm[v]);
      visible = visible && before[v];
    }
    if (!visible) continue;
    const double bright = 60.0 + 140.0 * std::max(0.0, 1.0 - deviation_mm);
    const std::array<cv::Point, 3> corners = {places[triangle[0]], places[triangle[1]], places[triangle[2]]};
    cv::polylines(picture, std::vector<cv::Point>(corners.begin(), corners.end()), true, {bright, 0.7 * bright, 40.0},
                  1, cv::LINE_AA, kShift);
  }
  return nullptr;
}

const char* name_of(perimap_FeatureState state) {
  switch (state) {
    case perimap_FEATURE_CONVERGED:
      return "converged";
    case perimap_FEATURE_CONVERGING:
      return "converging";
    case perimap_FEATURE_INCONSISTENT:
      return "inconsistent";
    default:
      return "invalid";
  }
}

// Draws what is predicted for this frame and tells it; what is refused is written over the picture instead.
void draw(const perimap_Surface& frame, const perimap_SurfaceModel* model, const perimap_SurfaceMesh* newest_mesh,
          const Camera& camera, PredictedSurface& surface, PredictedMesh& mesh, cv::Mat& picture) {
  const char* refused = nullptr;
  if (model == nullptr) {
    refused = "no model yet";
  } else if (!frame.camera_pose_known) {
    refused = "it is not known where the camera was";
  } else if (!(frame.camera_focal_px[0] > 0)) {
    refused = "this perimapd is too old to tell what the lens was";
  } else if (!perimap::client::predict(*model, frame.capture_time_ns, monotonic_ns(), {}, surface)) {
    refused = describe(surface);
  }
  std::printf("{\"frame_sequence\": %llu, ", static_cast<unsigned long long>(frame.frame_sequence));
  if (refused != nullptr) {
    cv::putText(picture, refused, {8, 18}, cv::FONT_HERSHEY_SIMPLEX, 0.5, {60, 60, 240}, 1, cv::LINE_AA);
    std::printf("\"refused\": \"%s\"}\n", refused);
    return;
  }
  std::printf("\"capture_time_ns\": %lld, ", static_cast<long long>(frame.capture_time_ns));
  if (const char* none = draw_mesh(frame, newest_mesh, *model, camera, mesh, picture)) {
    std::printf("\"mesh\": {\"refused\": \"%s\"}, ", none);
  } else {
    std::printf("\"mesh\": {\"vertices\": %zu, \"triangles\": %zu}, ", mesh.positions_W_mm.size(),
                mesh.triangles.size());
  }
  std::printf("\"features\": [");
  const char* separator = "";
  for (const PredictedFeature& feature : surface.features) {
    cv::Point2d px;
    if (feature.state == perimap_FEATURE_INVALID || !camera.project(frame, feature.position_W_mm, px)) continue;
    constexpr int kShift = 4;  // sixteenths of a pixel
    const cv::Point centre(cvRound(px.x * (1 << kShift)), cvRound(px.y * (1 << kShift)));
    cv::circle(picture, centre, 4 << kShift, colour_of(feature.state), 1, cv::LINE_AA, kShift);
    std::printf("%s{\"id\": %u, \"state\": \"%s\", \"u\": %.3f, \"v\": %.3f}", separator, feature.id,
                name_of(feature.state), px.x, px.y);
    separator = ", ";
  }
  std::printf("]}\n");
}

int run(const Options& options) {
  const Camera camera(options.calibration);
  Video video(options.video, options.first_sequence);
  Output output(options.output, video.frames_per_s());
  const Participant participant(options.domain);
  Subscriber<perimap_Surface> surfaces(participant, perimap_Surface_desc, "perimap/surface", false, 16);
  Subscriber<perimap_SurfaceModel> models(participant, perimap_SurfaceModel_desc, "perimap/surface_model", true, 1);
  Subscriber<perimap_SurfaceMesh> meshes(participant, perimap_SurfaceMesh_desc, "perimap/surface_mesh", true, 1);

  PredictedSurface surface;
  PredictedMesh mesh;
  constexpr std::int64_t kSilence_ns = 10000000000;
  const std::int64_t begun = monotonic_ns();
  std::int64_t heard = begun;
  bool ended = false;
  while (!ended && monotonic_ns() - heard < kSilence_ns &&
         static_cast<double>(monotonic_ns() - begun) < 1e9 * options.seconds) {
    models.take([](const perimap_SurfaceModel&) {});
    meshes.take([](const perimap_SurfaceMesh&) {});
    surfaces.take([&](const perimap_Surface& frame) {
      heard = monotonic_ns();
      // A surface of a frame that never came has no picture.
      cv::Mat picture;
      if (frame.reason == perimap_SURFACE_REASON_FRAME_MISSING || !video.read(frame.frame_sequence, picture)) return;
      draw(frame, models.newest(), meshes.newest(), camera, surface, mesh, picture);
      output.add(picture);
    });
    dds_sleepfor(DDS_MSECS(2));
  }
  output.finish();
  return 0;
}

int usage() {
  std::fprintf(stderr, "overlay VIDEO CALIBRATION OUTPUT [--domain N] [--first-sequence N] [--seconds S]\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return usage();
  Options options;
  options.video = argv[1];
  options.calibration = argv[2];
  options.output = argv[3];
  for (int i = 4; i < argc; i += 2) {
    if (i + 1 == argc) return usage();
    if (std::strcmp(argv[i], "--domain") == 0) {
      options.domain = std::atoi(argv[i + 1]);
    } else if (std::strcmp(argv[i], "--first-sequence") == 0) {
      options.first_sequence = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (std::strcmp(argv[i], "--seconds") == 0) {
      options.seconds = std::atof(argv[i + 1]);
    } else {
      return usage();
    }
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "overlay: %s\n", error.what());
    return 1;
  }
}

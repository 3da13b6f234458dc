#include "tests/integration/example/true_places.hpp"

#include <array>
#include <stdexcept>
#include <string_view>

#include "drivers/recording/channels.hpp"

namespace perimap::test {
namespace {

template <class T>
T value_or_throw(Expected<T> made) {
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

void keep(const perimap_SurfaceModel& model, Instant& last_model, PublishedPlaces& places) {
  const Instant made = from_ns(model.time_ns);
  places.models_for_a_turn += made - last_model < std::chrono::milliseconds(450) ? 1 : 0;
  last_model = made;
  for (std::uint32_t i = 0; i < model.features._length; ++i) {
    const perimap_ModelFeature& feature = model.features._buffer[i];
    places.first_views[feature.id] = {from_ns(feature.first_observed_time_ns),
                                      {feature.first_observed_px[0], feature.first_observed_px[1]}};
  }
}

void keep(const perimap_Surface& surface, const RecordedTruth& truth, PublishedPlaces& places) {
  if (surface.camera_pose_known) {
    const double* t = surface.translation_WC_mm;
    places.cameras[surface.frame_sequence] = pose_from_wxyz({t[0], t[1], t[2]}, surface.rotation_WC_wxyz);
  }
  if (!places.to_recording && rests_on_its_frame(surface.reason))
    places.to_recording = truth.to_recording(surface.frame_sequence, from_ns(surface.capture_time_ns));
}

}  // namespace

RecordedTruth truth_of(const std::string& recording) {
  auto truth = value_or_throw(load_truth(recording, ReadMode::kStrict));
  if (!truth) throw std::runtime_error(recording + ": has no ground truth");
  return std::move(*truth);
}

PublishedPlaces read_published_places(const std::string& samples, const RecordedTruth& truth) {
  auto reader = value_or_throw(RecordingReader::open(samples, ReadMode::kStrict));
  constexpr std::array<std::string_view, 2> kPublished = {channels::kSurface, channels::kSurfaceModel};
  if (auto selected = reader.select(kPublished); !selected) throw std::runtime_error(selected.error().message);
  PublishedPlaces places;
  Instant last_model;
  while (const auto message = value_or_throw(reader.next())) {
    if (message->channel == channels::kSurfaceModel) {
      keep(*value_or_throw(reader.decode<perimap_SurfaceModel>(*message)), last_model, places);
    } else {
      keep(*value_or_throw(reader.decode<perimap_Surface>(*message)), truth, places);
    }
  }
  if (!places.to_recording) throw std::runtime_error(samples + ": no surface of a frame");
  return places;
}

CameraModel lens_at(const RecordedTruth& truth, Instant capture) {
  CameraModel lens = truth.camera;
  const CameraTruth* camera = truth.truth.camera(capture);
  if (camera == nullptr || !(camera->focal_px.x() > 0.0)) return lens;
  lens.fx = camera->focal_px.x(), lens.fy = camera->focal_px.y();
  lens.cx = camera->principal_px.x(), lens.cy = camera->principal_px.y();
  return lens;
}

std::optional<Vector2d> true_pixel(const RecordedTruth& truth, const PublishedPlaces& published, std::uint32_t feature,
                                   Instant capture, const Pose& X_WC) {
  const auto first = published.first_views.find(feature);
  if (first == published.first_views.end()) throw std::runtime_error("a feature was drawn that no model had");
  const Instant seen = first->second.first + *published.to_recording;
  const auto seen_from = truth.truth.camera_pose(seen);
  Vector3d ray_C;
  if (!seen_from || !lens_at(truth, seen).unproject(first->second.second, ray_C)) return std::nullopt;
  const auto point = truth.truth.first_hit(*seen_from, ray_C, seen);
  if (!point) return std::nullopt;
  Vector2d px;
  const Vector3d p_C = X_WC.inverse() * truth.truth.position(*point, capture);
  if (lens_at(truth, capture).project(p_C, px) != ProjectionStatus::kOk) return std::nullopt;
  return px;
}

}  // namespace perimap::test

#include "daemon/bridge/messages/view_annotations.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/bridge/messages/lent.hpp"
#include "daemon/bridge/messages/view_colours.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "drivers/recording/foxglove_image.hpp"

namespace perimap {
namespace {

// Of a picture of this width; of others in proportion.
constexpr double kWidth_px = 320.0;
constexpr double kCircle_px = 7.0;
constexpr double kLine_px = 1.5;
constexpr double kText_px = 14.0;
// A letter's width by its height, as viewers write them: the words are to fit into the picture.
constexpr double kLetter = 0.62;
constexpr foxglove_Color kWhite{1.0, 1.0, 1.0, 1.0};
constexpr foxglove_Color kBackground{0.0, 0.0, 0.0, 0.6};
constexpr foxglove_Color kNone{0.0, 0.0, 0.0, 0.0};

// Ours has its centre at integers.
foxglove_Point2 pixel(const Vector2d& px) { return {px.x() + 0.5, px.y() + 0.5}; }

}  // namespace

void ViewAnnotations::add_words(const ShownSurface& shown, double scale, Instant utc) {
  words_ = name_of(shown.state);
  if (!shown.why.empty()) words_ += fmt::format(": {}", shown.why);
  auto& text = texts_.emplace_back();
  text.timestamp = to_foxglove_time(utc);
  const double fitting_px = kWidth_px / (kLetter * static_cast<double>(words_.size() + 2));
  text.font_size = scale * std::min(kText_px, fitting_px);
  text.position = {scale * 6.0, scale * 6.0 + text.font_size};
  text.text = lent(words_);
  text.text_color = shown.usable() ? colour_of(shown.state, 0.0) : kWhite;
  text.background_color = kBackground;
}

void ViewAnnotations::add_features(const PictureProjector& project, double scale, Instant utc) {
  for (const client::PredictedFeature& feature : features_.features) {
    const auto px = project(feature.position_W_mm);
    if (!px || feature.state == perimap_FEATURE_INVALID || !project.lens().contains(*px)) continue;
    auto& circle = circles_.emplace_back();
    circle.timestamp = to_foxglove_time(utc);
    circle.position = pixel(*px);
    circle.diameter = scale * kCircle_px;
    circle.thickness = scale * kLine_px;
    circle.fill_color = kNone;
    circle.outline_color = colour_of(feature.state);
  }
}

void ViewAnnotations::add_outline(const PictureProjector& project, const ShownSurface& shown, double scale,
                                  Instant utc) {
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const auto& corners = mesh_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      if ((mesh_.of_mesh.border_edges[t] >> k & 1U) == 0) continue;
      const auto from = project(mesh_.positions_W_mm[corners[k]]);
      const auto to = project(mesh_.positions_W_mm[corners[(k + 1) % 3]]);
      if (!from || !to) continue;
      outline_.push_back(pixel(*from));
      outline_.push_back(pixel(*to));
    }
  }
  if (outline_.empty()) return;
  auto& lines = lines_.emplace_back();
  lines.timestamp = to_foxglove_time(utc);
  lines.type = foxglove_POINTS_LINE_LIST;
  lend(outline_, lines.points);
  lines.outline_color = colour_of(shown.state, 0.0);
  lines.fill_color = kNone;
  lines.thickness = scale * kLine_px;
}

const foxglove_ImageAnnotations& ViewAnnotations::of(const perimap_Surface& surface, const ShownSurface& shown,
                                                     const SurfaceGate& gate, const std::optional<CameraModel>& lens,
                                                     Instant receipt, Instant utc) {
  annotations_ = {};
  circles_.clear();
  lines_.clear();
  outline_.clear();
  texts_.clear();
  const double scale = lens ? lens->width / kWidth_px : 1.0;
  add_words(shown, scale, utc);
  const perimap_SurfaceModel* model = gate.model();
  if (shown.usable() && shown.X_WC && lens && model != nullptr) {
    const PictureProjector project(surface, *lens);
    const std::int64_t capture = surface.capture_time_ns;
    if (client::predict(*model, capture, to_ns(receipt), {true}, features_)) add_features(project, scale, utc);
    if (!shown.mesh.triangles.empty() &&
        client::predict(*gate.mesh(), *model, capture, to_ns(receipt), {true}, mesh_)) {
      add_outline(project, shown, scale, utc);
    }
  }
  lend(circles_, annotations_.circles);
  lend(lines_, annotations_.points);
  lend(texts_, annotations_.texts);
  return annotations_;
}

}  // namespace perimap

#include "daemon/evaluation/track_judge/track_picture.hpp"

#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

namespace perimap {
namespace {

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

std::array<double, 3> colour_of(TripVerdict verdict) {
  switch (verdict) {
    case TripVerdict::kRight:
      return {0.2, 1.0, 0.3};
    case TripVerdict::kStrayed:
      return {1.0, 0.9, 0.2};
    case TripVerdict::kElsewhere:
      return {1.0, 0.2, 0.2};
    case TripVerdict::kLost:
      break;
  }
  return {0.75, 0.75, 0.75};
}

// The first frame at half its light, so that tracks stand out.
std::vector<std::uint8_t> darkened(const Clip& clip, int stride) {
  const ColourImage colour = clip.at(0).colour;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(stride) * static_cast<std::size_t>(clip.height()));
  for (int y = 0; y < clip.height(); ++y) {
    const std::uint8_t* const from = colour.row(y);
    std::uint8_t* const to = pixels.data() + static_cast<std::ptrdiff_t>(y) * stride;
    for (int x = 0; x < clip.width(); ++x) {
      for (int channel = 0; channel < 3; ++channel)
        to[4 * x + channel] = static_cast<std::uint8_t>(from[3 * x + channel] / 2);
    }
  }
  return pixels;
}

void draw_tracks(cairo_t* context, const Tracks& tracks, const TripFigures& figures, std::size_t turn, double scale) {
  constexpr double kLine_px = 1.2, kMark_px = 3;
  cairo_set_line_width(context, kLine_px);
  for (const auto& [id, verdict] : figures.verdicts) {
    const auto& [red, green, blue] = colour_of(verdict);
    const Track& track = tracks.at(id);
    cairo_set_source_rgb(context, red, green, blue);
    cairo_new_path(context);
    for (std::size_t step = 0; step <= turn; ++step) {
      if (track[step]) cairo_line_to(context, scale * (track[step]->x() + 0.5), scale * (track[step]->y() + 0.5));
    }
    cairo_stroke(context);
    const auto begin = begin_of(track);
    if (!begin) continue;
    const Vector2d at = scale * (*track[*begin] + Vector2d(0.5, 0.5));
    cairo_arc(context, at.x(), at.y(), kMark_px, 0, 2 * std::numbers::pi);
    cairo_fill(context);
  }
}

}  // namespace

Expected<void> draw_contest(const Contest& contest, const Clip& clip, const std::string& path) {
  constexpr double kLeastWidth_px = 800;
  const double scale = std::max(1.0, kLeastWidth_px / clip.width());
  const int width = static_cast<int>(std::lround(scale * clip.width()));
  const int height = static_cast<int>(std::lround(scale * clip.height()));
  const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_RGB24, clip.width());
  std::vector<std::uint8_t> pixels = darkened(clip, stride);
  const Surface frame(
      cairo_image_surface_create_for_data(pixels.data(), CAIRO_FORMAT_RGB24, clip.width(), clip.height(), stride),
      &cairo_surface_destroy);
  const Surface picture(cairo_image_surface_create(CAIRO_FORMAT_RGB24, 2 * width, height), &cairo_surface_destroy);
  const Context context(cairo_create(picture.get()), &cairo_destroy);
  const auto panel = [&](double left, const Tracks& tracks, const TripFigures& figures) {
    cairo_save(context.get());
    cairo_translate(context.get(), left, 0);
    cairo_rectangle(context.get(), 0, 0, width, height);
    cairo_clip(context.get());
    cairo_save(context.get());
    cairo_scale(context.get(), scale, scale);
    cairo_set_source_surface(context.get(), frame.get(), 0, 0);
    cairo_paint(context.get());
    cairo_restore(context.get());
    draw_tracks(context.get(), tracks, figures, clip.turn(), scale);
    cairo_restore(context.get());
  };
  panel(0, contest.ours, contest.our_figures);
  panel(width, contest.theirs, contest.their_figures);
  const cairo_status_t written = cairo_surface_write_to_png(picture.get(), path.c_str());
  if (written != CAIRO_STATUS_SUCCESS) return fail(path + ": " + cairo_status_to_string(written));
  return {};
}

}  // namespace perimap

#include "drivers/standins/truth/organ_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace perimap {
namespace {

// From 0 at the beginning to 1 at the end, gently.
double come(const OrganMove& move, Instant t) noexcept {
  const double s = std::clamp(to_seconds(t - move.begin) / to_seconds(move.end - move.begin), 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

// Presses in within a third of its time or a second, and goes back as fast.
double pressed(const OrganMove& move, Instant t) noexcept {
  if (t <= move.begin || t >= move.end) return 0.0;
  const double ramp_s = std::min(1.0, to_seconds(move.end - move.begin) / 3.0);
  const double s = std::min(1.0, to_seconds(std::min(t - move.begin, move.end - t)) / ramp_s);
  return s * s * (3.0 - 2.0 * s);
}

}  // namespace

Vector3d OrganPlace::of(const Vector3d& p_W, const Vector3d& rest_W) const noexcept {
  Vector3d p = p_W;
  for (const Dent& dent : dents_) {
    const double share2 = (rest_W - dent.middle_W).squaredNorm() / (dent.radius_mm * dent.radius_mm);
    if (share2 < 1.0) p += (1.0 - share2) * (1.0 - share2) * dent.displacement_W;
  }
  return A_ * p + b_;
}

// A_ is a rotation times a stretch.
Pose OrganPlace::carried(const Pose& X_WO) const noexcept {
  return {A_ * X_WO.R / std::cbrt(A_.determinant()), A_ * X_WO.t + b_};
}

Expected<OrganMotion> OrganMotion::create(std::vector<OrganMove> moves) {
  std::array<const OrganMove*, OrganMove::kKinds> last{};
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const OrganMove& move = moves[i];
    const auto wrong = [i](const char* what) { return fail("organ motion: move " + std::to_string(i) + " " + what); };
    if (static_cast<std::uint8_t>(move.kind) >= OrganMove::kKinds) return wrong("is of no kind");
    if (move.end <= move.begin) return wrong("does not end after its beginning");
    if (i > 0 && move.begin < moves[i - 1].begin) return wrong("begins before the one in front of it");
    const bool is_finite = move.translation_mm.allFinite() && move.rotation_rad.allFinite() &&
                           move.pivot_mm.allFinite() && std::isfinite(move.stretch) && move.stretch > -1.0;
    if (!is_finite) return wrong("is not made of finite numbers");
    if (move.kind == OrganMove::Kind::kDent) {
      if (!(move.radius_mm > 0.0) || !std::isfinite(move.radius_mm)) return wrong("is a dent without a radius");
      continue;
    }
    const OrganMove*& before = last[static_cast<std::size_t>(move.kind)];
    if (before != nullptr && move.begin < before->end) return wrong("begins before the last of its kind has ended");
    before = &move;
  }
  return OrganMotion(std::move(moves));
}

OrganPlace OrganMotion::at(Instant t) const {
  OrganPlace place;
  for (const OrganMove& move : moves_) {
    if (move.kind != OrganMove::Kind::kDent) continue;
    const double share = pressed(move, t);
    if (share > 0.0) place.dents_.push_back({move.pivot_mm, share * move.translation_mm, move.radius_mm});
  }
  for (const auto kind : {OrganMove::Kind::kInsufflation, OrganMove::Kind::kRetraction, OrganMove::Kind::kTilt}) {
    Vector3d translation = Vector3d::Zero(), rotation = Vector3d::Zero(), pivot = Vector3d::Zero();
    double stretch = 0.0;
    for (const OrganMove& move : moves_) {
      if (move.kind != kind || t <= move.begin) continue;
      const double share = come(move, t);
      translation += share * (move.translation_mm - translation);
      rotation += share * (move.rotation_rad - rotation);
      stretch += share * (move.stretch - stretch);
      pivot = move.pivot_mm;
    }
    // p -> pivot + (1 + stretch) R (p - pivot) + translation
    const Matrix3d A = (1.0 + stretch) * so3_exp(rotation);
    place.b_ = A * (place.b_ - pivot) + pivot + translation;
    place.A_ = A * place.A_;
  }
  return place;
}

}  // namespace perimap

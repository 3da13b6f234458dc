#include "drivers/standins/simulator/tissue.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/standins/simulator/solid_noise.hpp"

namespace perimap {
namespace {

using Eigen::Vector3f;

}  // namespace

TissueSample tissue_at(const Vector3f& p_mm, std::uint32_t seed) noexcept {
  const Vector3f warp(solid::noise(p_mm / 11.0F, seed + 11), solid::noise(p_mm / 11.0F, seed + 12),
                      solid::noise(p_mm / 11.0F, seed + 13));
  const Vector3f q = p_mm + 3.5F * warp;

  // Muscle: blotches at every size, and fibres, fine across and long along an oblique direction.
  float albedo = 0.44F + 0.19F * solid::octaves(p_mm / 5.0F, 4, seed + 20);
  const Vector3f along = Vector3f(0.55F, 0.25F, -0.80F).normalized();
  const Vector3f fibre = q / 1.6F - along * (along.dot(q) * (1.0F / 1.6F - 1.0F / 9.0F));
  albedo += 0.09F * solid::noise(fibre, seed + 30);

  const float large = solid::line_distance_mm(q, 30.0F, seed + 40);
  const float medium = solid::line_distance_mm(q, 12.0F, seed + 41);
  const float small = solid::line_distance_mm(q, 6.0F, seed + 42);

  // Fat lies along the large vessels and in islands, in lobules with darker seams.
  const float islands = solid::octaves(q / 22.0F, 3, seed + 50);
  const float fat = solid::smoothstep(0.10F, 0.26F, islands + 0.30F * (1.0F - solid::smoothstep(1.0F, 6.0F, large)));
  if (fat > 0.0F) {
    const float lobule = solid::cell_distance(q / 2.6F, seed + 60);
    const float fat_albedo =
        0.74F - 0.34F * solid::smoothstep(0.35F, 0.85F, lobule) + 0.10F * solid::octaves(p_mm / 2.0F, 2, seed + 61);
    albedo += fat * (fat_albedo - albedo);
  }

  // Vessels: dark blood with a faintly brighter wall; fat covers the small ones.
  const auto vessel = [&](float distance, float radius, float strength) {
    const float edge = std::max(0.25F * radius, 0.17F);  // mm, nothing sharper than the texture can hold
    const float blood = strength * (1.0F - solid::smoothstep(radius - edge, radius + edge, distance));
    const float wall = 0.35F * strength * solid::smoothstep(0.9F * radius, 1.4F * radius, distance) *
                       (1.0F - solid::smoothstep(1.5F * radius, 2.4F * radius, distance));
    albedo += blood * (0.20F - albedo) + wall * 0.25F;
  };
  vessel(small, 0.20F, 0.60F * (1.0F - fat));
  vessel(medium, 0.42F, 0.65F * (1.0F - 0.7F * fat));
  vessel(large, 0.85F, 0.75F);

  TissueSample sample;
  sample.albedo = std::clamp(albedo, 0.03F, 0.98F);
  // The film of fluid dips and rises by some hundredths of a millimetre.
  sample.bump = 0.055F * (solid::noise_with_slope(p_mm / 2.2F, seed + 70).slope +
                          solid::noise_with_slope(p_mm / 1.0F, seed + 71).slope);
  return sample;
}

}  // namespace perimap

#include "drivers/standins/simulator/epicardium.hpp"

#include <algorithm>

#include "drivers/standins/simulator/solid_noise.hpp"

namespace perimap {
namespace {

using Eigen::Vector3f;

struct Vessels {
  float distance_mm, radius_mm, strength;
};

// Blood shines through what lies over it: no vessel has a sharp edge, and none is black.
float darkened(float albedo, const Vessels& vessels) noexcept {
  constexpr float kBlood = 0.16F;
  const float blood = vessels.strength * (1.0F - solid::smoothstep(0.4F * vessels.radius_mm, 1.5F * vessels.radius_mm,
                                                                   vessels.distance_mm));
  return albedo + blood * (kBlood - albedo);
}

}  // namespace

TissueSample epicardium_at(const Vector3f& p_mm, std::uint32_t seed) noexcept {
  const Vector3f warp(solid::noise(p_mm / 13.0F, seed + 111), solid::noise(p_mm / 13.0F, seed + 112),
                      solid::noise(p_mm / 13.0F, seed + 113));
  const Vector3f q = p_mm + 4.0F * warp;

  // Mottling at every size. Some regions have hardly any of the finer ones: there is little to follow.
  const float relief = 0.25F + 1.22F * solid::smoothstep(-0.35F, 0.45F, solid::noise(p_mm / 17.0F, seed + 120));
  const float fine = 0.16F * solid::noise(p_mm / 3.0F, seed + 121) + 0.155F * solid::noise(q / 1.5F, seed + 122) +
                     0.10F * solid::noise(p_mm / 0.8F, seed + 123) + 0.045F * solid::noise(p_mm / 0.4F, seed + 126);
  float albedo = 0.36F + 0.12F * solid::noise(p_mm / 19.0F, seed + 124) + 0.09F * solid::noise(q / 7.0F, seed + 125) +
                 relief * fine;

  const float large = solid::line_distance_mm(q, 30.0F, seed + 140);
  const float medium = solid::line_distance_mm(q, 12.0F, seed + 141);
  const float small = solid::line_distance_mm(q, 6.0F, seed + 142);

  // Fat in lobules, smeared by the serous layer over it.
  const float islands = solid::octaves(q / 24.0F, 3, seed + 150);
  const float fat = solid::smoothstep(0.05F, 0.40F, islands + 0.25F * (1.0F - solid::smoothstep(1.0F, 7.0F, large)));
  if (fat > 0.0F) {
    const float lobule = solid::cell_distance(q / 2.8F, seed + 160);
    albedo += fat * (0.49F - 0.15F * solid::smoothstep(0.3F, 0.9F, lobule) + relief * fine - albedo);
  }
  albedo = darkened(albedo, {small, 0.22F, 0.55F * relief * (1.0F - fat)});
  albedo = darkened(albedo, {medium, 0.45F, 0.65F * (1.0F - 0.7F * fat)});
  albedo = darkened(albedo, {large, 0.95F, 0.76F});

  TissueSample sample;
  sample.albedo = std::clamp(albedo, 0.03F, 0.98F);
  sample.bump = 0.08F * (solid::noise_with_slope(p_mm / 4.0F, seed + 170).slope +
                         solid::noise_with_slope(p_mm / 1.8F, seed + 171).slope +
                         0.5F * solid::noise_with_slope(p_mm / 0.9F, seed + 172).slope);
  return sample;
}

}  // namespace perimap

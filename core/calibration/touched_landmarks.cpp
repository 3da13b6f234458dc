#include "core/calibration/touched_landmarks.hpp"

#include <numeric>

#include "core/calibration/landmark_registration.hpp"

namespace perimap {
namespace {

double misfit(const std::vector<Vector3d>& landmarks_I, const std::vector<Vector3d>& places_W,
              const std::vector<std::size_t>& chosen) {
  std::vector<Vector3d> from;
  for (const std::size_t place : chosen) from.push_back(places_W[place]);
  const Pose X_IW = rigid_fit(landmarks_I, from);
  double squares = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) squares += (landmarks_I[i] - X_IW * from[i]).squaredNorm();
  return squares;
}

// The next choice of so many of `count` places in their order; false after the last.
bool next_choice(std::vector<std::size_t>& chosen, std::size_t count) {
  for (std::size_t i = chosen.size(); i-- > 0;) {
    if (chosen[i] + (chosen.size() - i) == count) continue;
    std::iota(chosen.begin() + static_cast<std::ptrdiff_t>(i), chosen.end(), chosen[i] + 1);
    return true;
  }
  return false;
}

}  // namespace

std::optional<std::vector<std::size_t>> touched_landmarks(const std::vector<Vector3d>& landmarks_I,
                                                          const std::vector<Vector3d>& places_W) {
  constexpr std::size_t kFewestToTell = 4;
  constexpr std::size_t kMostTooMany = 4;
  const std::size_t n = landmarks_I.size();
  const bool tells = n >= kFewestToTell && places_W.size() <= n + kMostTooMany;
  if (places_W.size() < n || (places_W.size() > n && !tells)) return std::nullopt;
  std::vector<std::size_t> chosen(n);
  std::iota(chosen.begin(), chosen.end(), 0);
  std::vector<std::size_t> best = chosen;
  double least = misfit(landmarks_I, places_W, chosen);
  while (next_choice(chosen, places_W.size())) {
    const double of_these = misfit(landmarks_I, places_W, chosen);
    if (of_these < least) least = of_these, best = chosen;
  }
  return best;
}

}  // namespace perimap

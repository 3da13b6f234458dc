#include "drivers/calibration/registration_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error/one_line.hpp"
#include "drivers/json/json_seal.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr double kFarthest_mm = 1e5;
constexpr double kLargestVariance = 1e6;

template <std::size_t N>
bool read_numbers(const nlohmann::json& json, const char* key, double (&values)[N]) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_array() || found->size() != N) return false;
  for (std::size_t i = 0; i < N; ++i) {
    if (!(*found)[i].is_number()) return false;
    values[i] = (*found)[i].get<double>();
    if (!std::isfinite(values[i])) return false;
  }
  return true;
}

bool read_covariance(const nlohmann::json& rows, Eigen::Matrix<double, 6, 6>& covariance) {
  if (!rows.is_array() || rows.size() != 6) return false;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const nlohmann::json& row = rows[static_cast<std::size_t>(i)];
    if (!row.is_array() || row.size() != 6) return false;
    for (Eigen::Index j = 0; j < 6; ++j) {
      const nlohmann::json& value = row[static_cast<std::size_t>(j)];
      if (!value.is_number()) return false;
      covariance(i, j) = value.get<double>();
    }
  }
  const bool symmetric = (covariance - covariance.transpose()).norm() <= 1e-6 * covariance.norm();
  return covariance.allFinite() && symmetric && covariance.diagonal().minCoeff() > 0.0 &&
         covariance.diagonal().maxCoeff() < kLargestVariance;
}

}  // namespace

Expected<RegistrationFile> parse_registration(std::string_view text, std::string_view name) {
  const auto wrong = [&](std::string_view what) {
    return fail(on_one_line(fmt::format("{}: {}; expected a file that perimap register --output wrote", name, what)));
  };
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return wrong("is no JSON object");
  if (const auto whole = check_json_seal(json); !whole) return wrong(whole.error().message);
  double t[3], q[4], middle[3];
  if (!read_numbers(json, "translation_mm", t) || Vector3d(t[0], t[1], t[2]).norm() > kFarthest_mm) {
    return wrong("key 'translation_mm' is not three numbers in mm");
  }
  const bool has_q = read_numbers(json, "rotation_wxyz", q);
  if (!has_q || std::abs(Eigen::Map<const Eigen::Vector4d>(q).norm() - 1.0) > 1e-3) {
    return wrong("key 'rotation_wxyz' is not the four numbers of a unit quaternion");
  }
  RegistrationFile registration;
  registration.X_IW = pose_from_wxyz({t[0], t[1], t[2]}, q);
  if (!json.contains("covariance") || json["covariance"].is_null()) return registration;
  registration.covariance.emplace();
  if (!read_covariance(json["covariance"], *registration.covariance)) {
    return wrong("key 'covariance' is not six rows of six numbers, symmetric with positive variances");
  }
  if (!read_numbers(json, "covariance_about_mm", middle)) {
    return wrong("key 'covariance_about_mm' is not three numbers in mm");
  }
  registration.middle_I = {middle[0], middle[1], middle[2]};
  if (registration.middle_I.norm() > kFarthest_mm) return wrong("key 'covariance_about_mm' is not three numbers in mm");
  return registration;
}

Expected<RegistrationFile> read_registration(const std::filesystem::path& file) {
  constexpr std::size_t kLargest = std::size_t{1024} * 1024;
  const auto text = read_text_file(file, kLargest, "registration");
  if (!text) return tl::unexpected(text.error());
  return parse_registration(*text, file.string());
}

}  // namespace perimap

#include "drivers/pose_file/pose_table.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <system_error>

#include "core/error/one_line.hpp"
#include "drivers/pose_file/number_table.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 30;
constexpr double kFarthest_mm = 5e4;  // from its origin that a tracker or a robot measures

bool is_finite(const std::vector<double>& row) {
  return std::all_of(row.begin(), row.end(), [](double v) { return std::isfinite(v); });
}

Expected<Pose> pose_of_quaternion(const std::vector<double>& row, double mm) {
  const Eigen::Quaterniond q(row[7], row[4], row[5], row[6]);
  if (std::abs(q.norm() - 1.0) > 0.02) {
    return fail(
        fmt::format("expected a quaternion qx,qy,qz,qw of norm 1 in columns 5 to 8, got one of norm {:.3f}", q.norm()));
  }
  return Pose{q.normalized().toRotationMatrix(), mm * Vector3d(row[1], row[2], row[3])};
}

Expected<Pose> pose_of_matrix(const std::vector<double>& row, double mm) {
  Pose X;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) X.R(static_cast<int>(i), static_cast<int>(j)) = row[1 + 4 * i + j];
    X.t[static_cast<int>(i)] = mm * row[4 + 4 * i];
  }
  const double error = (X.R * X.R.transpose() - Matrix3d::Identity()).norm();
  if (error > 0.05 || X.R.determinant() < 0.0) {
    return fail(
        fmt::format("expected a matrix whose first three columns are a rotation, got one off by {:.3f}", error));
  }
  X.R = Eigen::Quaterniond(X.R).normalized().toRotationMatrix();
  return X;
}

bool is_dropout(const std::vector<double>& row, bool quaternion) {
  if (!is_finite(row)) return true;
  return std::all_of(row.begin() + (quaternion ? 4 : 1), row.end(), [](double v) { return v == 0.0; });
}

// The first column in seconds.
Expected<std::vector<double>> times_of(const NumberTable& table, std::optional<TimeUnit> unit, std::string_view name) {
  std::vector<double> times;
  for (const std::vector<double>& row : table.rows) times.push_back(row[0]);
  if (const auto made = make_seconds(times, unit, name); !made) return tl::unexpected(made.error());
  return times;
}

Expected<std::string> read_table(const std::filesystem::path& file, std::string_view what) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kLargestFile) return fail(file.string() + ": is too large");
  return read_text_file(file, error ? 0 : static_cast<std::size_t>(size), what);
}

}  // namespace

Expected<PoseTable> parse_pose_table(std::string_view text, std::string_view name, LengthUnit unit,
                                     std::optional<TimeUnit> times) {
  const auto table = parse_number_table(text, name);
  if (!table) return tl::unexpected(table.error());
  const std::size_t columns = table->rows.front().size();
  if (columns != 8 && columns != 13 && columns != 17) {
    return fail(on_one_line(fmt::format(
        "{}:{}: expected 8 columns t_s,x,y,z,qx,qy,qz,qw (or a time and the 12 or 16 numbers of a matrix), got {}",
        name, table->lines.front(), columns)));
  }
  const auto t_s = times_of(*table, times, name);
  if (!t_s) return tl::unexpected(t_s.error());
  const double mm = unit == LengthUnit::kMetre ? 1000.0 : 1.0;
  PoseTable result;
  for (std::size_t i = 0; i < table->rows.size(); ++i) {
    const std::vector<double>& row = table->rows[i];
    if (is_dropout(row, columns == 8)) {
      ++result.dropouts;
      continue;
    }
    const auto pose = columns == 8 ? pose_of_quaternion(row, mm) : pose_of_matrix(row, mm);
    if (!pose) return fail(on_one_line(fmt::format("{}:{}: {}", name, table->lines[i], pose.error().message)));
    if (pose->t.norm() > kFarthest_mm) {
      return fail(
          on_one_line(fmt::format("{}:{}: a position {:.0f} m away{}", name, table->lines[i], 1e-3 * pose->t.norm(),
                                  unit == LengthUnit::kMetre ? ": are its lengths in mm? Then say --unit mm" : "")));
    }
    result.poses.push_back({(*t_s)[i], *pose});
  }
  if (result.poses.empty()) return fail(on_one_line(fmt::format("{}: there is no pose in it", name)));
  return result;
}

Expected<PoseTable> read_pose_table(const std::filesystem::path& file, LengthUnit unit, std::optional<TimeUnit> times) {
  const auto text = read_table(file, "table of poses");
  if (!text) return tl::unexpected(text.error());
  return parse_pose_table(*text, file.string(), unit, times);
}

Expected<SignalTable> parse_signal_table(std::string_view text, std::string_view name, std::optional<TimeUnit> times) {
  const auto table = parse_number_table(text, name);
  if (!table) return tl::unexpected(table.error());
  const std::size_t columns = table->rows.front().size();
  if (columns < 2) {
    return fail(
        on_one_line(fmt::format("{}:{}: expected two columns, time and value, got one", name, table->lines.front())));
  }
  const auto t_s = times_of(*table, times, name);
  if (!t_s) return tl::unexpected(t_s.error());
  SignalTable result;
  result.several_columns = columns > 2;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < table->rows.size(); ++i) {
    if (is_finite(table->rows[i])) rows.push_back(i);
  }
  result.dropouts = table->rows.size() - rows.size();
  if (rows.empty()) return fail(on_one_line(fmt::format("{}: there is no value in it", name)));
  const auto n = static_cast<Eigen::Index>(rows.size());
  const auto width = static_cast<Eigen::Index>(columns - 1);
  Eigen::MatrixXd values(n, width);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::vector<double>& row = table->rows[rows[static_cast<std::size_t>(i)]];
    values.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data() + 1, width);
  }
  Eigen::VectorXd along = values.col(0);
  if (width > 1) {
    values.rowwise() -= values.colwise().mean().eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(values.transpose() * values);
    along = values * eigen.eigenvectors().col(width - 1);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    result.values.push_back({(*t_s)[rows[static_cast<std::size_t>(i)]], along[i]});
  }
  const auto earlier = [](const TimedValue& a, const TimedValue& b) { return a.t_s < b.t_s; };
  const auto same = [](const TimedValue& a, const TimedValue& b) { return a.t_s == b.t_s; };
  std::stable_sort(result.values.begin(), result.values.end(), earlier);
  result.values.erase(std::unique(result.values.begin(), result.values.end(), same), result.values.end());
  return result;
}

Expected<SignalTable> read_signal_table(const std::filesystem::path& file, std::optional<TimeUnit> times) {
  const auto text = read_table(file, "table of a signal");
  if (!text) return tl::unexpected(text.error());
  return parse_signal_table(*text, file.string(), times);
}

}  // namespace perimap

// What the watch over the set-up makes of set-ups that are right and of ones that are wrong: the table of
// docs/evidence/setup-watch.md. `statistics_watched_setups SEEDS`; none of the seeds is one that the tests use.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/setup_watch/setup_fit.hpp"
#include "core/setup_watch/setup_verdict.hpp"
#include "watched_scene.hpp"

using namespace perimap;

namespace {

constexpr std::uint32_t kFirstSeed = 20000;

struct Row {
  std::string name;
  watched_scene::Scene scene;
  std::optional<SetupPart> wrong;  // what alone should be blamed
};

void judge(const Row& row, int seeds) {
  int doubted = 0, blamed_rightly = 0, undetermined = 0, unknown = 0;
  double nees = 0.0, surface_mm = 0.0, deviation_mm = 0.0, most_explained = 0.0;
  int solved = 0;
  for (int i = 0; i < seeds; ++i) {
    const WatchedWindow window = watched_scene::watch(row.scene, kFirstSeed + static_cast<std::uint32_t>(i));
    const SetupFit fit = fit_setup(window, watched_scene::camera(), watched_scene::layout(row.scene));
    const SetupVerdict verdict = judge_setup(fit);
    undetermined += verdict.state == SetupState::kUndetermined ? 1 : 0;
    unknown += verdict.state == SetupState::kUnknown ? 1 : 0;
    if (verdict.state == SetupState::kDoubted) {
      ++doubted;
      bool rightly = row.wrong.has_value();
      for (const SetupPart part : kSetupParts)
        rightly = rightly && verdict.blamed[index_of(part)] == (part == *row.wrong);
      blamed_rightly += rightly ? 1 : 0;
    }
    if (fit.state != SetupFitState::kSolved) continue;
    ++solved;
    const SetupVector error = fit.deviation - row.scene.deviation;
    nees += error.dot(fit.covariance.llt().solve(error)) / kSetupNumbers;
    surface_mm += verdict.surface_mm;
    deviation_mm += verdict.surface_deviation_mm;
    most_explained = std::max(most_explained, verdict.explained);
  }
  const double n = std::max(1, solved);
  fmt::print("| {} | {} | {} | {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.0f} |\n", row.name, doubted, blamed_rightly,
             undetermined, unknown, nees / n, surface_mm / n, deviation_mm / n, most_explained);
}

std::vector<Row> rows() {
  std::vector<Row> all;
  const auto right = [&](const std::string& name, auto change) {
    Row& row = all.emplace_back(Row{name, {}, {}});
    change(row.scene);
  };
  right("right, tracker 1.4 mm and 0.5 degrees", [](auto&) {});
  right("right, exact tracker", [](auto& s) { s.position_deviation_mm = 0.02, s.rotation_deviation_rad = 1e-4; });
  right("right, tracker's errors last 3 s, told", [](auto& s) { s.error_correlation_s = 3.0; });
  right("right, they last 3 s, not told", [](auto& s) { s.error_correlation_s = 3.0, s.correlation_told = false; });
  right("right, one match of 20 is 30 px off", [](auto& s) { s.outliers = 0.05; });
  right("right, the sway is a third", [](auto& s) { s.sway = 0.33; });
  right("right, the scope rests", [](auto& s) { s.sway = 0.0; });
  const auto wrong = [&](const std::string& name, SetupPart part, int number, double by) {
    Row& row = all.emplace_back(Row{name, {}, part});
    row.scene.deviation(number) = by;
  };
  for (const double degrees : {0.5, 1.0, 3.0, 5.0})
    wrong(fmt::format("hand-eye turned by {} degrees", degrees), SetupPart::kHandEyeTurn, kTurnAt, degrees * kDegree);
  wrong("hand-eye rolled by 5 degrees", SetupPart::kHandEyeTurn, kTurnAt + 2, 5.0 * kDegree);
  for (const double mm : {2.0, 5.0, 10.0})
    wrong(fmt::format("hand-eye {} mm across", mm), SetupPart::kHandEyeAcross, kMoveAt, mm);
  for (const double mm : {5.0, 10.0})
    wrong(fmt::format("hand-eye {} mm along", mm), SetupPart::kHandEyeAlong, kMoveAt + 2, mm);
  for (const double percent : {1.0, 3.0, 5.0, 20.0})
    wrong(fmt::format("focal length {} %", percent), SetupPart::kFocalLength, kFocalAt, 0.01 * percent);
  for (const double px : {5.0, 10.0, 20.0})
    wrong(fmt::format("principal point {} px", px), SetupPart::kPrincipalPoint, kPrincipalPointAt, px);
  for (const double ms : {10.0, 30.0})
    wrong(fmt::format("time offset {} ms", ms), SetupPart::kTimeOffset, kTimeAt, 1e-3 * ms);
  return all;
}

}  // namespace

int main(int count, char** arguments) {
  const int seeds = count > 1 ? std::atoi(arguments[1]) : 20;
  fmt::print(
      "| set-up, {} windows each | doubted | blames that alone | undetermined | unknown | NEES/10 | surface off, mm "
      "| its deviation, mm | chi-squared explained, most |\n|---|---|---|---|---|---|---|---|---|\n",
      seeds);
  for (const Row& row : rows()) judge(row, seeds);
}

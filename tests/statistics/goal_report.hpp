// What was to be reached beside what is: one line a goal, printed as it is known.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace perimap::test {

class GoalReport {
 public:
  GoalReport() {
    fmt::print("{:<66}{:>11}{:>11}{:>11}\n", "", "goal", "reached", "bound");
    std::fflush(stdout);
  }

  // `bound`: what no estimator can better on these data; NaN when it has no meaning here.
  void at_most(const std::string& what, double limit, double reached, double bound = NAN) {
    const bool good = reached <= limit;
    line(what, fmt::format("<= {:g}", limit), reached, bound, good ? "" : "  FAILED");
    failed_ += good ? 0 : 1;
  }
  // The plain goal; only where the bound itself is above it, `margin` times the bound.
  void at_most_unless_forbidden(const std::string& what, double goal, double reached, double bound, double margin) {
    const bool forbidden = bound > goal;
    const bool good = reached <= (forbidden ? margin * bound : goal);
    line(fmt::format("{} (goal {:g})", what, goal),
         forbidden ? fmt::format("<={:g} bound", margin) : fmt::format("<= {:g}", goal), reached, bound,
         good ? "" : "  FAILED");
    failed_ += good ? 0 : 1;
  }
  void at_least(const std::string& what, double limit, double reached) {
    const bool good = reached >= limit;
    line(what, fmt::format(">= {:g}", limit), reached, NAN, good ? "" : "  FAILED");
    failed_ += good ? 0 : 1;
  }
  void within(const std::string& what, double low, double high, double reached) {
    const bool good = reached >= low && reached <= high;
    line(what, fmt::format("{:g}..{:g}", low, high), reached, NAN, good ? "" : "  FAILED");
    failed_ += good ? 0 : 1;
  }
  // A goal that the bound forbids, or none at all: shown, not judged.
  void shown(const std::string& what, const std::string& goal, double reached, double bound = NAN) {
    line(what, goal, reached, bound, "");
  }

  // A table: a heading over its columns, then a row a case, whose values are all to be within the limits.
  static void heading(const std::string& what, const std::vector<std::string>& columns) {
    fmt::print("\n{:<50}", what);
    for (const std::string& column : columns) fmt::print("{:>9}", column);
    fmt::print("\n");
  }
  void row(const std::string& what, const std::vector<double>& values, double low, double high) {
    fmt::print("{:<50}", what);
    bool good = true;
    for (const double value : values) {
      fmt::print("{:>9.2f}", value);
      good = good && value >= low && value <= high;
    }
    fmt::print("{}\n", good ? "" : fmt::format("  FAILED: {:g}..{:g}", low, high));
    std::fflush(stdout);
    failed_ += good ? 0 : 1;
  }

  // Values that are not judged.
  static void line_of(const std::string& what, const std::vector<double>& values) {
    fmt::print("{:<50}", what);
    for (const double value : values) fmt::print("{:>9.3f}", value);
    fmt::print("\n");
    std::fflush(stdout);
  }

  [[nodiscard]] int failed() const noexcept { return failed_; }

 private:
  static std::string number(double value) { return std::isnan(value) ? "" : fmt::format("{:.4g}", value); }
  static void line(const std::string& what, const std::string& goal, double reached, double bound,
                   const char* verdict) {
    fmt::print("{:<66}{:>11}{:>11}{:>11}{}\n", what, goal, number(reached), number(bound), verdict);
    std::fflush(stdout);
  }
  int failed_ = 0;
};

}  // namespace perimap::test

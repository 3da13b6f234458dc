#include "daemon/pages/svg_plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace perimap {
namespace {

// Every element that is opened is closed, in order.
bool balanced(const std::string& svg) {
  std::vector<std::string> open;
  for (std::size_t i = svg.find('<'); i != std::string::npos; i = svg.find('<', i + 1)) {
    const std::size_t end = svg.find('>', i);
    if (end == std::string::npos) return false;
    if (svg[end - 1] == '/') continue;
    const bool closing = svg[i + 1] == '/';
    const std::size_t begin = i + (closing ? 2 : 1);
    const std::string name = svg.substr(begin, svg.find_first_of(" >", begin) - begin);
    if (!closing) {
      open.push_back(name);
    } else {
      if (open.empty() || open.back() != name) return false;
      open.pop_back();
    }
  }
  return open.empty();
}

Plot ramp() {
  Plot plot;
  plot.title = "a < b & c";
  plot.lines = {{{{0, 0}, {1, 2}, {2, 4}}, "red", 1.0, "ramp"}};
  return plot;
}

TEST(SvgPlot, IsWellFormedAndEscapesText) {
  const std::string svg = svg_document({ramp(), ramp()}, "title");
  EXPECT_TRUE(balanced(svg));
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  EXPECT_NE(svg.find(">ramp<"), std::string::npos);
}

TEST(SvgPlot, DrawsNothingForEmptyOrNonFiniteDataAndStaysWellFormed) {
  Plot plot;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  plot.lines = {{{}, "red", 1.0, ""}, {{{nan, 1.0}, {1.0, nan}}, "red", 1.0, ""}};
  const std::string svg = svg_document({plot}, "empty");
  EXPECT_TRUE(balanced(svg));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(SvgPlot, ALineIsInterruptedWhereAPointIsNotFinite) {
  Plot plot;
  plot.lines = {{{{0, 0}, {1, 1}, {2, std::numeric_limits<double>::quiet_NaN()}, {3, 1}, {4, 0}}, "red", 1.0, ""}};
  const std::string svg = plot_group(plot, 0, 0, 500, 400);
  const std::size_t end = svg.find("\" fill=\"none\" stroke=\"red\"");
  ASSERT_NE(end, std::string::npos);
  const std::string path = svg.substr(svg.rfind("d=\"", end) + 3, end - svg.rfind("d=\"", end) - 3);
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
  EXPECT_EQ(std::count(path.begin(), path.end(), 'L'), 2);
}

TEST(SvgPlot, ValuesThatDifferInTheirLastDigitsAloneEndWithoutTicks) {
  Plot plot;
  plot.lines = {{{{1e15, 1e15}, {1e15 + 0.25, 1e15 + 0.125}}, "red", 1.0, ""}};
  EXPECT_TRUE(balanced(svg_document({plot}, "huge")));
}

TEST(SvgPlot, ASinglePointHasFiniteAxes) {
  Plot plot;
  plot.equal_aspect = true;
  plot.lines = {{{{3.0, 5.0}}, "red", 1.0, ""}};
  const std::string svg = svg_document({plot}, "point");
  EXPECT_TRUE(balanced(svg));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace perimap

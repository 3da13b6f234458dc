#include "daemon/evaluation/session/session_strip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/pages/html_page.hpp"

namespace perimap {
namespace {

constexpr double kLabelWidth = 150.0;
constexpr double kStripWidth = 930.0;
constexpr double kWidth = kLabelWidth + kStripWidth + 30.0;
constexpr double kRow = 30.0;
constexpr double kBar = 20.0;
constexpr double kLeastBar = 1.2;  // so that what lasted for one sample alone is seen, too
constexpr double kLegend = 26.0;
constexpr double kAxis = 40.0;

// Told apart without colours too: what is not well is hatched, more densely the worse it is.
std::string_view fill_of(Tone tone) {
  switch (tone) {
    case Tone::kWell:
      return "#1b9e77";
    case Tone::kDoubtful:
      return "url(#doubtful)";
    case Tone::kBad:
      return "url(#bad)";
    case Tone::kNeutral:
      break;
  }
  return "#9db4c4";
}

constexpr std::string_view kPatterns =
    "<defs><pattern id=\"doubtful\" width=\"9\" height=\"9\" patternUnits=\"userSpaceOnUse\" "
    "patternTransform=\"rotate(45)\"><rect width=\"9\" height=\"9\" fill=\"#f2b632\"/>"
    "<rect width=\"2\" height=\"9\" fill=\"#7a5600\"/></pattern>"
    "<pattern id=\"bad\" width=\"5\" height=\"5\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(-45)\">"
    "<rect width=\"5\" height=\"5\" fill=\"#fff\"/><rect width=\"2.6\" height=\"5\" "
    "fill=\"#a00020\"/></pattern></defs>\n";

// Such that at most twelve fit.
double tick_of(double length_s) {
  for (const double step : {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0}) {
    if (length_s <= 12.0 * step) return step;
  }
  return 3600.0 * std::ceil(length_s / 12.0 / 3600.0);
}

std::string text(double x, double y, std::string_view anchor, const std::string& words) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor, escaped(words));
}

// Worse, the larger.
int badness(Tone tone) {
  switch (tone) {
    case Tone::kNeutral:
      return 0;
    case Tone::kWell:
      return 1;
    case Tone::kDoubtful:
      return 2;
    case Tone::kBad:
      break;
  }
  return 3;
}

template <class Px>
std::string bars_of(const std::vector<SessionSpan>& spans, const Px& px, double y) {
  std::string out;
  for (std::size_t begin = 0; begin < spans.size();) {
    std::size_t end = begin + 1;
    Tone tone = spans[begin].tone;
    while (end < spans.size() && px(spans[end].end_s) - px(spans[begin].begin_s) < kLeastBar) {
      if (badness(spans[end].tone) > badness(tone)) tone = spans[end].tone;
      ++end;
    }
    const double from_s = spans[begin].begin_s, to_s = spans[end - 1].end_s;
    const std::string what = end - begin > 1 ? fmt::format("{} changes", end - begin) : spans[begin].what;
    out += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\"><title>{}: {:.2f} s to {:.2f} "
        "s</title></rect>\n",
        px(from_s), y, std::max(px(to_s) - px(from_s), kLeastBar), kBar, fill_of(tone), escaped(what), from_s, to_s);
    begin = end;
  }
  return out;
}

std::string legend(double y) {
  std::string out;
  double x = kLabelWidth;
  const auto entry = [&](Tone tone, const char* words, double room) {
    out += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"26\" height=\"13\" fill=\"{}\" stroke=\"#333\" "
        "stroke-width=\".5\"/>\n",
        x, y - 11, fill_of(tone));
    out += text(x + 33, y, "start", words);
    x += room;
  };
  entry(Tone::kWell, "good", 110);
  entry(Tone::kDoubtful, "use with care", 150);
  entry(Tone::kBad, "not to be used, or not there", 230);
  entry(Tone::kNeutral, "neither good nor bad", 205);
  return out + text(x, y, "start", "blank: nothing is known");
}

}  // namespace

void SessionStrip::end(double at_s) {
  if (!spans_.empty()) spans_.back().end_s = std::max(spans_.back().begin_s, std::min(at_s, until_s_));
}

void SessionStrip::say(double at_s, std::string_view what, Tone tone, double holds_s) {
  if (!std::isfinite(at_s) || (!spans_.empty() && at_s < last_s_)) return;
  constexpr double kRounding_s = 1e-6;
  const bool held = !spans_.empty() && at_s <= until_s_ + kRounding_s;
  end(at_s);
  if (!held || spans_.back().what != what) spans_.push_back({at_s, at_s, std::string(what), tone});
  last_s_ = at_s;
  until_s_ = at_s + std::max(holds_s, 0.0);
}

SessionStrip SessionStrip::from(double begin_s) const {
  SessionStrip moved(name_);
  for (const SessionSpan& span : spans_) {
    if (span.end_s < begin_s) continue;
    moved.spans_.push_back({std::max(span.begin_s - begin_s, 0.0), span.end_s - begin_s, span.what, span.tone});
  }
  return moved;
}

std::string strips_svg(const std::vector<SessionStrip>& strips, double length_s) {
  const auto drawn =
      std::count_if(strips.begin(), strips.end(), [](const auto& strip) { return !strip.spans().empty(); });
  if (drawn == 0 || !(length_s > 0.0)) return {};
  const double bottom = kLegend + kRow * static_cast<double>(drawn);
  const auto px = [length_s](double at_s) { return kLabelWidth + std::clamp(at_s / length_s, 0.0, 1.0) * kStripWidth; };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" font-size=\"13\">\n{2}",
      kWidth, bottom + kAxis, kPatterns);
  out += legend(16);
  const double tick = tick_of(length_s);
  for (int k = 0; k * tick <= length_s; ++k) {
    out += fmt::format("<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"#ddd\"/>\n", px(k * tick), kLegend, bottom + 4);
    out += text(px(k * tick), bottom + 18, "middle", fmt::format("{:g}", k * tick));
  }
  out += text(kLabelWidth + kStripWidth / 2, bottom + 35, "middle", "seconds from the first surface");
  double y = kLegend;
  for (const SessionStrip& strip : strips) {
    if (strip.spans().empty()) continue;
    out += text(kLabelWidth - 8, y + 19, "end", strip.name());
    out += bars_of(strip.spans(), px, y + 5);
    y += kRow;
  }
  return out + "</svg>\n";
}

}  // namespace perimap

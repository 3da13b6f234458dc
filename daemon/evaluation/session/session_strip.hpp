// What something was over a session, as spans of time side by side.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace perimap {

// How a span is drawn: the words tell what it was.
enum class Tone { kWell, kDoubtful, kBad, kNeutral };

struct SessionSpan {
  double begin_s = 0.0;  // from the session's begin
  double end_s = 0.0;
  std::string what;
  Tone tone = Tone::kNeutral;

  [[nodiscard]] double length_s() const noexcept { return end_s - begin_s; }
};

class SessionStrip {
 public:
  // `pause`: what was said holds for so long, unless something else is said; after that nothing is known.
  SessionStrip(std::string name, double pause_s) : name_(std::move(name)), pause_s_(pause_s) {}

  // In the order of time.
  void say(double at_s, std::string_view what, Tone tone);

  // What was said last still holds.
  void prolong(double until_s);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const std::vector<SessionSpan>& spans() const noexcept { return spans_; }

 private:
  std::string name_;
  double pause_s_;
  std::vector<SessionSpan> spans_;
};

// Strips below each other over one axis from 0 to `length_s`, as SVG: a colour and a hatch for each tone, and the words
// of a span where a pointer rests on it. Empty where no strip has a span.
[[nodiscard]] std::string strips_svg(const std::vector<SessionStrip>& strips, double length_s);

}  // namespace perimap

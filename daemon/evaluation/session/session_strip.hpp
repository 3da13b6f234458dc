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
  explicit SessionStrip(std::string name) : name_(std::move(name)) {}

  // In the order of time; what comes out of order is left out. It holds for so long, unless something else is said:
  // after that nothing is known.
  void say(double at_s, std::string_view what, Tone tone, double holds_s);
  // Nothing is told beyond this.
  void end(double at_s);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Of the last one the end is known once end() was called.
  [[nodiscard]] const std::vector<SessionSpan>& spans() const noexcept { return spans_; }

  // The same with its time counted from `begin_s`; what ended before is left out.
  [[nodiscard]] SessionStrip from(double begin_s) const;

 private:
  std::string name_;
  std::vector<SessionSpan> spans_;
  double last_s_ = 0.0;   // when something was said last
  double until_s_ = 0.0;  // so long it holds
};

// Strips below each other over one axis from 0 to `length_s`, as SVG: a colour and a hatch for each tone, and the words
// of a span where a pointer rests on it. What is narrower than a pixel is drawn together, as bad as the worst of it.
// Empty where no strip has a span.
[[nodiscard]] std::string strips_svg(const std::vector<SessionStrip>& strips, double length_s);

}  // namespace perimap

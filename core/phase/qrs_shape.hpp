// The shape of a QRS complex, and running templates of the shapes that a patient's beats have.
//
// A shape is the band-limited slope of the ECG around the R peak: slope rather than voltage, because baseline wander
// all but vanishes in it. Shapes compare by correlation, which knows neither gain nor offset.
#pragma once

#include <array>
#include <cstdint>

namespace perimap {

struct QrsShape {
  static constexpr int kCapacity = 44;
  std::array<float, kCapacity> slope{};  // evenly spaced, about 5 ms apart, from 90 ms before the R peak to 50 ms after
  int points = 0;                        // the same for all beats of a signal; 0: unknown
};

struct ShapeMatch {
  double correlation = 0.0;  // -1 to 1
  double gain = 0.0;         // the shape is so many times the other one
};

[[nodiscard]] ShapeMatch match(const QrsShape& shape, const QrsShape& reference) noexcept;

// The best match over small displacements against each other: the R peaks of wide complexes are not found alike.
[[nodiscard]] ShapeMatch best_match(const QrsShape& shape, const QrsShape& reference, int most_displaced) noexcept;

// A few shapes that recur, the rarest giving way to new ones.
class ShapeTemplates {
 public:
  static constexpr int kTemplates = 5;
  static constexpr double kSame = 0.85;     // correlation from which on a beat is of a template's kind
  static constexpr double kTrusted = 2.5;   // beats, older ones fading, from which on a template is to be believed

  struct Template {
    QrsShape shape;
    double weight = 0.0;  // beats, older ones fading; 0: free
    double amplitude = 0.0;  // root mean square of the shape
    bool upward = true;      // which way its R peak points

    [[nodiscard]] bool trusted() const noexcept { return weight >= kTrusted; }
  };

  void clear() noexcept;
  // A beat of this shape was found. Gives the template that it now belongs to.
  int learn(const QrsShape& shape, bool upward) noexcept;
  // The gain of the signal has changed.
  void scale(double factor) noexcept;

  [[nodiscard]] const Template& operator[](int i) const noexcept { return templates_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool any_trusted() const noexcept;
  // To be believed, and not far smaller than another that is: that would be a P or T wave.
  [[nodiscard]] bool usable(int i) const noexcept;
  // A good part of the beats are of it.
  [[nodiscard]] bool established(int i) const noexcept;
  [[nodiscard]] int heaviest() const noexcept;  // -1 when there is none

 private:
  std::array<Template, kTemplates> templates_{};
};

}  // namespace perimap

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
  int displaced = 0;         // the shape is so many points later
};

[[nodiscard]] ShapeMatch match(const QrsShape& shape, const QrsShape& reference) noexcept;

// Of the slope's points; 0 without any.
[[nodiscard]] double root_mean_square(const QrsShape& shape) noexcept;

// The best match over small displacements against each other: the R peaks of wide complexes are not found alike.
[[nodiscard]] ShapeMatch best_match(const QrsShape& shape, const QrsShape& reference, int most_displaced) noexcept;

// A few shapes that recur, the rarest giving way to new ones.
class ShapeTemplates {
 public:
  static constexpr int kTemplates = 5;

  // Whether a template has recurred and is to be believed.
  [[nodiscard]] bool usable(int i) const noexcept { return of(i).weight >= kTrusted; }
  [[nodiscard]] int heaviest() const noexcept;  // -1 when there is none

  // Correlation with template i, at best.
  [[nodiscard]] double likeness_to(int i, const QrsShape& shape, int most_displaced) const noexcept {
    return best_match(shape, of(i).shape, most_displaced).correlation;
  }

  // The template that a shape is of, -1 for none.
  [[nodiscard]] int kind_of(const QrsShape& shape) const noexcept;
  // A beat of this shape was found. Gives the template that it now belongs to, -1 for a shape of no points.
  int learn(const QrsShape& shape) noexcept;

 private:
  static constexpr double kTrusted = 3.5;

  struct Template {
    QrsShape shape;       // root mean square 1
    double weight = 0.0;  // beats, older ones fading; 0: free
  };

  [[nodiscard]] const Template& of(int i) const noexcept { return templates_[static_cast<std::size_t>(i)]; }

  std::array<Template, kTemplates> templates_{};
};

}  // namespace perimap

#include "drivers/standins/procedure/procedure_draw.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kStream = 0x70726f63;

class Drawing {
 public:
  explicit Drawing(const ProcedureDrawing& drawing)
      : drawing_(drawing), noise_(drawing.seed, kStream), scope_deg_(drawing.held_deg) {}

  Procedure procedure() {
    constexpr double kFirst_s = 40.0, kLast_s = 20.0;
    Procedure procedure;
    double at_s = kFirst_s + uniform(0.0, 10.0);
    for (;;) {
      ProcedureEvent event = next();
      event.at = from_seconds(rounded(at_s));
      if (to_seconds(event.end()) > to_seconds(drawing_.duration) - kLast_s) return procedure;
      at_s = to_seconds(event.end()) + uniform(20.0, 45.0);
      procedure.events.push_back(std::move(event));
    }
  }

 private:
  using Make = ProcedureEvent (Drawing::*)();

  double uniform(double low, double high) { return noise_.uniform(index_++, low, high); }
  // A hundredth: what a person can read.
  static double rounded(double value) { return std::round(100.0 * value) / 100.0; }
  double between(double low, double high) { return rounded(uniform(low, high)); }
  // Of either sign.
  double about(double low, double high) {
    const double value = between(low, high);
    return uniform(0.0, 1.0) < 0.5 ? -value : value;
  }

  // What is drawn of `what` is drawn before its length.
  ProcedureEvent lasting(double least_s, double most_s, Happening what) {
    return {Duration(0), from_seconds(between(least_s, most_s)), std::move(what)};
  }

  // The next kind of a shuffled deck (Fisher & Yates).
  ProcedureEvent next() {
    if (deck_.empty()) {
      deck_ = {&Drawing::retraction, &Drawing::tilt,      &Drawing::insufflation, &Drawing::dent,
               &Drawing::touch,      &Drawing::withdrawn, &Drawing::wiped,        &Drawing::fogged,
               &Drawing::blood,      &Drawing::smoke,     &Drawing::instrument,   &Drawing::arcs,
               &Drawing::hidden,     &Drawing::ectopic,   &Drawing::leads,        &Drawing::delay};
      if (drawing_.electromagnetic) deck_.push_back(&Drawing::metal);
      if (drawing_.turns_scope) deck_.push_back(&Drawing::turn);
      for (std::size_t i = deck_.size(); i > 1; --i) {
        std::swap(deck_[i - 1], deck_[static_cast<std::size_t>(uniform(0.0, 1.0) * static_cast<double>(i))]);
      }
    }
    const Make make = deck_.back();
    deck_.pop_back();
    return (this->*make)();
  }

  ProcedureEvent retraction() {
    Retraction to;
    retracted_ = !retracted_;
    if (retracted_) {
      const double angle = uniform(0.0, kTwoPi), far_mm = uniform(4.0, 12.0);
      to.shift_mm = {rounded(far_mm * std::cos(angle)), rounded(far_mm * std::sin(angle)), between(-4.0, 4.0)};
      to.turn_deg = between(-5.0, 5.0);
    }
    return lasting(1.0, 15.0, to);
  }
  ProcedureEvent tilt() {
    TableTilt to;
    tilted_ = !tilted_;
    if (tilted_) to = {about(2.0, 6.0), about(0.0, 4.0)};
    return lasting(6.0, 15.0, to);
  }
  ProcedureEvent insufflation() {
    Insufflation to;
    risen_ = !risen_;
    if (risen_) to = {about(4.0, 10.0), between(-3.0, 3.0)};
    return lasting(5.0, 20.0, to);
  }
  ProcedureEvent dent() {
    Dent dent;
    place(dent);
    return lasting(2.0, 10.0, dent);
  }
  ProcedureEvent touch() {
    Touch touch;
    place(touch);
    return lasting(2.0, 6.0, touch);
  }
  void place(Dent& dent) {
    dent.place_mm = {between(-25.0, 25.0), between(-20.0, 20.0)};
    dent.depth_mm = between(3.0, 8.0);
    dent.radius_mm = between(8.0, 18.0);
  }
  // Many short ones, a few long: evenly on a scale of logarithms.
  ProcedureEvent withdrawn() {
    const double length_s = rounded(5.0 * std::pow(24.0, uniform(0.0, 1.0)));
    return {Duration(0), from_seconds(length_s), Withdrawn{}};
  }
  ProcedureEvent wiped() { return lasting(1.5, 4.0, Wiped{}); }
  ProcedureEvent fogged() { return lasting(5.0, 20.0, Fogged{between(0.5, 3.0)}); }
  ProcedureEvent blood() { return lasting(5.0, 20.0, Blood{between(0.1, 0.8)}); }
  ProcedureEvent smoke() { return lasting(4.0, 15.0, Smoke{between(0.5, 2.5)}); }
  ProcedureEvent instrument() { return lasting(3.0, 15.0, InstrumentSeen{}); }
  ProcedureEvent arcs() {
    Electrosurgery arcs;
    arcs.ecg_mV = between(1.0, 8.0);
    arcs.picture_levels = between(0.0, 60.0);
    arcs.smoke_density = between(0.0, 1.0);
    if (drawing_.electromagnetic) arcs.tracker_mm = between(1.0, 5.0);
    return lasting(1.5, 5.0, arcs);
  }
  ProcedureEvent metal() {
    return lasting(4.0, 20.0, Metal{{about(2.0, 8.0), about(0.0, 6.0), about(0.0, 6.0)}, about(0.0, 4.0)});
  }
  ProcedureEvent hidden() { return lasting(0.5, 10.0, ToolHidden{}); }
  ProcedureEvent ectopic() { return lasting(3.0, 10.0, EctopicRun{}); }
  ProcedureEvent leads() { return lasting(3.0, 15.0, LeadsOff{}); }
  ProcedureEvent delay() {
    delayed_ = !delayed_;
    const double to_ms = delayed_ ? about(10.0, 40.0) : 0.0;
    const bool camera = delayed_ ? uniform(0.0, 1.0) < 0.5 : camera_delayed_;
    camera_delayed_ = camera;
    return lasting(1.0, 20.0, camera ? Happening(CameraDelay{to_ms}) : Happening(TrackerDelay{to_ms}));
  }
  ProcedureEvent turn() {
    scope_deg_ = rounded(scope_deg_ + about(10.0, 60.0));
    if (std::abs(scope_deg_ - drawing_.held_deg) > 100.0) scope_deg_ = drawing_.held_deg;
    return lasting(0.7, 3.0, ScopeTurnedInHead{scope_deg_, 1.0});
  }

  const ProcedureDrawing& drawing_;
  CounterNoise noise_;
  std::uint64_t index_ = 0;
  std::vector<Make> deck_;
  bool retracted_ = false, tilted_ = false, risen_ = false, delayed_ = false, camera_delayed_ = false;
  double scope_deg_;
};

}  // namespace

Procedure draw_procedure(const ProcedureDrawing& drawing) { return Drawing(drawing).procedure(); }

}  // namespace perimap

// Tells an input that is stuck at the end of its converter's range, as an open electrode leaves it.
#pragma once

namespace perimap {

// Off after some time at a rail, on again after 500 ms away from it: the amplifier needs some of that to settle.
class RailWatch {
 public:
  // No part of a heartbeat is cut off for so long.
  static constexpr double kLeadOff_s = 0.1;
  // A belt that is too tight cuts the top off every breath, and its onset can still be told.
  static constexpr double kSensorOff_s = 5.0;

  RailWatch(double sample_rate_hz, double off_after_s) noexcept
      : off_after_(static_cast<int>(off_after_s * sample_rate_hz)), on_after_(static_cast<int>(0.5 * sample_rate_hz)) {}

  void restart() noexcept {
    run_ = 0;
    off_ = false;
  }

  // The next sample; true while the input is off.
  bool off(bool at_rail) noexcept {
    run_ = at_rail == off_ ? 0 : run_ + 1;
    if (run_ >= (off_ ? on_after_ : off_after_)) {
      off_ = !off_;
      run_ = 0;
    }
    return off_;
  }

 private:
  int off_after_;
  int on_after_;
  int run_ = 0;  // samples in a row that speak against the present state
  bool off_ = false;
};

}  // namespace perimap

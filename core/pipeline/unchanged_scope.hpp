// Whether a scope whose turns nobody calibrated is turned and zoomed as when it was first seen.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/calibration/field_stop.hpp"

namespace perimap {

// Where the pictures show a field stop with its notch at all: three whole readings in a row that agree are how it was
// at first, and two in a row that agree with each other and not with that say that it has been turned or zoomed. One
// reading alone says nothing, and pictures without a notch do not either.
class UnchangedScope {
 public:
  void read(const FieldStopReading& reading) noexcept;
  void fail() noexcept { last_.reset(); }

  // While it is another than at first; false where nothing was read yet.
  [[nodiscard]] bool changed() const noexcept { return changed_; }
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }
  [[nodiscard]] bool is_read() const noexcept { return last_.has_value(); }
  [[nodiscard]] double rotation_rad() const noexcept { return last_ ? last_->notch_rad : 0.0; }

 private:
  std::optional<FieldStopReading> first_;
  std::optional<FieldStopReading> last_;
  int alike_ = 0;  // readings in a row that agree with the one before
  bool changed_ = false;
  std::uint64_t changes_ = 0;
};

}  // namespace perimap

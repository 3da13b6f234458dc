#include "drivers/tracker/ndi_tracking.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "drivers/device/byte_cursor.hpp"

namespace perimap {
namespace {

using Cursor = ByteCursor<std::endian::little>;

// Port status, all commands.
constexpr std::uint32_t kPortOutOfVolume = 0x40;

constexpr double kLargestError_mm = 1000.0;
constexpr double kNoFigure = -1e27;

// BX
constexpr unsigned kValid = 1;
constexpr unsigned kMissing = 2;
constexpr unsigned kDisabled = 4;

// BX2
constexpr unsigned kFrames = 1;
constexpr unsigned kData6D = 2;
constexpr std::size_t kComponentHeader = 12;
constexpr int kDeepestNesting = 4;
constexpr unsigned kToolMissing = 0x100;
constexpr unsigned kCodeMask = 0xFF;
constexpr unsigned kCodeEnabled = 0x00;
constexpr unsigned kCodePartlyOutOfVolume = 0x03;
constexpr unsigned kCodeOutOfVolume = 0x09;
constexpr unsigned kCodeTrackingNotEnabled = 0x20;
constexpr unsigned kCodeUnplugged = 0x21;

tl::unexpected<Error> truncated(const char* command) { return fail(fmt::format("{} reply: ends too early", command)); }

struct Transform {
  double wxyz[4];
  Vector3d t;
  double error_mm = 0;  // RMS of the fit; of an electromagnetic tracker its indicator value
};

Transform read_transform(Cursor& cursor) noexcept {
  Transform transform{};
  for (double& component : transform.wxyz) component = cursor.float32();
  for (int axis = 0; axis < 3; ++axis) transform.t[axis] = cursor.float32();
  transform.error_mm = cursor.float32();
  return transform;
}

// A valid transform as a reading; an error when it is none.
Expected<ToolReading> valid_reading(const Transform& transform, bool out_of_volume) {
  if (out_of_volume) return ToolReading{ToolState::kOutOfVolume, {}};
  const auto pose = pose_of_device(transform.t, transform.wxyz);
  if (!pose) return fail("reply: a transform marked valid is no pose");
  // Written so that a value that is not a number fails. A device that calls a pose good and its error absurd is not
  // believed; the guide's value for "no figure" is -3.7e28.
  const bool none = transform.error_mm == 0.0 || transform.error_mm < kNoFigure;
  const bool told = transform.error_mm > 0.0 && transform.error_mm <= kLargestError_mm;
  if (!none && !told) return ToolReading{};
  return ToolReading{ToolState::kOk, *pose, told ? transform.error_mm : 0.0};
}

ToolState state_of_code(unsigned status) noexcept {
  const unsigned code = status & kCodeMask;
  if (code == kCodeTrackingNotEnabled || code == kCodeUnplugged) return ToolState::kDisabled;
  if (code == kCodeOutOfVolume) return ToolState::kOutOfVolume;
  if ((status & kToolMissing) != 0) return ToolState::kMissing;
  return code == kCodeEnabled || code == kCodePartlyOutOfVolume ? ToolState::kOk : ToolState::kMissing;
}

Expected<void> decode_6d(Cursor& cursor, std::uint32_t items, std::uint32_t frame, NdiTracking& tracking) {
  for (std::uint32_t i = 0; i < items; ++i) {
    NdiToolReading tool;
    tool.handle = cursor.number<std::uint16_t>();
    const unsigned status = cursor.number<std::uint16_t>();
    const bool has_transform = (status & kToolMissing) == 0;
    const Transform transform = has_transform ? read_transform(cursor) : Transform{};
    if (!cursor.good()) return truncated("BX2");
    tool.frame = frame;
    const ToolState state = state_of_code(status);
    if (state == ToolState::kOk) {
      auto reading = valid_reading(transform, false);
      if (!reading) return tl::unexpected(std::move(reading.error()));
      tool.reading = *reading;
    } else {
      tool.reading.state = state;
    }
    tracking.tools.push_back(tool);
  }
  return {};
}

Expected<void> decode_container(Cursor& cursor, std::optional<std::uint32_t> frame, int depth, NdiTracking& tracking) {
  if (depth > kDeepestNesting) return fail("BX2 reply: components nested too deeply");
  (void)cursor.number<std::uint16_t>();  // version
  const auto components = cursor.number<std::uint16_t>();
  for (unsigned i = 0; i < components; ++i) {
    const unsigned type = cursor.number<std::uint16_t>();
    const std::size_t size = cursor.number<std::uint32_t>();
    (void)cursor.number<std::uint16_t>();  // option
    const auto items = cursor.number<std::uint32_t>();
    if (!cursor.good()) return truncated("BX2");
    if (size < kComponentHeader) return fail("BX2 reply: a component shorter than its header");
    if (size - kComponentHeader > cursor.left()) return truncated("BX2");
    Cursor inside(cursor.read_bytes(size - kComponentHeader));
    if (type == kFrames) {
      for (std::uint32_t item = 0; item < items && inside.good(); ++item) {
        (void)inside.number<std::uint8_t>();   // type
        (void)inside.number<std::uint8_t>();   // sequence
        (void)inside.number<std::uint16_t>();  // status
        const auto number = inside.number<std::uint32_t>();
        (void)inside.number<std::uint32_t>();  // device time, s
        (void)inside.number<std::uint32_t>();  // device time, ns
        if (auto nested = decode_container(inside, number, depth + 1, tracking); !nested) return nested;
      }
    } else if (type == kData6D) {
      if (!frame) return fail("BX2 reply: 6D data outside a frame");
      if (auto decoded = decode_6d(inside, items, *frame, tracking); !decoded) return decoded;
    } else {
      continue;  // markers, buttons, alerts
    }
    if (!inside.good()) return truncated("BX2");
    if (inside.left() != 0) return fail("BX2 reply: a component is longer than its items");
  }
  if (!cursor.good()) return truncated("BX2");
  return {};
}

// Fixed-width fields of a text reply.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text) noexcept : text_(text) {}

  [[nodiscard]] bool good() const noexcept { return good_; }
  [[nodiscard]] std::size_t left() const noexcept { return text_.size(); }

  bool skip(std::string_view word) noexcept {
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  std::uint32_t hex(std::size_t width) noexcept { return number<std::uint32_t>(width, 16); }
  // A sign and digits.
  double decimal(std::size_t width, double unit) noexcept {
    const bool negative = skip("-");
    if (!negative && !skip("+")) good_ = false;
    const double value = number<std::uint32_t>(width - 1, 10) * unit;
    return negative ? -value : value;
  }

 private:
  template <class T>
  T number(std::size_t width, int base) noexcept {
    T value = 0;
    if (text_.size() < width) {
      good_ = false;
      return value;
    }
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + width, value, base);
    good_ = good_ && error == std::errc{} && end == text_.data() + width;
    text_.remove_prefix(width);
    return value;
  }

  std::string_view text_;
  bool good_ = true;
};

}  // namespace

Expected<NdiTracking> decode_bx(std::span<const std::byte> body) {
  Cursor cursor(body);
  NdiTracking tracking;
  const auto count = cursor.number<std::uint8_t>();
  for (unsigned i = 0; i < count; ++i) {
    NdiToolReading tool;
    tool.handle = cursor.number<std::uint8_t>();
    const unsigned status = cursor.number<std::uint8_t>();
    if (!cursor.good()) return truncated("BX");
    if (status == kDisabled) {
      tool.reading.state = ToolState::kDisabled;
    } else if (status == kValid || status == kMissing) {
      const Transform transform = status == kValid ? read_transform(cursor) : Transform{};
      const auto port = cursor.number<std::uint32_t>();
      tool.frame = cursor.number<std::uint32_t>();
      if (!cursor.good()) return truncated("BX");
      const bool out_of_volume = (port & kPortOutOfVolume) != 0;
      if (status == kValid) {
        auto reading = valid_reading(transform, out_of_volume);
        if (!reading) return tl::unexpected(std::move(reading.error()));
        tool.reading = *reading;
      } else {
        tool.reading.state = out_of_volume ? ToolState::kOutOfVolume : ToolState::kMissing;
      }
    } else {
      return fail(fmt::format("BX reply: handle {:02X}: unknown status {}", tool.handle, status));
    }
    tracking.tools.push_back(tool);
  }
  tracking.system_status = cursor.number<std::uint16_t>();
  if (!cursor.good()) return truncated("BX");
  if (cursor.left() != 0) return fail(fmt::format("BX reply: {} bytes too many", cursor.left()));
  return tracking;
}

Expected<NdiTracking> decode_bx2(std::span<const std::byte> body) {
  Cursor cursor(body);
  NdiTracking tracking;
  if (auto decoded = decode_container(cursor, std::nullopt, 0, tracking); !decoded) {
    return tl::unexpected(std::move(decoded.error()));
  }
  if (cursor.left() != 0) return fail(fmt::format("BX2 reply: {} bytes too many", cursor.left()));
  return tracking;
}

Expected<NdiTracking> decode_tx(std::string_view text) {
  TextCursor cursor(text);
  NdiTracking tracking;
  const std::uint32_t count = cursor.hex(2);
  for (std::uint32_t i = 0; i < count && cursor.good(); ++i) {
    NdiToolReading tool;
    tool.handle = static_cast<std::uint16_t>(cursor.hex(2));
    std::optional<Transform> transform;
    if (cursor.skip("DISABLED") || cursor.skip("UNOCCUPIED")) {
      tool.reading.state = ToolState::kDisabled;
    } else if (!cursor.skip("MISSING")) {
      transform.emplace();
      for (double& component : transform->wxyz) component = cursor.decimal(6, 1e-4);
      for (int axis = 0; axis < 3; ++axis) transform->t[axis] = cursor.decimal(7, 1e-2);
      transform->error_mm = cursor.decimal(6, 1e-4);
    }
    if (tool.reading.state == ToolState::kDisabled && cursor.skip("\n")) {
      tracking.tools.push_back(tool);
      continue;
    }
    const std::uint32_t port = cursor.hex(8);
    tool.frame = cursor.hex(8);
    if (!cursor.skip("\n") || !cursor.good()) return fail(fmt::format("TX reply: handle {}: malformed", i + 1));
    const bool out_of_volume = (port & kPortOutOfVolume) != 0;
    if (transform) {
      auto reading = valid_reading(*transform, out_of_volume);
      if (!reading) return tl::unexpected(std::move(reading.error()));
      tool.reading = *reading;
    } else if (tool.reading.state == ToolState::kMissing && out_of_volume) {
      tool.reading.state = ToolState::kOutOfVolume;
    }
    tracking.tools.push_back(tool);
  }
  tracking.system_status = static_cast<std::uint16_t>(cursor.hex(4));
  if (!cursor.good() || cursor.left() != 0) return fail("TX reply: malformed end");
  return tracking;
}

}  // namespace perimap

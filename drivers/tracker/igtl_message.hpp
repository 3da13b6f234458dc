// OpenIGTLink messages: "OpenIGTLink Protocol", versions 1 to 3 (openigtlink.org; header versions 1 and 2).
//
//   header, 58 bytes, big-endian: version u16, type char[12], device char[20], time stamp u64 (32.32 fixed point, s),
//   body size u64, CRC-64 of the body (ECMA-182 polynomial 0x42F0E1EBA9EA3693, initial 0, not reflected)
//
// A body of header version 2 is: extended header (its size u16, metadata header size u16, metadata size u32, message id
// u32), content, metadata.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/tracker/tool_reading.hpp"

namespace perimap {

[[nodiscard]] std::uint64_t igtl_crc(std::span<const std::byte> bytes) noexcept;

struct IgtlMessage {
  unsigned version = 1;
  std::string type;
  std::string device;
  std::uint64_t time_stamp = 0;  // 32.32 fixed point, s, on the sender's clock; 0: none
  std::vector<std::byte> content;
  std::vector<std::pair<std::string, std::string>> metadata;  // version 2

  // The stamp in ns, to the precision it has.
  [[nodiscard]] std::int64_t time_ns() const noexcept;
};

struct IgtlDamaged {
  std::string what;
  bool lost_track = false;  // where the next message begins cannot be told
};

// Takes bytes in any chunks. Messages of types that carry no pose are passed over by their size, images too.
class IgtlFramer {
 public:
  void restart() noexcept;
  void feed(std::span<const std::byte> bytes);
  // The next whole message; none when more bytes must come.
  [[nodiscard]] std::optional<std::variant<IgtlMessage, IgtlDamaged>> next();
  // How many messages have been, or are being, passed over.
  [[nodiscard]] std::uint64_t passed_over() const noexcept { return passed_over_; }

 private:
  std::vector<std::byte> pending_;
  std::uint64_t passed_over_ = 0;
  std::uint64_t skip_ = 0;  // bytes of a message that is passed over
};

[[nodiscard]] std::vector<std::byte> encode_igtl(const IgtlMessage& message);

// Bodies. A malformed one is an error; none gives a pose that it does not hold.
[[nodiscard]] Expected<Pose> decode_igtl_transform(std::span<const std::byte> content);  // 12 f32, columns, mm
// 3 f32 position, mm; then quaternion x y z w, or its x y z, where w is what a unit quaternion lacks and not negative.
// The form without a quaternion holds no pose.
[[nodiscard]] Expected<Pose> decode_igtl_position(std::span<const std::byte> content);
struct IgtlTool {
  std::string name;
  Pose X_TO;
};
// 70 bytes a tool: name char[20], type u8, reserved u8, transform. A tool that is not seen is left out.
[[nodiscard]] Expected<std::vector<IgtlTool>> decode_igtl_tdata(std::span<const std::byte> content);
struct IgtlStatus {
  unsigned code = 0;  // 1 OK
  std::string name;
  std::string text;
};
[[nodiscard]] Expected<IgtlStatus> decode_igtl_status(std::span<const std::byte> content);

[[nodiscard]] std::vector<std::byte> encode_igtl_transform(const Pose& X);
[[nodiscard]] std::vector<std::byte> encode_igtl_position(const Pose& X);
[[nodiscard]] std::vector<std::byte> encode_igtl_tdata(std::span<const IgtlTool> tools);

}  // namespace perimap

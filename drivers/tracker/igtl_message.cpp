#include "drivers/tracker/igtl_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "drivers/device/byte_cursor.hpp"

namespace perimap {
namespace {

using Cursor = ByteCursor<std::endian::big>;

constexpr std::size_t kHeader = 58;
constexpr std::size_t kTypeLength = 12;
constexpr std::size_t kNameLength = 20;
constexpr std::size_t kExtendedHeader = 12;
constexpr std::size_t kLongestBody = 1 << 20;  // of the types that are read
constexpr std::uint64_t kLongestPassedOver = std::uint64_t{1} << 32U;
constexpr std::size_t kTransform = 48;
constexpr std::size_t kTool = kNameLength + 2 + kTransform;
constexpr std::size_t kStatusName = 20;

constexpr std::array<std::uint64_t, 256> kTable = [] {
  std::array<std::uint64_t, 256> table{};
  for (std::uint64_t i = 0; i < 256; ++i) {
    std::uint64_t crc = i << 56U;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 63U) != 0 ? crc << 1U ^ 0x42F0E1EBA9EA3693U : crc << 1U;
    table[i] = crc;
  }
  return table;
}();

// Up to the first NUL.
std::string text_of(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    if (b == std::byte{0}) break;
    text.push_back(static_cast<char>(b));
  }
  return text;
}

bool is_read(std::string_view type) {
  return type == "TRANSFORM" || type == "TDATA" || type == "POSITION" || type == "STATUS";
}

class Writer {
 public:
  Writer& number(std::uint64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i)
      all.push_back(static_cast<std::byte>(value >> (8U * static_cast<unsigned>(i)) & 0xFFU));
    return *this;
  }
  Writer& f32(double value) { return number(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4); }
  Writer& text(std::string_view value, std::size_t length) {
    for (std::size_t i = 0; i < length; ++i)
      all.push_back(i < value.size() ? static_cast<std::byte>(value[i]) : std::byte{0});
    return *this;
  }
  Writer& bytes(std::span<const std::byte> value) {
    all.insert(all.end(), value.begin(), value.end());
    return *this;
  }
  Writer& transform(const Pose& X) {
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row) f32(X.R(row, column));
    }
    for (int axis = 0; axis < 3; ++axis) f32(X.t[axis]);
    return *this;
  }

  std::vector<std::byte> all;
};

// A matrix that is a rotation to the precision of its floats and of whoever rounded it; then the nearest rotation to
// it.
std::optional<Pose> read_transform(Cursor& cursor) {
  Matrix3d M;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) M(row, column) = cursor.float32();
  }
  Vector3d t;
  for (int axis = 0; axis < 3; ++axis) t[axis] = cursor.float32();
  constexpr double kTolerance = 0.05;
  const double error = (M.transpose() * M - Matrix3d::Identity()).norm();
  // Written so that a value that is not a number fails.
  if (!cursor.good() || !(error <= kTolerance) || !(M.determinant() > 0.0)) return std::nullopt;
  const Eigen::Quaterniond q(M);
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  return pose_of_device(t, wxyz);
}

// Splits a version 2 body into content and metadata.
std::optional<IgtlDamaged> split(std::span<const std::byte> body, IgtlMessage& message) {
  Cursor cursor(body);
  const std::size_t extended = cursor.number<std::uint16_t>();
  const std::size_t index_bytes = cursor.number<std::uint16_t>();
  const std::size_t metadata_bytes = cursor.number<std::uint32_t>();
  if (!cursor.good() || extended < kExtendedHeader || body.size() < extended ||
      body.size() - extended < index_bytes + metadata_bytes) {
    return IgtlDamaged{"extended header does not fit its body"};
  }
  const auto content = body.subspan(extended, body.size() - extended - index_bytes - metadata_bytes);
  message.content.assign(content.begin(), content.end());
  Cursor index(body.subspan(extended + content.size(), index_bytes));
  Cursor values(body.last(metadata_bytes));
  const unsigned count = index_bytes == 0 ? 0 : index.number<std::uint16_t>();
  for (unsigned i = 0; i < count; ++i) {
    const std::size_t key_size = index.number<std::uint16_t>();
    (void)index.number<std::uint16_t>();  // encoding of the value
    const std::size_t value_size = index.number<std::uint32_t>();
    const auto key = values.read_bytes(key_size);
    const auto value = values.read_bytes(value_size);
    if (!index.good() || !values.good()) return IgtlDamaged{"metadata does not fit its body"};
    message.metadata.emplace_back(text_of(key), text_of(value));
  }
  return std::nullopt;
}

}  // namespace

std::uint64_t igtl_crc(std::span<const std::byte> bytes) noexcept {
  std::uint64_t crc = 0;
  for (const std::byte b : bytes) crc = crc << 8U ^ kTable[crc >> 56U ^ std::to_integer<std::uint64_t>(b)];
  return crc;
}

std::int64_t IgtlMessage::time_ns() const noexcept {
  const std::uint64_t seconds = time_stamp >> 32U;
  const std::uint64_t fraction = time_stamp & 0xFFFFFFFFU;
  return static_cast<std::int64_t>(seconds * 1'000'000'000U + (fraction * 1'000'000'000U >> 32U));
}

void IgtlFramer::restart() noexcept {
  pending_.clear();
  skip_ = 0;
}

void IgtlFramer::feed(std::span<const std::byte> bytes) {
  const std::size_t passed = static_cast<std::size_t>(std::min<std::uint64_t>(skip_, bytes.size()));
  skip_ -= passed;
  pending_.insert(pending_.end(), bytes.begin() + static_cast<std::ptrdiff_t>(passed), bytes.end());
}

std::optional<std::variant<IgtlMessage, IgtlDamaged>> IgtlFramer::next() {
  while (pending_.size() >= kHeader) {
    Cursor cursor(pending_);
    IgtlMessage message;
    message.version = cursor.number<std::uint16_t>();
    message.type = text_of(cursor.read_bytes(kTypeLength));
    message.device = text_of(cursor.read_bytes(kNameLength));
    message.time_stamp = cursor.number<std::uint64_t>();
    const auto size = cursor.number<std::uint64_t>();
    const auto crc = cursor.number<std::uint64_t>();
    const bool named = !message.type.empty() && std::all_of(message.type.begin(), message.type.end(),
                                                            [](char c) { return c > ' ' && c < 0x7F; });
    if (message.version < 1 || message.version > 2 || !named) {
      pending_.clear();
      return IgtlDamaged{"not an OpenIGTLink header", true};
    }
    if (size > (is_read(message.type) ? kLongestBody : kLongestPassedOver)) {
      pending_.clear();
      return IgtlDamaged{fmt::format("{} message of {} bytes", message.type, size), true};
    }
    if (!is_read(message.type)) {
      ++passed_over_;
      const std::uint64_t whole = kHeader + size;
      const std::size_t there = static_cast<std::size_t>(std::min<std::uint64_t>(whole, pending_.size()));
      skip_ = whole - there;
      pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(there));
      continue;
    }
    if (cursor.left() < size) return std::nullopt;
    const auto body = cursor.read_bytes(static_cast<std::size_t>(size));
    std::optional<IgtlDamaged> damage;
    if (igtl_crc(body) != crc) {
      damage = IgtlDamaged{message.type + " message: body CRC"};
    } else if (message.version == 1) {
      message.content.assign(body.begin(), body.end());
    } else {
      damage = split(body, message);
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(kHeader + size));
    if (damage) return *damage;
    return message;
  }
  return std::nullopt;
}

std::vector<std::byte> encode_igtl(const IgtlMessage& message) {
  Writer body;
  if (message.version == 2) {
    Writer index;
    Writer values;
    if (!message.metadata.empty()) index.number(message.metadata.size(), 2);
    for (const auto& [key, value] : message.metadata) {
      index.number(key.size(), 2).number(3, 2).number(value.size(), 4);  // US-ASCII, IANA's number 3
      values.text(key, key.size()).text(value, value.size());
    }
    body.number(kExtendedHeader, 2).number(index.all.size(), 2).number(values.all.size(), 4).number(0, 4);
    body.bytes(message.content).bytes(index.all).bytes(values.all);
  } else {
    body.bytes(message.content);
  }
  Writer whole;
  whole.number(message.version, 2).text(message.type, kTypeLength).text(message.device, kNameLength);
  whole.number(message.time_stamp, 8).number(body.all.size(), 8).number(igtl_crc(body.all), 8).bytes(body.all);
  return std::move(whole.all);
}

Expected<Pose> decode_igtl_transform(std::span<const std::byte> content) {
  if (content.size() != kTransform)
    return fail(fmt::format("TRANSFORM: {} bytes, expected {}", content.size(), kTransform));
  Cursor cursor(content);
  const auto pose = read_transform(cursor);
  if (!pose) return fail("TRANSFORM: the matrix is no rigid pose");
  return *pose;
}

Expected<Pose> decode_igtl_position(std::span<const std::byte> content) {
  constexpr std::size_t kFull = 28;
  constexpr std::size_t kThreeComponents = 24;
  // The shortest form, 12 bytes, leaves the orientation out; without it there is no pose.
  if (content.size() != kFull && content.size() != kThreeComponents) {
    return fail(
        fmt::format("POSITION: {} bytes, expected {} or {} with quaternion", content.size(), kThreeComponents, kFull));
  }
  Cursor cursor(content);
  Vector3d t;
  for (int axis = 0; axis < 3; ++axis) t[axis] = cursor.float32();
  double wxyz[4];
  for (const int component : {1, 2, 3}) wxyz[component] = cursor.float32();
  if (content.size() == kFull) {
    wxyz[0] = cursor.float32();
  } else {
    // Rounded components may be longer than 1 by a little; what is far too long fails as a pose does.
    const double left = 1.0 - wxyz[1] * wxyz[1] - wxyz[2] * wxyz[2] - wxyz[3] * wxyz[3];
    wxyz[0] = left > 0.0 ? std::sqrt(left) : 0.0;
  }
  const auto pose = pose_of_device(t, wxyz);
  if (!pose) return fail("POSITION: position and quaternion are no pose");
  return *pose;
}

Expected<std::vector<IgtlTool>> decode_igtl_tdata(std::span<const std::byte> content) {
  if (content.size() % kTool != 0)
    return fail(fmt::format("TDATA: {} bytes, expected a multiple of {}", content.size(), kTool));
  std::vector<IgtlTool> tools;
  Cursor cursor(content);
  while (cursor.left() > 0) {
    IgtlTool tool;
    tool.name = text_of(cursor.read_bytes(kNameLength));
    (void)cursor.number<std::uint16_t>();  // type, reserved
    const auto pose = read_transform(cursor);
    if (!pose) return fail("TDATA: the matrix of a tool is no rigid pose");
    tool.X_TO = *pose;
    tools.push_back(std::move(tool));
  }
  return tools;
}

Expected<IgtlStatus> decode_igtl_status(std::span<const std::byte> content) {
  Cursor cursor(content);
  IgtlStatus status;
  status.code = cursor.number<std::uint16_t>();
  (void)cursor.number<std::uint64_t>();  // subcode
  status.name = text_of(cursor.read_bytes(kStatusName));
  if (!cursor.good()) return fail("STATUS: ends too early");
  status.text = text_of(cursor.read_bytes(cursor.left()));
  return status;
}

std::vector<std::byte> encode_igtl_transform(const Pose& X) { return std::move(Writer().transform(X).all); }

std::vector<std::byte> encode_igtl_position(const Pose& X) {
  Writer writer;
  for (int axis = 0; axis < 3; ++axis) writer.f32(X.t[axis]);
  double wxyz[4];
  rotation_to_wxyz(X.R, wxyz);
  for (const int component : {1, 2, 3, 0}) writer.f32(wxyz[component]);
  return std::move(writer.all);
}

std::vector<std::byte> encode_igtl_tdata(std::span<const IgtlTool> tools) {
  Writer writer;
  for (const IgtlTool& tool : tools) writer.text(tool.name, kNameLength).number(0x0100, 2).transform(tool.X_TO);
  return std::move(writer.all);
}

}  // namespace perimap

#include "drivers/recording/cdr_check.hpp"

#include <fmt/format.h>

#include <cstring>
#include <limits>

namespace perimap {
namespace {

// DDS-XTypes 1.3 §7.4.3.4.2: member header of a mutable type.
constexpr std::uint32_t kMustUnderstand = 0x80000000U;
constexpr std::uint32_t kMemberIdMask = 0x0fffffffU;

class Walker {
 public:
  explicit Walker(std::span<const std::byte> body) noexcept : body_(body) {}

  // Checks one value against the instructions up to their end (RTS).
  bool check_value(const std::uint32_t* ops, std::size_t limit) {
    if (DDS_OP(*ops) == DDS_OP_DLC) return check_appendable(ops + 1, limit);
    if (DDS_OP(*ops) == DDS_OP_PLC) return check_mutable(ops + 1, limit);
    while (*ops != DDS_OP_RTS) {
      if (!check_member(ops, limit)) return false;
      ops = after_member(ops);
      if (ops == nullptr) return false;
    }
    return true;
  }

  [[nodiscard]] std::size_t at() const noexcept { return at_; }

 private:
  bool align(std::size_t alignment, std::size_t limit) noexcept {
    const std::size_t aligned = (at_ + alignment - 1) & ~(alignment - 1);
    if (aligned > limit) return false;
    at_ = aligned;
    return true;
  }

  bool skip(std::uint64_t bytes, std::size_t limit) noexcept {
    if (bytes > limit - at_) return false;
    at_ += static_cast<std::size_t>(bytes);
    return true;
  }

  bool take(std::uint32_t& value, std::size_t limit) noexcept {
    if (!align(4, limit) || limit - at_ < sizeof(value)) return false;
    std::memcpy(&value, body_.data() + at_, sizeof(value));
    at_ += sizeof(value);
    return true;
  }

  // Length of one number, 0 for what is not a number.
  static std::size_t number_bytes(dds_stream_typecode type) noexcept {
    switch (type) {
      case DDS_OP_VAL_1BY:
        return 1;
      case DDS_OP_VAL_2BY:
        return 2;
      case DDS_OP_VAL_4BY:
        return 4;
      case DDS_OP_VAL_8BY:
        return 8;
      default:
        return 0;
    }
  }

  bool check_numbers(dds_stream_typecode type, std::uint64_t count, std::size_t limit) noexcept {
    const std::size_t bytes = number_bytes(type);
    if (bytes == 0) return false;
    return align(bytes < 4 ? bytes : 4, limit) && skip(count * bytes, limit);
  }

  bool check_booleans(std::uint64_t count, std::size_t limit) noexcept {
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!skip(1, limit) || std::to_integer<unsigned>(body_[at_ - 1]) > 1) return false;
    }
    return true;
  }

  // `max_bytes` counts the terminator.
  bool check_string(std::uint32_t max_bytes, std::size_t limit) noexcept {
    std::uint32_t length = 0;
    if (!take(length, limit) || length == 0 || length > max_bytes || !skip(length, limit)) return false;
    return body_[at_ - 1] == std::byte{0};
  }

  bool check_sequence(const std::uint32_t* ops, std::size_t limit) {
    const dds_stream_typecode element = DDS_OP_SUBTYPE(ops[0]);
    std::uint32_t count = 0;
    if (number_bytes(element) != 0) return take(count, limit) && (count == 0 || check_numbers(element, count, limit));
    if (element != DDS_OP_VAL_STU) return false;
    std::uint32_t length = 0;
    if (!take(length, limit) || length > limit - at_) return false;
    const std::size_t end = at_ + length;
    if (!take(count, end)) return false;
    for (std::uint32_t i = 0; i < count; ++i) {
      // An element takes at least one byte, so that a count cannot ask for more memory than bytes have come.
      const std::size_t before = at_;
      if (!check_value(ops + DDS_OP_ADR_JSR(ops[3]), end) || at_ == before) return false;
    }
    return at_ == end;
  }

  bool check_member(const std::uint32_t* ops, std::size_t limit) {
    const std::uint32_t instruction = ops[0];
    if (DDS_OP(instruction) != DDS_OP_ADR || (instruction & (DDS_OP_FLAG_EXT | DDS_OP_FLAG_OPT)) != 0) return false;
    const dds_stream_typecode type = DDS_OP_TYPE(instruction);
    switch (type) {
      case DDS_OP_VAL_1BY:
      case DDS_OP_VAL_2BY:
      case DDS_OP_VAL_4BY:
      case DDS_OP_VAL_8BY:
        return check_numbers(type, 1, limit);
      case DDS_OP_VAL_BLN:
        return check_booleans(1, limit);
      case DDS_OP_VAL_ENU: {
        std::uint32_t value = 0;
        return DDS_OP_TYPE_SZ(instruction) == sizeof(value) && take(value, limit) && value <= ops[2];
      }
      case DDS_OP_VAL_STR:
        return check_string(std::numeric_limits<std::uint32_t>::max(), limit);
      case DDS_OP_VAL_BST:
        return check_string(ops[2], limit);
      case DDS_OP_VAL_SEQ:
        return check_sequence(ops, limit);
      case DDS_OP_VAL_ARR:
        if (DDS_OP_SUBTYPE(instruction) == DDS_OP_VAL_BLN) return check_booleans(ops[2], limit);
        return check_numbers(DDS_OP_SUBTYPE(instruction), ops[2], limit);
      case DDS_OP_VAL_EXT:
        return check_value(ops + DDS_OP_ADR_JSR(ops[2]), limit);
      default:
        return false;
    }
  }

  // The next member's instruction; nullptr when this one is of a kind that check_member() refuses.
  static const std::uint32_t* after_member(const std::uint32_t* ops) noexcept {
    switch (DDS_OP_TYPE(ops[0])) {
      case DDS_OP_VAL_1BY:
      case DDS_OP_VAL_2BY:
      case DDS_OP_VAL_4BY:
      case DDS_OP_VAL_8BY:
      case DDS_OP_VAL_BLN:
      case DDS_OP_VAL_STR:
        return ops + 2;
      case DDS_OP_VAL_ENU:
      case DDS_OP_VAL_BST:
      case DDS_OP_VAL_ARR:
        return ops + 3;
      case DDS_OP_VAL_SEQ: {
        if (DDS_OP_SUBTYPE(ops[0]) != DDS_OP_VAL_STU) return ops + 2;
        const std::uint32_t jump = DDS_OP_ADR_JMP(ops[3]);
        return ops + (jump != 0 ? jump : 4);
      }
      case DDS_OP_VAL_EXT: {
        const std::uint32_t jump = DDS_OP_ADR_JMP(ops[2]);
        return ops + (jump != 0 ? jump : 3);
      }
      default:
        return nullptr;
    }
  }

  // An older writer stops early; what a newer one added is skipped.
  bool check_appendable(const std::uint32_t* ops, std::size_t limit) {
    std::uint32_t length = 0;
    if (!take(length, limit) || length > limit - at_) return false;
    const std::size_t end = at_ + length;
    while (*ops != DDS_OP_RTS && at_ < end) {
      if (!check_member(ops, end)) return false;
      ops = after_member(ops);
      if (ops == nullptr) return false;
    }
    at_ = end;
    return true;
  }

  bool check_mutable(const std::uint32_t* members, std::size_t limit) {
    std::uint32_t length = 0;
    if (!take(length, limit) || length > limit - at_) return false;
    const std::size_t end = at_ + length;
    while (at_ < end) {
      std::uint32_t header = 0;
      if (!take(header, end)) return false;
      const std::uint32_t length_code = (header >> 28) & 7U;
      std::uint64_t member_bytes = std::uint64_t{1} << length_code;
      if (length_code >= 4) {
        std::uint32_t next = 0;
        if (!take(next, end)) return false;
        member_bytes = next;
        if (length_code >= 5) {  // the length is the member's own first 4 bytes
          member_bytes = (member_bytes << (length_code == 5 ? 0 : length_code - 4)) + sizeof(next);
          at_ -= sizeof(next);
        }
      }
      if (member_bytes > end - at_) return false;
      const std::size_t member_end = at_ + static_cast<std::size_t>(member_bytes);
      const std::uint32_t* member = find_member(members, header & kMemberIdMask);
      if (member == nullptr) {
        if ((header & kMustUnderstand) != 0) return false;
        at_ = member_end;
      } else if (!check_value(member, member_end) || at_ != member_end) {
        return false;
      }
    }
    return true;
  }

  static const std::uint32_t* find_member(const std::uint32_t* members, std::uint32_t id) noexcept {
    for (; *members != DDS_OP_RTS; members += 2) {
      if (members[1] == id) return members + DDS_OP_ADR_PLM(members[0]);
    }
    return nullptr;
  }

  std::span<const std::byte> body_;
  std::size_t at_ = 0;
};

}  // namespace

Expected<std::size_t> check_xcdr2(std::span<const std::byte> body, const std::uint32_t* ops) {
  Walker walker(body);
  if (!walker.check_value(ops, body.size())) return fail(fmt::format("wrong at byte {} of the body", walker.at()));
  return walker.at();
}

}  // namespace perimap

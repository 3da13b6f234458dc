#include "drivers/recording/cdr.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsrt/heap.h>
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <vector>

#include "drivers/recording/cdr_check.hpp"

namespace perimap {
namespace {

constexpr std::uint32_t kXcdrVersion2 = 2;
constexpr std::uint32_t kEncapsulationBytes = 4;
// XCDR2 aligns to 4 bytes at most, so a body that starts 4 bytes into the buffer is laid out as one that starts at 0.
static_assert(kEncapsulationBytes % 4 == 0);
constexpr std::uint32_t kInitialCapacity = 4096;

// RTPS representation identifier of the type's kind, little-endian (DDSI-RTPS 2.5 table 10.3).
std::uint8_t representation(const TopicType& type) {
  ddsi_sertype_extensibility extensibility = DDSI_SERTYPE_EXT_FINAL;
  dds_stream_extensibility(type.descriptor->m_ops, &extensibility);
  switch (extensibility) {
    case DDSI_SERTYPE_EXT_APPENDABLE:
      return 0x09;  // D_CDR2_LE
    case DDSI_SERTYPE_EXT_MUTABLE:
      return 0x0b;  // PL_CDR2_LE
    case DDSI_SERTYPE_EXT_FINAL:
      break;
  }
  return 0x07;  // CDR2_LE
}

}  // namespace

void CdrSerializer::Free::operator()(unsigned char* buffer) const noexcept { ddsrt_free(buffer); }

CdrSerializer::CdrSerializer()
    : buffer_(static_cast<unsigned char*>(ddsrt_malloc(kInitialCapacity))), capacity_(kInitialCapacity) {}

Expected<std::span<const std::byte>> CdrSerializer::serialize(const void* sample, const TopicType& type) {
  const std::array<unsigned char, kEncapsulationBytes> header{0, representation(type), 0, 0};
  std::memcpy(buffer_.get(), header.data(), header.size());
  // The stream may move the buffer, so it has it for the time of the call.
  dds_ostreamLE_t stream{{buffer_.release(), capacity_, kEncapsulationBytes, kXcdrVersion2}};
  const std::uint32_t* written = dds_stream_writeLE(&stream, static_cast<const char*>(sample), type.descriptor->m_ops);
  buffer_.reset(stream.x.m_buffer);
  capacity_ = stream.x.m_size;
  if (written == nullptr) {
    return fail(fmt::format("{}: a member has a value that its type does not allow", type.schema_name()));
  }
  if (stream.x.m_index > kMaxSerializedBytes) {
    return fail(fmt::format("{}: a message of {} bytes is larger than the limit of {}", type.schema_name(),
                            stream.x.m_index, kMaxSerializedBytes));
  }
  return std::as_bytes(std::span(buffer_.get(), stream.x.m_index));
}

Expected<void> deserialize(std::span<const std::byte> bytes, const TopicType& type, void* zeroed_sample) {
  if (bytes.size() < kEncapsulationBytes) {
    return fail(fmt::format("{}: {} bytes are too few for a message", type.schema_name(), bytes.size()));
  }
  if (bytes.size() > kMaxSerializedBytes) {
    return fail(fmt::format("{}: a message of {} bytes is larger than the limit of {}", type.schema_name(),
                            bytes.size(), kMaxSerializedBytes));
  }
  const auto identifier = (std::to_integer<unsigned>(bytes[0]) << 8) | std::to_integer<unsigned>(bytes[1]);
  if (identifier != representation(type)) {
    return fail(fmt::format("{}: encapsulation 0x{:04x}, expected 0x{:04x}", type.schema_name(), identifier,
                            representation(type)));
  }
  const auto body = bytes.subspan(kEncapsulationBytes);
  const auto used = check_xcdr2(body, type.descriptor->m_ops);
  if (!used) {
    return fail(fmt::format("{}: the {} bytes are not a valid message of this type, {}", type.schema_name(),
                            bytes.size(), used.error().message));
  }
  // Writers may pad a payload to a multiple of 4.
  if (body.size() - *used > 3) {
    return fail(fmt::format("{}: {} bytes left over after the message", type.schema_name(), body.size() - *used));
  }
  // A copy, because the reader needs alignment.
  std::vector<std::uint64_t> aligned(*used / sizeof(std::uint64_t) + 1);
  std::memcpy(aligned.data(), body.data(), *used);
  dds_istream_t stream;
  dds_istream_init(&stream, static_cast<std::uint32_t>(*used), aligned.data(), kXcdrVersion2);
  dds_stream_read(&stream, static_cast<char*>(zeroed_sample), type.descriptor->m_ops);
  return {};
}

}  // namespace perimap

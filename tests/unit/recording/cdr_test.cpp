#include "drivers/recording/cdr.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "tests/unit/recording/every_type.hpp"
#include "tests/unit/recording/samples.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

using Bytes = std::vector<std::byte>;

template <class T>
Bytes bytes_of(const T& sample) {
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(sample);
  EXPECT_TRUE(bytes.has_value()) << bytes.error().message;
  return Bytes(bytes->begin(), bytes->end());
}

void expect_no_leaf_at_rest(const nlohmann::json& value, const std::string& name) {
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) expect_no_leaf_at_rest(member, name + "." + key);
  } else if (value.is_array()) {
    EXPECT_FALSE(value.empty()) << name;
    for (const auto& element : value) expect_no_leaf_at_rest(element, name + "[]");
  } else if (value.is_string()) {
    EXPECT_NE(value, "") << name;
    EXPECT_NE(value, "0") << name;
  } else if (value.is_boolean()) {
    EXPECT_TRUE(value.get<bool>()) << name;
  } else {
    EXPECT_NE(value, 0) << name;
  }
}

template <class T>
class CdrOfEveryType : public ::testing::Test {};
template <class Tuple>
struct TestTypes;
template <class... T>
struct TestTypes<std::tuple<T...>> {
  using type = ::testing::Types<T...>;
};
TYPED_TEST_SUITE(CdrOfEveryType, TestTypes<test::EveryType>::type);

TYPED_TEST(CdrOfEveryType, GivesEveryMemberBack) {
  const auto sample = test::make_sample<TypeParam>(1);
  const auto expected = test::to_json(*sample);
  expect_no_leaf_at_rest(expected, std::string(topic_type<TypeParam>().schema_name()));
  const auto decoded = deserialize<TypeParam>(bytes_of(*sample));
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  EXPECT_EQ(test::to_json(**decoded), expected);
}

TYPED_TEST(CdrOfEveryType, GivesAnEmptySampleBack) {
  const Sample<TypeParam> empty;
  const auto decoded = deserialize<TypeParam>(bytes_of(*empty));
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  EXPECT_EQ(test::to_json(**decoded), test::to_json(*empty));
}

TYPED_TEST(CdrOfEveryType, RefusesEveryTruncation) {
  const Bytes bytes = bytes_of(*test::make_sample<TypeParam>(1));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    // A copy of exactly that length, so that the address sanitizer sees a read beyond it.
    const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(deserialize<TypeParam>(cut).has_value()) << length << " of " << bytes.size();
  }
}

TYPED_TEST(CdrOfEveryType, RefusesBytesLeftOver) {
  Bytes bytes = bytes_of(*test::make_sample<TypeParam>(1));
  bytes.resize(bytes.size() + 4);
  const auto decoded = deserialize<TypeParam>(bytes);
  ASSERT_FALSE(decoded.has_value());
  EXPECT_THAT(decoded.error().message, HasSubstr("left over"));
}

TYPED_TEST(CdrOfEveryType, RefusesAnotherEncapsulation) {
  Bytes bytes = bytes_of(*test::make_sample<TypeParam>(1));
  bytes[1] = std::byte{0x01};  // plain CDR of the first version
  const auto decoded = deserialize<TypeParam>(bytes);
  ASSERT_FALSE(decoded.has_value());
  EXPECT_THAT(decoded.error().message, HasSubstr("encapsulation 0x0001"));
}

// Whatever the bytes, the result is an error or a sample that can be written again.
TYPED_TEST(CdrOfEveryType, SurvivesGarbledBytes) {
  const Bytes original = bytes_of(*test::make_sample<TypeParam>(1));
  std::mt19937 random(20130506);
  for (int round = 0; round < 2000; ++round) {
    Bytes bytes = original;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < changes; ++i) {
      const std::size_t at = 4 + random() % (bytes.size() - 4);
      bytes[at] = static_cast<std::byte>(random() % 3 == 0 ? 0xff : random());
    }
    const auto decoded = deserialize<TypeParam>(bytes);
    if (decoded) {
      EXPECT_FALSE(bytes_of(**decoded).empty());
    }
  }
}

std::uint32_t length_header(const Bytes& bytes) {
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 4, sizeof(length));
  return length;
}

void set_length_header(Bytes& bytes, std::size_t length) {
  const auto value = static_cast<std::uint32_t>(length);
  std::memcpy(bytes.data() + 4, &value, sizeof(value));
}

TEST(Cdr, SkipsMembersThatANewerWriterAdded) {
  const auto sample = test::make_sample<perimap_TrackerPose>(1);
  Bytes bytes = bytes_of(*sample);
  ASSERT_EQ(length_header(bytes), bytes.size() - 8);
  bytes.resize(bytes.size() + 12, std::byte{7});
  set_length_header(bytes, bytes.size() - 8);
  const auto decoded = deserialize<perimap_TrackerPose>(bytes);
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  EXPECT_EQ(test::to_json(**decoded), test::to_json(*sample));
}

TEST(Cdr, LeavesMembersZeroThatAnOlderWriterDidNotKnow) {
  const auto sample = test::make_sample<perimap_TrackerPose>(1);
  Bytes bytes = bytes_of(*sample);
  bytes.resize(bytes.size() - sizeof(sample->error_mm));
  set_length_header(bytes, bytes.size() - 8);
  const auto decoded = deserialize<perimap_TrackerPose>(bytes);
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  auto expected = test::to_json(*sample);
  expected["error_mm"] = 0.0;
  EXPECT_EQ(test::to_json(**decoded), expected);
}

// Cyclone's own check takes a double for 4 bytes here, and its reader then runs beyond the end.
TEST(Cdr, RefusesMoreDoublesThanThereAreBytes) {
  const auto sample = test::make_sample<perimap_TruthMesh>(1);
  Bytes bytes = bytes_of(*sample);
  constexpr std::size_t kCount = 4 + 4 + 4 + 4;  // behind encapsulation, length, vertex_count and harmonics
  ASSERT_EQ(std::to_integer<std::uint32_t>(bytes[kCount]), sample->coefficients_W_mm._length);
  for (std::uint32_t count = sample->coefficients_W_mm._length + 1; count < 250; ++count) {
    bytes[kCount] = static_cast<std::byte>(count);
    const auto decoded = deserialize<perimap_TruthMesh>(bytes);
    if (decoded) {
      EXPECT_LE((*decoded)->coefficients_W_mm._length * sizeof(double), bytes.size());
    }
  }
}

// Members of a mutable type carry their number: 4 bytes of header, here for one of 4 bytes.
Bytes with_member(Bytes bytes, std::uint32_t header) {
  const std::uint32_t member[] = {header, 42};
  const auto added = std::as_bytes(std::span(member));
  while (bytes.size() % 4 != 0) bytes.push_back(std::byte{0});
  bytes.insert(bytes.end(), added.begin(), added.end());
  set_length_header(bytes, bytes.size() - 8);
  return bytes;
}

TEST(Cdr, SkipsAnUnknownMemberOfAMutableTypeUnlessItMustBeUnderstood) {
  const auto sample = test::make_sample<perimap_SurfaceModel>(1);
  const Bytes bytes = bytes_of(*sample);
  constexpr std::uint32_t kUnknown = 0x20000000U | 999;
  const auto decoded = deserialize<perimap_SurfaceModel>(with_member(bytes, kUnknown));
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  EXPECT_EQ(test::to_json(**decoded), test::to_json(*sample));
  EXPECT_FALSE(deserialize<perimap_SurfaceModel>(with_member(bytes, kUnknown | 0x80000000U)).has_value());
}

TEST(Cdr, RefusesToWriteAnEnumeratorThatDoesNotExist) {
  perimap_TrackerPose pose{};
  constexpr std::uint32_t kNoSuchState = perimap_TOOL_DISABLED + 1;
  std::memcpy(&pose.state, &kNoSuchState, sizeof(pose.state));
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(pose);
  ASSERT_FALSE(bytes.has_value());
  EXPECT_THAT(bytes.error().message, HasSubstr("perimap::TrackerPose"));
  pose.state = perimap_TOOL_MISSING;
  EXPECT_TRUE(serializer.serialize(pose).has_value());
}

TEST(Cdr, RefusesToWriteMoreThanItWouldRead) {
  std::vector<std::uint8_t> pixels(kMaxSerializedBytes);
  foxglove_RawImage image{};
  image.data = {static_cast<std::uint32_t>(pixels.size()), static_cast<std::uint32_t>(pixels.size()), pixels.data(),
                false};
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(image);
  ASSERT_FALSE(bytes.has_value());
  EXPECT_THAT(bytes.error().message, HasSubstr("larger than the limit"));
}

TEST(Cdr, SerializerForgetsTheSampleBefore) {
  CdrSerializer serializer;
  const auto large = test::make_sample<perimap_Status>(1);
  const auto small = test::make_sample<perimap_TruthCamera>(2);
  ASSERT_TRUE(serializer.serialize(*large).has_value());
  const auto bytes = serializer.serialize(*small);
  ASSERT_TRUE(bytes.has_value());
  EXPECT_EQ(Bytes(bytes->begin(), bytes->end()), bytes_of(*small));
}

TEST(Cdr, SchemaTextDefinesTheType) {
  EXPECT_EQ(topic_type<perimap_Surface>().schema_name(), "perimap::Surface");
  EXPECT_THAT(std::string(topic_type<perimap_Surface>().schema_text), HasSubstr("struct Surface {"));
  EXPECT_THAT(std::string(topic_type<foxglove_RawImage>().schema_text), HasSubstr("struct RawImage {"));
}

}  // namespace
}  // namespace perimap

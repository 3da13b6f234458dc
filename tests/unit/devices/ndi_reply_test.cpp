// NDI replies: framing and decoding.
#include "ndi_theatre.hpp"

namespace perimap {
namespace {

TEST(NdiCrc, AgreesWithTheGuidesExamples) {
  for (const std::string whole : {"OKAYA896", "RESETBE6F", "INIT:E3A5", "TSTART:801B0B", "TSTOP:2C14", "BX:080100EC",
                                  "TX:0001031A", "PHSR:02E17E", "COMM:500000048"}) {
    EXPECT_EQ(ndi_with_crc(whole.substr(0, whole.size() - 4)), whole + "\r");
  }
}

// ---- framing

std::vector<std::byte> framed(const std::vector<std::byte>& body, bool long_form = false) {
  std::vector<std::byte> all{long_form ? std::byte{0xC8} : std::byte{0xC4}, std::byte{0xA5}};
  const auto put = [&all](std::size_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) all.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFU));
  };
  put(body.size(), long_form ? 4 : 2);
  put(ndi_crc(all), 2);
  all.insert(all.end(), body.begin(), body.end());
  put(ndi_crc(body), 2);
  return all;
}

std::string kind_of(NdiReplyFramer& framer) {
  const auto reply = framer.next();
  if (!reply) return "more";
  if (const auto* text = std::get_if<NdiText>(&*reply)) return "text " + text->text;
  if (const auto* binary = std::get_if<NdiBinary>(&*reply)) return "binary " + std::to_string(binary->body.size());
  return "damaged";
}

TEST(NdiReplyFramer, TakesRepliesInAnyChunks) {
  std::vector<std::byte> stream = bytes_of("OKAYA896\r");
  for (const bool long_form : {false, true}) {
    const auto binary = framed(bytes_of("some body"), long_form);
    stream.insert(stream.end(), binary.begin(), binary.end());
  }
  for (std::size_t cut = 1; cut <= stream.size(); ++cut) {
    NdiReplyFramer framer;
    std::vector<std::string> kinds;
    for (std::size_t at = 0; at < stream.size(); at += cut) {
      framer.feed(std::span(stream).subspan(at, std::min(cut, stream.size() - at)));
      for (std::string kind = kind_of(framer); kind != "more"; kind = kind_of(framer)) kinds.push_back(kind);
    }
    EXPECT_THAT(kinds, ::testing::ElementsAre("text OKAY", "binary 9", "binary 9"));
  }
}

TEST(NdiReplyFramer, EveryFlippedBitIsNoticed) {
  for (const auto& good : {bytes_of("OKAYA896\r"), framed(bytes_of("body")), framed(bytes_of("body"), true)}) {
    for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
      auto bad = good;
      bad[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      NdiReplyFramer framer;
      framer.feed(bad);
      // A flipped end of text, or a byte that no longer announces binary, leaves the reply waiting for an end.
      EXPECT_THAT(kind_of(framer), ::testing::AnyOf("damaged", "more")) << bit;
    }
  }
}

TEST(NdiReplyFramer, RefusesWhatCannotBeAReply) {
  struct Case {
    const char* what;
    std::vector<std::byte> bytes;
    const char* kind;
  };
  std::vector<std::byte> huge{std::byte{0xC8}, std::byte{0xA5}, std::byte{0},
                              std::byte{0},    std::byte{0},    std::byte{0x7F}};
  const auto crc = ndi_crc(huge);
  huge.push_back(static_cast<std::byte>(crc & 0xFFU));
  huge.push_back(static_cast<std::byte>(crc >> 8U));
  const Case cases[] = {
      {"nothing", {}, "more"},
      {"an empty line", bytes_of("\r"), "damaged"},
      {"a CRC alone", bytes_of("A896\r"), "damaged"},
      {"lower-case digits of a wrong CRC", bytes_of("OKAYzz96\r"), "damaged"},
      {"truncated text", bytes_of("OKAYA8"), "more"},
      {"binary start, then text", bytes_of("\xC4OKAYA896\r"), "damaged"},
      {"a body of 2 GB", huge, "damaged"},
      {"text without end", std::vector<std::byte>(10000, std::byte{'A'}), "damaged"},
      {"an empty body", framed({}), "binary 0"},
  };
  for (const Case& c : cases) {
    NdiReplyFramer framer;
    framer.feed(c.bytes);
    EXPECT_EQ(kind_of(framer), c.kind) << c.what;
  }
}

// ---- decoding

struct Body {
  std::vector<std::byte> all;
  Body& u(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) all.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFU));
    return *this;
  }
  Body& floats(std::initializer_list<double> values) {
    for (const double v : values) u(std::bit_cast<std::uint32_t>(static_cast<float>(v)), 4);
    return *this;
  }
};

// Tools: 0A valid, 0B missing, 0C disabled, 0D out of volume.
std::vector<std::byte> bx_body() {
  Body body;
  body.u(4, 1);
  body.u(0x0A, 1).u(1, 1).floats({1, 0, 0, 0, 10, 20, -30, 0.2}).u(0x31, 4).u(1234, 4);
  body.u(0x0B, 1).u(2, 1).u(0x31, 4).u(1234, 4);
  body.u(0x0C, 1).u(4, 1);
  body.u(0x0D, 1).u(1, 1).floats({1, 0, 0, 0, 10, 20, -30, 0.2}).u(0x71, 4).u(1234, 4);
  return body.u(0, 2).all;
}

std::vector<std::byte> bx2_body() {
  Body tools;
  tools.u(0x0A, 2).u(0, 2).floats({1, 0, 0, 0, 10, 20, -30, 0.2});
  tools.u(0x0B, 2).u(0x011F, 2);
  tools.u(0x0C, 2).u(0x0120, 2);
  tools.u(0x0D, 2).u(0x0109, 2);
  Body item;
  item.u(1, 1).u(7, 1).u(0, 2).u(1234, 4).u(20, 4).u(500, 4);
  item.u(1, 2).u(2, 2);                               // container of two components
  item.u(0x12, 2).u(16, 4).u(0, 2).u(1, 4).u(99, 4);  // alerts: passed over
  item.u(2, 2).u(12 + tools.all.size(), 4).u(0, 2).u(4, 4);
  item.all.insert(item.all.end(), tools.all.begin(), tools.all.end());
  Body body;
  body.u(1, 2).u(1, 2).u(1, 2).u(12 + item.all.size(), 4).u(0, 2).u(1, 4);
  body.all.insert(body.all.end(), item.all.begin(), item.all.end());
  return body.all;
}

const std::string kTx =
    "04"
    "0A+10000+00000+00000+00000+001000+002000-003000+00200"
    "00000031000004D2\n"
    "0BMISSING00000031000004D2\n"
    "0CDISABLED\n"
    "0DMISSING00000071000004D2\n"
    "0000";

void expect_four_tools(const Expected<NdiTracking>& tracking) {
  ASSERT_TRUE(tracking) << tracking.error().message;
  ASSERT_EQ(tracking->tools.size(), 4U);
  const ToolState states[] = {ToolState::kOk, ToolState::kMissing, ToolState::kDisabled, ToolState::kOutOfVolume};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(tracking->tools[i].handle, 0x0A + i);
    EXPECT_EQ(tracking->tools[i].reading.state, states[i]) << i;
  }
  EXPECT_EQ(tracking->tools[0].frame, 1234U);
  EXPECT_TRUE(tracking->tools[0].reading.X_TO.t.isApprox(Vector3d(10, 20, -30), 1e-6));
}

TEST(NdiTracking, KeepsValidMissingDisabledAndOutOfVolumeApart) {
  expect_four_tools(decode_bx(bx_body()));
  expect_four_tools(decode_bx2(bx2_body()));
  expect_four_tools(decode_tx(kTx));
}

TEST(NdiTracking, EveryTruncationAndEveryExcessIsAnError) {
  const auto bx = bx_body();
  const auto bx2 = bx2_body();
  for (std::size_t size = 0; size < bx.size(); ++size) EXPECT_FALSE(decode_bx(std::span(bx).first(size))) << size;
  for (std::size_t size = 0; size < bx2.size(); ++size) EXPECT_FALSE(decode_bx2(std::span(bx2).first(size))) << size;
  for (std::size_t size = 0; size < kTx.size(); ++size) EXPECT_FALSE(decode_tx(kTx.substr(0, size))) << size;
  auto longer = bx_body();
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decode_bx(longer));
  longer = bx2_body();
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decode_bx2(longer));
  EXPECT_FALSE(decode_tx(kTx + "0"));
}

TEST(NdiTracking, ATransformThatIsNoPoseIsAnError) {
  const double nan = std::nan("");
  for (const std::initializer_list<double> floats : {std::initializer_list<double>{0, 0, 0, 0, 1, 2, 3, 0},
                                                     {nan, 0, 0, 0, 1, 2, 3, 0},
                                                     {1, 0, 0, 0, nan, 2, 3, 0},
                                                     {1, 0, 0, 0, 1e30, 2, 3, 0},
                                                     {-3.697314e28, 0, 0, 0, 0, 0, 0, 0},
                                                     {1, 1, 0, 0, 1, 2, 3, 0}}) {
    EXPECT_FALSE(decode_bx(Body().u(1, 1).u(0x0A, 1).u(1, 1).floats(floats).u(0x31, 4).u(1, 4).u(0, 2).all));
  }
}

TEST(NdiTracking, UnknownStatesAndLyingCountsAreErrors) {
  EXPECT_FALSE(decode_bx(Body().u(1, 1).u(0x0A, 1).u(3, 1).u(0, 2).all));
  EXPECT_FALSE(decode_bx(Body().u(255, 1).u(0x0A, 1).u(4, 1).u(0, 2).all));
  // A component that claims four thousand million items, one that is shorter than its header, one outside a frame.
  EXPECT_FALSE(decode_bx2(Body().u(1, 2).u(1, 2).u(1, 2).u(12, 4).u(0, 2).u(0xFFFFFFFF, 4).all));
  EXPECT_FALSE(decode_bx2(Body().u(1, 2).u(1, 2).u(2, 2).u(3, 4).u(0, 2).u(0, 4).all));
  EXPECT_FALSE(decode_bx2(Body().u(1, 2).u(1, 2).u(2, 2).u(16, 4).u(0, 2).u(1, 4).u(0x0A, 2).u(0x100, 2).all));
  EXPECT_FALSE(decode_tx("010AUNKNOWN0000003100000001\n0000"));
  EXPECT_FALSE(decode_tx("FF0ADISABLED\n0000"));
}

}  // namespace
}  // namespace perimap

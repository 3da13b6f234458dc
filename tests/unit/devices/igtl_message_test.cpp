// OpenIGTLink messages: framing and decoding, and Debian's library as the peer.
#include "igtl_messages.hpp"

namespace perimap {
namespace {

// ---- Debian's library as the peer

void set_matrix(igtl::Matrix4x4& matrix) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix[row][column] = static_cast<float>(row == 3      ? (column == 3 ? 1 : 0)
                                               : column == 3 ? kPose.t[row]
                                                             : kPose.R(row, column));
    }
  }
}

IgtlMessage framed_of(igtl::MessageBase& message) {
  message.Pack();
  IgtlFramer framer;
  framer.feed(
      {static_cast<const std::byte*>(message.GetPackPointer()), static_cast<std::size_t>(message.GetPackSize())});
  const auto next = framer.next();
  EXPECT_TRUE(next && std::holds_alternative<IgtlMessage>(*next));
  return next && std::holds_alternative<IgtlMessage>(*next) ? std::get<IgtlMessage>(*next) : IgtlMessage{};
}

TEST(IgtlLibrary, WhatItSendsIsUnderstood) {
  igtl::Matrix4x4 matrix;
  set_matrix(matrix);
  auto sent = igtl::TransformMessage::New();
  sent->SetDeviceName("Scope");
  sent->SetMatrix(matrix);
  auto stamp = igtl::TimeStamp::New();
  stamp->SetTime(1234, 500000000);
  sent->SetTimeStamp(stamp);
  const IgtlMessage message = framed_of(*sent);
  EXPECT_EQ(message.device, "Scope");
  EXPECT_NEAR(static_cast<double>(message.time_ns()), 1234.5e9, 10);
  expect_pose(decode_igtl_transform(message.content));

  auto tracking = igtl::TrackingDataMessage::New();
  auto element = igtl::TrackingDataElement::New();
  element->SetName("Scope");
  element->SetType(igtl::TrackingDataElement::TYPE_6D);
  element->SetMatrix(matrix);
  tracking->AddTrackingDataElement(element);
  const auto tools = decode_igtl_tdata(framed_of(*tracking).content);
  ASSERT_TRUE(tools);
  ASSERT_EQ(tools->size(), 1U);
  EXPECT_EQ(tools->front().name, "Scope");
  expect_pose(tools->front().X_TO);

  auto position = igtl::PositionMessage::New();
  position->SetPosition(10, -20, 30);
  double q[4];
  rotation_to_wxyz(kPose.R, q);
  position->SetQuaternion(static_cast<float>(q[1]), static_cast<float>(q[2]), static_cast<float>(q[3]),
                          static_cast<float>(q[0]));
  expect_pose(decode_igtl_position(framed_of(*position).content));
  position->SetPackType(igtl::PositionMessage::WITH_QUATERNION3);
  const IgtlMessage shorter = framed_of(*position);
  EXPECT_EQ(shorter.content.size(), 24U);
  expect_pose(decode_igtl_position(shorter.content));

  auto status = igtl::StatusMessage::New();
  status->SetCode(igtl::StatusMessage::STATUS_NOT_READY);
  status->SetErrorName("E13");
  status->SetStatusString("warming up");
  const auto told = decode_igtl_status(framed_of(*status).content);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->code, 13U);
  EXPECT_EQ(told->text, "warming up");
}

TEST(IgtlLibrary, UnderstandsWhatIsSent) {
  const auto bytes = encode_igtl(transform());
  auto header = igtl::MessageHeader::New();
  header->InitPack();
  ASSERT_EQ(header->GetPackSize(), 58);
  std::memcpy(header->GetPackPointer(), bytes.data(), 58);
  header->Unpack();
  EXPECT_STREQ(header->GetDeviceName(), "Scope");
  auto received = igtl::TransformMessage::New();
  received->SetMessageHeader(header);
  received->AllocatePack();
  std::memcpy(received->GetPackBodyPointer(), bytes.data() + 58, bytes.size() - 58);
  ASSERT_TRUE(received->Unpack(1) & igtl::MessageHeader::UNPACK_BODY);  // with its own check of the CRC
  igtl::Matrix4x4 matrix;
  received->GetMatrix(matrix);
  EXPECT_NEAR(matrix[2][3], 30.0F, 1e-5);
  EXPECT_NEAR(matrix[0][1], kPose.R(0, 1), 1e-6);
}

// ---- framing and decoding

TEST(IgtlFramer, TakesBothHeaderVersionsInAnyChunksAndPassesOverOtherTypes) {
  std::vector<std::byte> stream;
  const auto append = [&stream](const IgtlMessage& message) {
    const auto bytes = encode_igtl(message);
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  };
  append(transform(1));
  append({1, "IMAGE", "Ultrasound", 0, std::vector<std::byte>(5000, std::byte{0x42}), {}});
  IgtlMessage second = transform(2);
  second.metadata = {{"TransformStatus", "OK"}, {"x", ""}};
  append(second);
  append({1, "SOMETHING", "", 0, {}, {}});
  append(transform(1));
  for (const std::size_t cut : {std::size_t{1}, std::size_t{57}, std::size_t{58}, std::size_t{700}, stream.size()}) {
    IgtlFramer framer;
    std::vector<IgtlMessage> messages;
    for (std::size_t at = 0; at < stream.size(); at += cut) {
      framer.feed(std::span(stream).subspan(at, std::min(cut, stream.size() - at)));
      while (const auto next = framer.next()) {
        ASSERT_TRUE(std::holds_alternative<IgtlMessage>(*next));
        messages.push_back(std::get<IgtlMessage>(*next));
      }
    }
    ASSERT_EQ(messages.size(), 3U);
    for (const IgtlMessage& message : messages) expect_pose(decode_igtl_transform(message.content));
    EXPECT_EQ(messages[1].metadata, second.metadata);
  }
}

TEST(IgtlFramer, DamageIsNoticedAndOnlyABadHeaderLosesTrack) {
  const auto good = encode_igtl(transform());
  for (std::size_t at = 58; at < good.size(); ++at) {
    auto bad = good;
    bad[at] ^= std::byte{0x04};
    bad.insert(bad.end(), good.begin(), good.end());
    IgtlFramer framer;
    framer.feed(bad);
    EXPECT_EQ(kind_of(framer), "damaged");
    EXPECT_EQ(kind_of(framer), "TRANSFORM");
  }
  struct Case {
    const char* what;
    std::size_t at;
    std::uint8_t value;
    const char* kind;
  };
  const Case cases[] = {{"version 0", 1, 0, "lost"},
                        {"version 3", 1, 3, "lost"},
                        {"type not printable", 2, 1, "lost"},
                        {"no type", 2, 0, "lost"},
                        {"a body of 2^56 bytes", 42, 1, "lost"},
                        {"a body of 16 MB", 46, 1, "lost"},
                        {"a longer body", 49, 49, "more"},
                        {"a wrong CRC", 57, 0, "damaged"},
                        {"a shorter body", 49, 47, "damaged"}};
  for (const Case& c : cases) {
    auto bad = good;
    bad[c.at] = static_cast<std::byte>(c.value);
    if (c.at == 57 && bad == good) bad[c.at] = std::byte{1};
    IgtlFramer framer;
    framer.feed(bad);
    EXPECT_EQ(kind_of(framer), c.kind) << c.what;
  }
}

TEST(IgtlFramer, AVersion2BodyMustHoldWhatItSays) {
  IgtlMessage message = transform(2);
  message.metadata = {{"key", "value"}};
  const auto good = encode_igtl(message);
  // Every byte of the extended header and of the index, changed, with a right CRC: an error or at most other content.
  for (std::size_t at = 58; at < 58 + 12; ++at) {
    auto bad = good;
    bad[at] = std::byte{0xFF};
    const std::uint64_t crc = igtl_crc(std::span(bad).subspan(58));
    for (std::size_t i = 0; i < 8; ++i) bad[50 + i] = static_cast<std::byte>(crc >> (56 - 8 * i) & 0xFFU);
    IgtlFramer framer;
    framer.feed(bad);
    EXPECT_THAT(kind_of(framer), ::testing::AnyOf("damaged", "TRANSFORM")) << at;
  }
}

TEST(IgtlDecoding, MalformedBodiesGiveNoPose) {
  const auto good = encode_igtl_transform(kPose);
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(decode_igtl_transform(std::span(good).first(size)));
  EXPECT_FALSE(decode_igtl_transform(std::vector<std::byte>(48)));                   // zeros
  EXPECT_FALSE(decode_igtl_transform(std::vector<std::byte>(48, std::byte{0xFF})));  // not numbers
  Pose mirrored = kPose;
  mirrored.R.col(0) *= -1.0;
  EXPECT_FALSE(decode_igtl_transform(encode_igtl_transform(mirrored)));
  Pose scaled = kPose;
  scaled.R *= 1.2;
  EXPECT_FALSE(decode_igtl_transform(encode_igtl_transform(scaled)));
  const auto position = encode_igtl_position(kPose);
  for (std::size_t size = 0; size < position.size(); ++size) {
    if (size == 24) continue;  // the form with three components of the quaternion
    EXPECT_FALSE(decode_igtl_position(std::span(position).first(size))) << size;
  }
  EXPECT_FALSE(decode_igtl_position(std::vector<std::byte>(24, std::byte{0xFF})));
  // Three components that are longer than a unit quaternion: 0x3F66 is 0.9.
  std::vector<std::byte> too_long(24);
  for (const std::size_t at : {12U, 16U}) {
    too_long[at] = std::byte{0x3F};
    too_long[at + 1] = std::byte{0x66};
  }
  EXPECT_FALSE(decode_igtl_position(too_long));
  EXPECT_FALSE(decode_igtl_position(std::vector<std::byte>(28)));
  EXPECT_FALSE(decode_igtl_tdata(std::vector<std::byte>(69)));
  EXPECT_FALSE(decode_igtl_tdata(std::vector<std::byte>(70)));
  EXPECT_FALSE(decode_igtl_status(std::vector<std::byte>(29)));
}

}  // namespace
}  // namespace perimap

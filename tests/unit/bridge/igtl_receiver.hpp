// A client as others write it, by libopenigtlink.
#pragma once

#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTimeStamp.h>
#include <igtlTransformMessage.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap::test {

struct IgtlReceived {
  std::string type, device;
  std::int64_t utc_ns = 0;  // 0: no stamp; right to 50 ns
  // POLYDATA
  std::vector<std::array<float, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> vertices;
  std::map<std::string, std::vector<float>> scalars;
  // TRANSFORM
  igtl::Matrix4x4 matrix{};
  // STATUS
  int code = 0;
  std::int64_t sub_code = 0;
  std::string name, words;  // words: of a STRING too
};

class IgtlReceiver {
 public:
  [[nodiscard]] bool connect(int port) {
    socket_ = igtl::ClientSocket::New();
    return socket_->ConnectToServer("127.0.0.1", port) == 0;
  }
  void close() { socket_->CloseSocket(); }
  [[nodiscard]] bool say(const std::string& bytes) {
    return socket_->Send(bytes.data(), static_cast<int>(bytes.size())) != 0;
  }

  // None: nothing came in time, or the server has gone.
  [[nodiscard]] std::optional<IgtlReceived> next(std::chrono::milliseconds patience = std::chrono::seconds(20)) {
    socket_->SetReceiveTimeout(static_cast<int>(patience.count()));
    auto header = igtl::MessageHeader::New();
    header->InitPack();
    if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) return std::nullopt;
    header->Unpack();
    IgtlReceived got;
    got.type = header->GetDeviceType();
    got.device = header->GetDeviceName();
    auto stamp = igtl::TimeStamp::New();
    header->GetTimeStamp(stamp);
    got.utc_ns = std::int64_t{1'000'000'000} * stamp->GetSecond() + stamp->GetNanosecond();
    if (got.type == "POLYDATA") {
      const auto surface = body<igtl::PolyDataMessage>(header);
      if (surface.IsNull()) return std::nullopt;
      take_surface(surface, got);
    } else if (got.type == "TRANSFORM") {
      const auto transform = body<igtl::TransformMessage>(header);
      if (transform.IsNull()) return std::nullopt;
      transform->GetMatrix(got.matrix);
    } else if (got.type == "STATUS") {
      const auto status = body<igtl::StatusMessage>(header);
      if (status.IsNull()) return std::nullopt;
      got.code = status->GetCode();
      got.sub_code = status->GetSubCode();
      got.name = status->GetErrorName();
      got.words = status->GetStatusString();
    } else if (got.type == "STRING") {
      const auto text = body<igtl::StringMessage>(header);
      if (text.IsNull()) return std::nullopt;
      got.words = text->GetString();
    } else {
      ADD_FAILURE() << "a message of type " << got.type;
    }
    return got;
  }

  // The bytes of one message as if they had been received.
  template <class Message>
  static typename Message::Pointer unpacked(const std::string& bytes) {
    auto header = igtl::MessageHeader::New();
    header->InitPack();
    std::memcpy(header->GetPackPointer(), bytes.data(), static_cast<std::size_t>(header->GetPackSize()));
    header->Unpack();
    auto message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    EXPECT_EQ(bytes.size(), static_cast<std::size_t>(message->GetPackSize()));
    std::memcpy(message->GetPackBodyPointer(), bytes.data() + header->GetPackSize(),
                static_cast<std::size_t>(message->GetPackBodySize()));
    EXPECT_TRUE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) << "its check sum";
    return message;
  }

  static void take_surface(const igtl::PolyDataMessage::Pointer& message, IgtlReceived& got) {
    for (int i = 0; i < message->GetPoints()->GetNumberOfPoints(); ++i) {
      std::array<float, 3> point{};
      message->GetPoints()->GetPoint(static_cast<unsigned>(i), point.data());
      got.points.push_back(point);
    }
    for (unsigned i = 0; i < message->GetPolygons()->GetNumberOfCells(); ++i) {
      ASSERT_EQ(message->GetPolygons()->GetCellSize(i), 3U);
      message->GetPolygons()->GetCell(i, got.triangles.emplace_back().data());
    }
    for (unsigned i = 0; i < message->GetVertices()->GetNumberOfCells(); ++i) {
      ASSERT_EQ(message->GetVertices()->GetCellSize(i), 1U);
      message->GetVertices()->GetCell(i, &got.vertices.emplace_back());
    }
    for (int i = 0; i < message->GetNumberOfAttributes(); ++i) {
      igtl::PolyDataAttribute* scalars = message->GetAttribute(static_cast<unsigned>(i));
      EXPECT_EQ(scalars->GetType(), igtl::PolyDataAttribute::POINT_SCALAR);
      auto& values = got.scalars[scalars->GetName()];
      values.resize(scalars->GetSize());
      scalars->GetData(values.data());
    }
    EXPECT_EQ(message->GetLines()->GetNumberOfCells(), 0U);
    EXPECT_EQ(message->GetTriangleStrips()->GetNumberOfCells(), 0U);
  }

 private:
  // Null: it was cut off.
  template <class Message>
  typename Message::Pointer body(const igtl::MessageHeader::Pointer& header) {
    auto message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    const int size = message->GetPackBodySize();
    if (socket_->Receive(message->GetPackBodyPointer(), size) != size) return nullptr;
    EXPECT_TRUE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) << "its check sum";
    return message;
  }

  igtl::ClientSocket::Pointer socket_;
};

}  // namespace perimap::test

// Any bytes from a tracker: every pose that comes out is a pose, stamped before it arrived.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "device_bytes.hpp"
#include "drivers/tracker/igtl_session.hpp"
#include "drivers/tracker/ndi_session.hpp"

namespace perimap {
namespace {

void check(const ToolReading& reading) {
  // What is no figure is none.
  if (!(reading.error_mm >= 0.0 && std::isfinite(reading.error_mm))) std::abort();
  if (reading.state != ToolState::kOk) return;
  const Matrix3d error = reading.X_TO.R.transpose() * reading.X_TO.R - Matrix3d::Identity();
  if (!(error.norm() < 1e-6) || !(reading.X_TO.t.norm() < 1e5)) std::abort();
}

void check(const TrackerSample& sample) {
  if (sample.source_time > sample.arrival) std::abort();
  check(ToolReading{sample.state, sample.X_WS, sample.error_mm});
}

void check(const Expected<NdiTracking>& tracking) {
  if (!tracking) return;
  for (const NdiToolReading& tool : tracking->tools) check(tool.reading);
}

// Answers of an NDI device that bring a session to its stream; then the input.
constexpr std::string_view kAnswers[] = {"OKAY", "OKAY", "device",  "00",   "010A001",
                                         "OKAY", "00",   "010A011", "OKAY", "OKAY"};

}  // namespace
}  // namespace perimap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  if (size < 2) return 0;
  const auto input = std::as_bytes(std::span(data, size)).subspan(2);
  const std::string_view text(reinterpret_cast<const char*>(input.data()), input.size());
  DeviceHealth health;
  const TrackerSink sink = [](const TrackerSample& sample) { check(sample); };
  const ToolSink tools = [](const ToolSample& sample) {
    if (sample.tool > 1) std::abort();
    check(static_cast<const TrackerSample&>(sample));
  };
  std::unique_ptr<DeviceProtocol> protocol;
  ScriptedLink link;
  const Instant now(std::chrono::seconds(1));
  std::vector<std::byte> stream(input.begin(), input.end());
  switch (data[0] % 6) {
    case 0:
      check(decode_bx(input));
      return 0;
    case 1:
      check(decode_bx2(input));
      return 0;
    case 2:
      check(decode_tx(text));
      return 0;
    case 3:
    case 4: {
      NdiSettings settings;
      settings.tools.push_back({{}, 0x0B, "pointer"});
      protocol = std::make_unique<NdiSession>(settings, sink, health, tools);
      protocol->on_open(link, now);
      if (data[0] % 6 == 4) break;
      for (const std::string_view answer : kAnswers) {
        // After INIT it pauses.
        if (answer == "device") protocol->on_time(link, protocol->next_time());
        const std::string framed = ndi_with_crc(answer);
        protocol->on_bytes(link, std::as_bytes(std::span(framed.data(), framed.size())), now);
      }
      // Whole replies around the input: the CRC would keep nearly everything else out.
      stream = {std::byte{0xC4}, std::byte{0xA5}, static_cast<std::byte>(input.size() & 0xFFU),
                static_cast<std::byte>(input.size() >> 8U & 0xFFU)};
      const std::uint16_t header = ndi_crc(stream);
      stream.push_back(static_cast<std::byte>(header & 0xFFU));
      stream.push_back(static_cast<std::byte>(header >> 8U));
      stream.insert(stream.end(), input.begin(), input.end());
      const std::uint16_t body = ndi_crc(input);
      stream.push_back(static_cast<std::byte>(body & 0xFFU));
      stream.push_back(static_cast<std::byte>(body >> 8U));
      break;
    }
    default:
      IgtlSettings settings;
      settings.tools.emplace_back("Pointer");
      protocol = std::make_unique<IgtlSession>(settings, sink, health, tools);
      protocol->on_open(link, now);
      if (data[1] % 4 != 0) {
        static constexpr std::string_view kTypes[] = {"TRANSFORM", "TDATA", "POSITION", "STATUS"};
        IgtlMessage message;
        message.type = kTypes[data[1] / 4 % 4];
        message.content = stream;
        // Many of them in a row, with stamps that begin anywhere and go on by anything.
        std::uint64_t stamp = 0;
        std::memcpy(&stamp, data, std::min<std::size_t>(size, sizeof(stamp)));
        const std::uint64_t step = stamp >> (data[0] % 64U);
        if (data[1] % 8U >= 4) message.device = "Pointer";
        stream.clear();
        for (int i = 0; i < 40; ++i) {
          message.time_stamp = stamp + static_cast<std::uint64_t>(i) * step;
          const auto one = encode_igtl(message);
          stream.insert(stream.end(), one.begin(), one.end());
        }
        // A body of header version 2 holds sizes of its own; the input is all of it.
        if (data[1] % 4 == 3) stream[1] = std::byte{2};
      }
  }
  feed_in_chunks(*protocol, link, now, stream, 1 + data[1] % 64U, std::chrono::milliseconds(data[1] >> 5U));
  return 0;
}

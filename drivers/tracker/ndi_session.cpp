#include "drivers/tracker/ndi_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <utility>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kFastBaud = 115200;
constexpr Duration kReplyTime = seconds(1);
constexpr Duration kLongReplyTime = seconds(6);  // INIT over TCP, TSTART, PINIT
constexpr Duration kResetTime = seconds(1);
constexpr Duration kSettleTime = milliseconds(100);
constexpr Duration kStreamReplyTime = milliseconds(300);
constexpr Duration kQuietTime = milliseconds(20);
constexpr int kMostRetries = 3;
constexpr int kMostSearches = 16;  // a device that always finds a port to initialise does not hold up the start
constexpr std::size_t kBlock = 64;

// "ERROR0C" as the guide explains it, for those that tell a user something.
std::string explain(const std::string& reply) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kMeanings{{
      {"ERROR01", "invalid command"},
      {"ERROR04", "the command's CRC was wrong: a noisy line or the wrong baud rate"},
      {"ERROR05", "time-out in the device"},
      {"ERROR08", "invalid port handle"},
      {"ERROR0C", "not possible in the device's present mode"},
      {"ERROR0D", "no tool is assigned to the port handle"},
      {"ERROR0E", "the port handle is not initialised"},
      {"ERROR10", "the device is not initialised"},
      {"ERROR12", "tracking cannot be started"},
      {"ERROR13", "the port handle cannot be initialised: is the tool definition right?"},
  }};
  for (const auto& [code, meaning] : kMeanings) {
    if (reply.starts_with(code)) return fmt::format("{} ({})", code, meaning);
  }
  return reply.substr(0, 40);
}

std::optional<std::uint16_t> hex(std::string_view digits) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

// Handles of a PHSR reply: count, then per handle two digits and three of status.
std::optional<std::vector<std::string>> handles_of(std::string_view reply) {
  constexpr std::size_t kCount = 2;
  constexpr std::size_t kEach = 5;
  if (reply.size() < kCount) return std::nullopt;
  const auto count = hex(reply.substr(0, kCount));
  if (!count || reply.size() != kCount + *count * kEach) return std::nullopt;
  std::vector<std::string> handles;
  for (std::size_t i = 0; i < *count; ++i) {
    const std::string_view handle = reply.substr(kCount + i * kEach, 2);
    if (!hex(handle)) return std::nullopt;
    handles.emplace_back(handle);
  }
  return handles;
}

// From the reply's first byte to its last.
Duration time_on_line(const NdiReply& reply, const LinkControl& link) {
  constexpr std::size_t kTextFrame = 5;          // CRC, CR
  constexpr std::size_t kBinaryFrame = 8;        // start, length, two CRCs
  constexpr std::size_t kLongestShort = 0xFFFF;  // beyond it the length takes two bytes more
  std::size_t bytes = 0;
  if (const auto* text = std::get_if<NdiText>(&reply)) bytes = text->text.size() + kTextFrame;
  if (const auto* binary = std::get_if<NdiBinary>(&reply)) {
    bytes = binary->body.size() + kBinaryFrame + (binary->body.size() > kLongestShort ? 2 : 0);
  }
  return Duration(std::llround(static_cast<double>(bytes) * link.byte_time_ns()));
}

}  // namespace

NdiSession::NdiSession(NdiSettings settings, TrackerSink sink, DeviceHealth& health, ToolSink tool_sink)
    : settings_(std::move(settings)),
      sink_(std::move(sink)),
      tool_sink_(std::move(tool_sink)),
      health_(health),
      clock_({.period_ns = 1e9 / settings_.frame_rate_hz}),
      rate_(settings_.frame_rate_hz) {
  settings_.world.relative_to_reference = settings_.reference.has_value();
  others_.resize(settings_.tools.size());
}

void NdiSession::on_open(LinkControl& link, Instant now) {
  framer_.restart();
  clock_.reset();
  rate_.restart();
  rate_refused_ = false;  // what is still wrong is told again
  last_frame_.reset();
  disabled_ = false;
  for (OtherTool& other : others_) other = {other.handle, std::nullopt, false};
  reference_told_ = {};
  broken_.clear();
  jumps_.clear();
  jumps_are_reason_ = false;
  health_.set_notice("");
  stride_ = 0;
  query_ = Query::kBx2;
  heard_ = false;
  answered_ = false;
  retries_ = 0;
  searches_ = 0;
  baud_ = NdiSettings::kFirstBaud;
  if (link.serial()) {
    link.send_break();
    step_ = Step::kReset;
    command_ = "a serial break";
    tell_awaited(command_);
    due_ = now + kResetTime;
  } else {
    enter(link, Step::kStop, now);
  }
}

void NdiSession::command(LinkControl& link, const std::string& text, Duration longest, Instant now) {
  command_ = text;
  if (step_ != Step::kStream) tell_awaited(command_name());
  link.send(ndi_with_crc(text));
  due_ = now + longest;
}

void NdiSession::tell_awaited(const std::string& question) {
  health_.set_awaited(heard_ ? fmt::format("it answers, but not yet to {}.", question)
                             : fmt::format("no answer yet to {}; is it switched on?", question));
}

void NdiSession::set_rate(LinkControl& link, int baud) {
  baud_ = baud;
  link.set_line_rate(baud);
}

std::string NdiSession::command_name() const { return command_.substr(0, command_.find(':') + 1); }

void NdiSession::enter(LinkControl& link, Step step, Instant now) {
  step_ = step;
  switch (step) {
    case Step::kStop:
      return command(link, "TSTOP:", kReplyTime, now);
    case Step::kInitialise:
      return command(link, "INIT:", kLongReplyTime, now);
    case Step::kSetRate:
      return command(link, "COMM:50000", kReplyTime, now);
    case Step::kPause:
    case Step::kSettle:
      due_ = now + kSettleTime;
      return;
    case Step::kVersion:
      return command(link, "VER:4", kReplyTime, now);
    case Step::kFindToFree:
      return command(link, "PHSR:01", kReplyTime, now);
    case Step::kRequestPort:
      return command(link, "PHRQ:*********1****", kReplyTime, now);
    case Step::kFindToInitialise:
      return command(link, "PHSR:02", kReplyTime, now);
    case Step::kFindToEnable:
      return command(link, "PHSR:03", kReplyTime, now);
    case Step::kStartTracking:
      return command(link, "TSTART:80", kLongReplyTime, now);
    case Step::kQuiet:
      quiet_until_ = now + kQuietTime;
      due_ = std::min(quiet_until_, next_expectation());
      return;
    case Step::kStream:
      return ask(link, now);
    case Step::kReset:
    case Step::kFree:
    case Step::kUpload:
    case Step::kInitialisePort:
    case Step::kEnablePort:
      return;  // entered with what they are about
  }
}

void NdiSession::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  if (step_ == Step::kQuiet) {
    // Unbroken noise does not put off what is due when no reading comes.
    quiet_until_ = arrival + kQuietTime;
    due_ = std::min(quiet_until_, next_expectation());
    return;
  }
  if (step_ == Step::kSettle || step_ == Step::kPause) return;
  framer_.feed(bytes);
  while (const auto reply = framer_.next()) {
    on_reply(link, *reply, arrival);
    if (step_ == Step::kQuiet) return;
  }
}

void NdiSession::on_reply(LinkControl& link, const NdiReply& reply, Instant arrival) {
  if (const auto* damaged = std::get_if<NdiDamaged>(&reply)) return on_damage(link, damaged->what, arrival);
  heard_ = true;
  on_line_ = time_on_line(reply, link);
  if (const auto* binary = std::get_if<NdiBinary>(&reply)) {
    if (step_ == Step::kStream && query_ == Query::kBx2) return on_tracking(link, decode_bx2(binary->body), arrival);
    if (step_ == Step::kStream && query_ == Query::kBx) return on_tracking(link, decode_bx(binary->body), arrival);
    return on_damage(link, "a binary reply to a command in text", arrival);
  }
  on_text(link, std::get<NdiText>(reply).text, arrival);
}

// Nothing of a damaged reply is used. In the stream the next query will do; before it, the command is given again.
void NdiSession::on_damage(LinkControl& link, const std::string& what, Instant now) {
  health_.damaged.add();
  framer_.restart();
  if (step_ == Step::kStream) {
    ++damaged_;
    damage_ = what;
    // A device may send what it means by BX2 and not what the guide says: the older queries are then worth a try.
    if (!answered_ && query_ != Query::kTx && ++retries_ > kMostRetries) {
      query_ = query_ == Query::kBx2 ? Query::kBx : Query::kTx;
      retries_ = 0;
    }
    return enter(link, Step::kQuiet, now);
  }
  // Bytes of another rate. Of TSTOP only a whole answer says that the rate is right.
  if (step_ == Step::kReset || (step_ == Step::kStop && link.serial())) return;
  // A port that was given and not taken would stay behind, so that is not asked for twice.
  if (step_ == Step::kRequestPort || ++retries_ > kMostRetries) {
    return link.fail(
        fmt::format("replies to {} come damaged; wrong baud rate, a bad line, or another device?", command_));
  }
  command(link, command_, kReplyTime, now);
}

void NdiSession::on_error(LinkControl& link, const std::string& text, Instant now) {
  switch (step_) {
    case Step::kStop:
      // What it heard at another rate stood before the command, which was then not understood.
      if ((text.starts_with("ERROR04") || text.starts_with("ERROR01")) && ++retries_ <= kMostRetries) {
        return command(link, command_, kReplyTime, now);
      }
      return enter(link, Step::kInitialise, now);  // it was not tracking
    case Step::kVersion:
      return enter(link, Step::kFindToFree, now);
    case Step::kStream:
      if (!answered_ && query_ != Query::kTx && !text.starts_with("ERROR04")) {
        query_ = query_ == Query::kBx2 ? Query::kBx : Query::kTx;
        return ask(link, now);
      }
      break;
    default:
      break;
  }
  if (text.starts_with("ERROR04") && ++retries_ <= kMostRetries) return command(link, command_, kReplyTime, now);
  if (step_ == Step::kInitialisePort || step_ == Step::kEnablePort) return on_broken_port(link, explain(text), now);
  link.fail(fmt::format("{} answered with {}", command_, explain(text)));
}

void NdiSession::on_text(LinkControl& link, const std::string& text, Instant now) {
  if (text.starts_with("ERROR")) return on_error(link, text, now);
  if (text == "RESET" && step_ != Step::kReset) return link.fail("the device has restarted");
  const bool okay = text == "OKAY" || text.starts_with("WARNING");
  switch (step_) {
    case Step::kReset:
      if (text == "RESET") enter(link, Step::kInitialise, now);
      return;
    case Step::kStop:
      return enter(link, Step::kInitialise, now);
    case Step::kInitialise:
      if (!okay) break;
      return enter(link, Step::kPause, now);
    case Step::kSetRate:
      if (!okay) break;
      set_rate(link, kFastBaud);
      return enter(link, Step::kSettle, now);
    case Step::kVersion:
      version_ = text.substr(0, text.find('\n'));
      health_.set_identity(version_);
      return enter(link, Step::kFindToFree, now);
    case Step::kFindToFree:
    case Step::kFindToInitialise:
    case Step::kFindToEnable: {
      auto handles = handles_of(text);
      if (!handles) break;
      ports_.assign(handles->rbegin(), handles->rend());  // taken from the end
      std::erase_if(ports_, [this](const std::string& port) {
        return std::any_of(broken_.begin(), broken_.end(), [&](const auto& b) { return b.handle == *hex(port); });
      });
      search_again_ = step_ == Step::kFindToInitialise && !ports_.empty() && ++searches_ < kMostSearches;
      return next_port(link, step_, now);
    }
    case Step::kFree:
      if (!okay) break;
      return next_port(link, Step::kFindToFree, now);
    case Step::kRequestPort: {
      const auto handle = hex(text);
      if (!handle || text.size() != 2) break;
      handle_of(tool_) = *handle;
      port_requested_ = true;
      return next_upload(link, now);
    }
    case Step::kUpload:
      if (!okay) break;
      ++block_;
      return next_upload(link, now);
    case Step::kInitialisePort:
      if (!okay) break;
      return next_port(link, Step::kFindToInitialise, now);
    case Step::kEnablePort:
      if (!okay) break;
      return next_port(link, Step::kFindToEnable, now);
    case Step::kStartTracking:
      if (!okay) break;
      last_reading_ = last_pose_ = now;
      reference_ = {};
      reference_there_ = now;
      damaged_ = 0;
      retries_ = 0;
      return enter(link, Step::kStream, now);
    case Step::kStream:
      if (query_ != Query::kTx) return on_damage(link, "a text in place of a binary reply", now);
      return on_tracking(link, decode_tx(text), now);
    case Step::kPause:
    case Step::kSettle:
    case Step::kQuiet:
      return;
  }
  link.fail(fmt::format("{} answered with '{}'", command_, text.substr(0, 40)));
}

// The next port of this search, or the next step.
void NdiSession::next_port(LinkControl& link, Step search, Instant now) {
  if (!ports_.empty()) {
    const std::string handle = std::move(ports_.back());
    ports_.pop_back();
    if (search == Step::kFindToFree) {
      step_ = Step::kFree;
      return command(link, "PHF:" + handle, kReplyTime, now);
    }
    port_ = *hex(handle);
    if (search == Step::kFindToInitialise) {
      step_ = Step::kInitialisePort;
      return command(link, "PINIT:" + handle, kLongReplyTime, now);
    }
    step_ = Step::kEnablePort;
    enabled_.push_back(port_);
    return command(link, fmt::format("PENA:{}D", handle), kReplyTime, now);
  }
  if (search == Step::kFindToFree) {
    tool_ = 0;
    block_ = 0;
    port_requested_ = false;
    return next_upload(link, now);
  }
  if (search == Step::kFindToInitialise) {
    if (search_again_) return enter(link, Step::kFindToInitialise, now);
    enabled_.clear();
    return enter(link, Step::kFindToEnable, now);
  }
  if (choose_tools(link)) enter(link, Step::kStartTracking, now);
}

// The next block of a definition, the next definition, or on to the initialisation of all ports.
void NdiSession::next_upload(LinkControl& link, Instant now) {
  for (; tool_ < tool_count(); ++tool_, block_ = 0, port_requested_ = false) {
    const NdiTool* tool = tool_settings(tool_);
    if (tool == nullptr || block_ * kBlock >= tool->definition.size()) {
      if (tool != nullptr && tool->definition.empty() && tool->handle) handle_of(tool_) = *tool->handle;
      continue;
    }
    if (!port_requested_) return enter(link, Step::kRequestPort, now);
    std::string text = fmt::format("PVWR:{:02X}{:04X}", handle_of(tool_), block_ * kBlock);
    for (std::size_t i = block_ * kBlock; i < (block_ + 1) * kBlock; ++i) {
      const auto value = i < tool->definition.size() ? std::to_integer<unsigned>(tool->definition[i]) : 0U;
      text += fmt::format("{:02X}", value);
    }
    step_ = Step::kUpload;
    return command(link, text, kReplyTime, now);
  }
  enter(link, Step::kFindToInitialise, now);
}

void NdiSession::ask(LinkControl& link, Instant now) {
  asked_ = now;
  switch (query_) {
    case Query::kBx2:
      return command(link, "BX2:--6d=tools", kStreamReplyTime, now);
    case Query::kBx:
      return command(link, "BX:0801", kStreamReplyTime, now);
    case Query::kTx:
      return command(link, "TX:0801", kStreamReplyTime, now);
  }
}

void NdiSession::on_time(LinkControl& link, Instant now) {
  switch (step_) {
    case Step::kReset:
      // No answer to the break: it may not have got through (some adapters send none), so it is tried without.
      framer_.restart();
      return enter(link, Step::kStop, now);
    case Step::kPause:
      return enter(link, link.serial() && baud_ != kFastBaud ? Step::kSetRate : Step::kVersion, now);
    case Step::kSettle:
      return enter(link, Step::kVersion, now);
    case Step::kStop:
      if (!link.serial()) return enter(link, Step::kInitialise, now);
      if (baud_ == kFastBaud) {
        return link.fail(
            fmt::format("no answer at {} nor at {} baud; is it an NDI tracker, switched on, and at this port?",
                        NdiSettings::kFirstBaud, kFastBaud));
      }
      framer_.restart();
      set_rate(link, kFastBaud);
      return enter(link, Step::kStop, now);
    case Step::kQuiet:
      if (!expect_readings(link, now)) return;
      if (now < quiet_until_) {
        due_ = std::min(quiet_until_, next_expectation());
        return;
      }
      framer_.restart();
      step_ = Step::kStream;
      return ask(link, now);
    case Step::kStream:
      if (!expect_readings(link, now)) return;
      framer_.restart();
      return ask(link, now);
    default:
      link.fail(fmt::format("no answer to {}; is it an NDI tracker, switched on, and at this port?", command_name()));
  }
}

}  // namespace perimap

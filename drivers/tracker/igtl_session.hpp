// An OpenIGTLink client: poses of named tools from a tracker server, such as PLUS or 3D Slicer.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/device/arrival_clock.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/tracker/igtl_message.hpp"
#include "drivers/tracker/stamp_check.hpp"
#include "drivers/tracker/tool_reading.hpp"

namespace perimap {

struct IgtlSettings {
  std::string sensor;                    // device name, or name of a tool in TDATA; empty: the only one that comes
  std::optional<std::string> reference;  // W is its frame
  WorldSettings world;
  std::vector<std::string> tools = {};  // others, likewise
  bool stamps_by_arrival = false;       // the server's stamps are not looked at
};

// TRANSFORM and POSITION of the sensor's name give its pose; so does TDATA with a tool of that name, which is asked for
// at the start (STT_TDATA, every 10 ms) and where a tool that is left out is missing. A message with metadata
// "TransformStatus" (PLUS, 3D Slicer) other than OK says that the tool is missing. A STATUS that is not OK is told.
//
// A tool, sensor or reference, that no message of the connection has named is awaited and not missing: until both are
// there nothing is delivered, and after 2 s the reason tells what the server sends instead. Once there, a sensor of
// which nothing has come for 200 ms while other messages come is missing, at most every 200 ms: TRANSFORM and POSITION
// of header 1 are left out while it is out of sight. The link fails when nothing at all comes for 2 s.
//
// A reference is of the sensor's instant by the server's stamps, whichever is sent first; where no reference has the
// sensor's own stamp, the nearest within 100 ms counts. Without stamps arrivals count in their place.
//
// The reference and the other tools are told to a sink of their own as they come, each with the reference that is
// nearest then. One that TDATA leaves out is missing from when it has come once.
//
// Without a sensor's name the server must send one tool alone, beside the reference: a second one fails the link, and
// after that the server is listened to for a second before one tool counts as the only one.
//
// The protocol has no common clock: stamps are the sender's, fitted to the host's by their arrival; a message without a
// stamp is stamped by its arrival, which the notice says of the sensor's. So is what comes before the stamps have been
// watched for a second (StampCheck); where they are wrong no pose is given, and the reason says what they are.
class IgtlSession final : public DeviceProtocol {
 public:
  IgtlSession(IgtlSettings settings, TrackerSink sink, DeviceHealth& health, ToolSink tool_sink = {});

  void on_open(LinkControl& link, Instant now) override;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override;
  void on_time(LinkControl& link, Instant now) override;
  [[nodiscard]] Instant next_time() const noexcept override;

 private:
  void on_message(LinkControl& link, const IgtlMessage& message, Instant arrival);
  void on_pose(LinkControl& link, const IgtlMessage& message, const Expected<Pose>& pose, Instant arrival);
  void on_tdata(LinkControl& link, const IgtlMessage& message, Instant arrival);
  void note_name(const std::string& name);
  // Whether this is the sensor's name. Without a name from the settings, a second tool fails the link.
  [[nodiscard]] bool is_sensor(LinkControl& link, const std::string& name, Instant arrival);
  // What a message says of one tool.
  struct Told {
    ToolReading reading;
    std::uint64_t stamp = 0;  // 32.32 fixed point, s; 0: none, or not to be looked at
    std::int64_t time_ns = 0;
    Instant arrival;
    std::uint64_t sent_stamp = 0;  // as the server sent it, whatever it is good for
  };
  // Whether the sensor's stamp is wrong, as all are then; tells when that changes.
  [[nodiscard]] bool stamps_wrong(const Told& sensor);
  // Notes a sensor whose messages have none, which nobody said are not to be looked at.
  void note_missing_stamp(const Told& sensor);
  [[nodiscard]] Instant stamped(const Told& told) const noexcept;
  // The same pose with the same stamp: some servers repeat their last message, also while the tool is out of sight. A
  // sensor has noise, so another pose is another reading, whatever its stamp.
  [[nodiscard]] static bool repeats(const Told& told, const Told& before) noexcept;
  // From the earlier to the later of the two, by their stamps where both have one.
  [[nodiscard]] static Duration apart(const Told& a, const Told& b) noexcept;
  // `tool`: as of ToolSample.
  void on_tool(std::size_t tool, const Told& told);
  // The tool that has this name, as of ToolSample; none: it is the sensor, or nobody asked for it.
  [[nodiscard]] std::optional<std::size_t> other_tool(const std::string& name) const;
  void on_sensor(const Told& sensor);
  void on_reference(const Told& reference);
  void deliver(const Told& sensor, const Told& reference);
  void give(const ToolReading& reading, Instant source_time, Instant arrival);
  void on_sign_of_life(Instant arrival);
  [[nodiscard]] bool all_seen() const noexcept { return sensor_seen_ && reference_seen_; }
  [[nodiscard]] bool may_fall_silent() const noexcept;
  // Which tools have not come, and what has.
  [[nodiscard]] std::string awaited() const;
  [[nodiscard]] std::string with_fault(std::string why) const;

  IgtlSettings settings_;
  TrackerSink sink_;
  ToolSink tool_sink_;
  DeviceHealth& health_;
  IgtlFramer framer_;
  ArrivalClock clock_{{.period_ns = 1.0}};
  StampCheck stamps_;
  std::string stamps_told_;        // what is wrong with them
  bool missing_told_ = false;      // that there are none, in this connection
  int stamped_since_missing_ = 0;  // poses
  Told reference_;
  // Servers that send the sensor before the reference of the same instant: the sensor then waits for it.
  bool reference_follows_ = false;
  std::optional<Told> held_;
  std::vector<std::optional<Told>> others_told_;  // in this connection, by ToolSample::tool
  Told delivered_;                                // of the sensor, the last; withheld while the reference is awaited
  // In this connection.
  bool sensor_seen_ = false;
  bool reference_seen_ = false;  // or none is asked for
  std::uint32_t count_ = 0;
  std::uint32_t tool_count_ = 0;    // of what the sink of the other tools was given
  Instant last_{};                  // reading, or the opening
  Instant heard_{};                 // any message that is not damaged, or the opening
  bool absent_ = false;             // nothing comes of the sensor, but other messages do
  bool told_ = false;               // what is awaited
  std::vector<std::string> names_;  // of what poses came of, in this connection
  std::string only_tool_;           // that came first, when the settings name no sensor; no other takes its place later
  bool several_ = false;            // tools have come; of earlier connections too
  Instant listen_until_{};          // for a second tool
  std::string server_fault_;        // the last STATUS that was not OK, in this connection
};

}  // namespace perimap

// An NDI tracker (Polaris, Vega, Aurora) by its Combined API: from the bare link to poses (guides as in ndi_reply.hpp).
//
// Start: serial break, INIT, COMM to 115200 baud (serial); TSTOP, INIT (TCP). A device that does not answer a break, or
// an adapter that sends none, leaves the line at the rate of the last session: TSTOP then finds which, 9600 or 115200
// baud. Then ports that are to be freed are freed, tool definitions uploaded (PHRQ, PVWR), ports initialised (PHSR 02,
// PINIT; again until there is none: a tool of several channels shows its others only then) and enabled (PHSR 03, PENA),
// TSTART. Then BX2 is asked for again and again; where a device has no BX2, BX; where it has neither, TX. A kind of
// reply that comes damaged four times and never whole is given up in the same way.
//
// A port that cannot be initialised or enabled is left alone when nobody asked for its tool, and so is an instrument
// that is not there: the notice says so. The sensor and the reference must be there, and none that was asked for may
// fail.
//
// A frame whose number goes back, or on by far more than the time that has passed, gives no pose: nobody knows when it
// was measured. It is counted and told.
//
// The reference and the other tools are told to a sink of their own, at the instants of their frames.
//
// Frames that come at another rate than the settings say give no sample, since their stamps would be wrong.
//
// What a reply takes on a serial line is taken off its arrival: at 115200 baud some eight milliseconds of a frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/device/arrival_clock.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/device/rate_check.hpp"
#include "drivers/tracker/ndi_reply.hpp"
#include "drivers/tracker/ndi_tracking.hpp"
#include "drivers/tracker/tool_reading.hpp"

namespace perimap {

struct NdiTool {
  std::vector<std::byte> definition;  // a .rom file, uploaded; empty for a tool that describes itself
  std::optional<std::uint16_t>
      handle;             // without a definition: which port handle; none: the only one that is no other's
  std::string name = {};  // in messages, as "pointer"
};

struct NdiSettings {
  static constexpr int kFirstBaud = 9600;

  NdiTool sensor;
  std::optional<NdiTool> reference;
  std::vector<NdiTool> tools = {};  // others, each with a handle or a definition
  WorldSettings world;
  double frame_rate_hz = 60.0;  // of the device's frame numbers
};

// A port that could not be initialised or enabled.
struct NdiBrokenPort {
  std::uint16_t handle = 0;
  std::string why;
};

class NdiSession final : public DeviceProtocol {
 public:
  NdiSession(NdiSettings settings, TrackerSink sink, DeviceHealth& health, ToolSink tool_sink = {});

  void on_open(LinkControl& link, Instant now) override;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override;
  void on_time(LinkControl& link, Instant now) override;
  [[nodiscard]] Instant next_time() const noexcept override { return due_; }

 private:
  enum class Step : std::uint8_t {
    kReset,  // break sent, RESET awaited
    kStop,   // tracking may run from an earlier session
    kInitialise,
    kPause,    // initialised; the device needs a moment
    kSetRate,  // COMM sent
    kSettle,   // the line runs at another rate; the device needs a moment
    kVersion,
    kFindToFree,
    kFree,
    kRequestPort,
    kUpload,
    kFindToInitialise,
    kInitialisePort,
    kFindToEnable,
    kEnablePort,
    kStartTracking,
    kStream,
    kQuiet,  // a damaged reply: what is still coming belongs to it
  };
  enum class Query : std::uint8_t { kBx2, kBx, kTx };

  void enter(LinkControl& link, Step step, Instant now);
  [[nodiscard]] std::string command_name() const;  // of the command under way, without its arguments
  void set_rate(LinkControl& link, int baud);
  void tell_awaited(const std::string& question);
  void command(LinkControl& link, const std::string& text, Duration longest, Instant now);
  void on_reply(LinkControl& link, const NdiReply& reply, Instant arrival);
  void on_text(LinkControl& link, const std::string& text, Instant now);
  void on_damage(LinkControl& link, const std::string& what, Instant now);
  void on_error(LinkControl& link, const std::string& text, Instant now);
  void next_port(LinkControl& link, Step search, Instant now);
  void next_upload(LinkControl& link, Instant now);
  bool choose_tools(LinkControl& link);
  // Of the sensor (0), the reference (1) and the others (from 2 on).
  [[nodiscard]] std::size_t tool_count() const noexcept { return 2 + settings_.tools.size(); }
  [[nodiscard]] const NdiTool* tool_settings(std::size_t tool) const noexcept;  // null: not asked for
  [[nodiscard]] std::uint16_t& handle_of(std::size_t tool) noexcept;
  // The tool that the settings have at this handle, in words; none: nobody asked for it.
  [[nodiscard]] std::optional<std::string> wanted_at(std::uint16_t handle) const;
  // Of the port under way. One that nobody asked for is left alone; otherwise the link fails.
  void on_broken_port(LinkControl& link, const std::string& why, Instant now);
  void tell_notice();
  bool choose_unnamed_sensor(LinkControl& link);
  void ask(LinkControl& link, Instant now);
  void on_tracking(LinkControl& link, const Expected<NdiTracking>& tracking, Instant arrival);
  void deliver(const NdiToolReading& sensor, const ToolReading& reference, Instant arrival);
  [[nodiscard]] bool misnumbered(std::int32_t step, Instant arrival) const noexcept;
  void refuse_number(std::uint32_t frame, std::int32_t step, Instant arrival);
  void deliver_tools(const NdiTracking& tracking, Instant arrival);
  // Whether the session goes on: says that readings have stopped coming, and fails when they stay away.
  bool expect_readings(LinkControl& link, Instant now);
  void hear_reference(const NdiTracking& tracking, Instant arrival);
  // The reference's reading of the frame, or of the nearest within 50 ms.
  [[nodiscard]] ToolReading reference_at(const NdiTracking& tracking, std::uint32_t frame) const noexcept;
  [[nodiscard]] Instant next_expectation() const noexcept;
  // Whether the frames come at the rate that the stamps are made by; tells when that changes.
  bool expect_rate(std::int64_t count, Instant arrival);
  [[nodiscard]] std::string why_no_reading() const;

  NdiSettings settings_;
  TrackerSink sink_;
  ToolSink tool_sink_;
  DeviceHealth& health_;
  ArrivalClock clock_;
  RateCheck rate_;
  bool rate_refused_ = false;
  NdiReplyFramer framer_;
  Step step_ = Step::kReset;
  int baud_ = NdiSettings::kFirstBaud;  // of a serial line
  Instant due_ = kNever;                // of the reply, or of what comes next
  std::string command_;                 // the one under way, for messages
  std::vector<std::string> ports_;      // handles that the step still has to see to
  std::vector<std::uint16_t> enabled_;
  std::string version_;  // as the device told it first
  std::vector<NdiBrokenPort> broken_;
  std::uint16_t port_ = 0;  // under way
  std::size_t tool_ = 0;    // of uploads, as tool_count() counts
  std::size_t block_ = 0;
  bool port_requested_ = false;
  int searches_ = 0;           // for ports to be initialised
  bool search_again_ = false;  // the last found some
  std::uint16_t sensor_handle_ = 0;
  std::uint16_t reference_handle_ = 0;
  struct OtherTool {
    std::uint16_t handle = 0;
    std::optional<std::uint32_t> last_frame;  // none while it is disabled
    bool disabled = false;                    // was told last of it
  };
  std::vector<OtherTool> others_;                // of settings_.tools
  OtherTool reference_told_;                     // to the sink of the tools
  std::optional<std::uint16_t> unnamed_sensor_;  // as it was found at first
  Query query_ = Query::kBx2;
  bool heard_ = false;     // a whole reply, since the link was opened
  bool answered_ = false;  // to this kind of query, at least once
  Instant asked_{};
  Duration on_line_{0};  // the reply under way
  Instant last_reading_{};
  NdiToolReading reference_;   // the last
  Instant reference_there_{};  // not disabled
  Instant quiet_until_{};
  std::uint64_t damaged_ = 0;                // replies since the last whole one
  std::string damage_;                       // of the last of them
  std::optional<std::uint32_t> last_frame_;  // none while the sensor is disabled
  Instant numbered_{};                       // when it came
  bool reply_refused_ = false;               // the one under way, for the number of its frame
  Instant last_pose_{};                      // was given, or the start
  bool jumps_are_reason_ = false;            // why no pose is given
  std::string jumps_;                        // of the frame numbers, in words
  bool disabled_ = false;                    // was told last of the sensor, without a frame
  std::int64_t count_ = 0;                   // of frames, without an end
  std::uint32_t stride_ = 0;                 // device frames from one reading to the next, the least seen
  int retries_ = 0;
};

}  // namespace perimap

#include "daemon/bridge/export/view_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "daemon/bridge/export/view_writer.hpp"
#include "daemon/bridge/messages/view_annotations.hpp"
#include "daemon/bridge/messages/view_camera.hpp"
#include "daemon/bridge/messages/view_layout.hpp"
#include "daemon/bridge/messages/view_names.hpp"
#include "daemon/bridge/messages/view_scene.hpp"
#include "daemon/bridge/messages/view_worth.hpp"
#include "daemon/recordings/published_states.hpp"
#include "daemon/recordings/recording_player.hpp"
#include "daemon/subscribing/any_time.hpp"
#include "daemon/subscribing/shown_surface.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/foxglove_image.hpp"
#include "drivers/recording/recorded_frame.hpp"
#include "drivers/recording/sensor_messages.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostDamage = 5;  // that is told one by one
// What devices gave and what was published are read side by side in such steps.
constexpr Duration kStep = std::chrono::milliseconds(100);

// What holds for a whole recording.
struct Facts {
  std::optional<Duration> utc_minus_monotonic;
  std::string world_frame = "tracker";
  std::optional<CameraModel> lens;
};

// So that surface and camera are both seen.
std::optional<ViewAim> aim_at(const ShownSurface& shown) {
  if (!shown.usable() || !shown.X_WC || shown.features.empty()) return std::nullopt;
  ViewAim aim;
  for (const ShownFeature& feature : shown.features) aim.at += Eigen::Map<const Vector3d>(feature.position_W_mm.data());
  aim.at /= static_cast<double>(shown.features.size());
  const Vector3d way = shown.X_WC->t - aim.at;
  const Vector3d up = -shown.X_WC->R.col(1);
  aim.from = aim.at + 1.6 * way + 0.8 * way.norm() * up;
  return aim;
}

class Exporter {
 public:
  Exporter(std::vector<RecordingPlayer> players, std::string stream, Duration offset, Facts facts, ViewWriter writer)
      : players_(std::move(players)),
        stream_(std::move(stream)),
        offset_(offset),
        facts_(std::move(facts)),
        writer_(std::move(writer)) {}

  Expected<ViewExportSummary> run() {
    Instant begin = players_.back().begin();
    Instant end = players_.back().end();
    for (const RecordingPlayer& player : players_) {
      begin = std::min(begin, player.begin() + offset_of(player));
      end = std::max(end, player.end() + offset_of(player));
    }
    for (Instant at = begin;; at = std::min(end, at + kStep)) {
      for (RecordingPlayer& player : players_) {
        const auto read = player.advance(at - offset_of(player), std::nullopt,
                                         [&](const RecordedMessage& message) { use(player, message); });
        if (!read) return tl::unexpected(read.error());
        if (!error_.message.empty()) return tl::unexpected(error_);
      }
      if (at == end) break;
    }
    if (auto finished = writer_.finish(); !finished) return tl::unexpected(finished.error());
    summary_.world_frame = facts_.world_frame;
    tell_damage();
    return std::move(summary_);
  }

 private:
  // Of the players the first has what devices gave, the last what was published.
  Duration offset_of(const RecordingPlayer& player) const {
    return &player == &players_.back() ? Duration(0) : offset_;
  }

  // An instant of the publisher's clock, or of another that lies so far beside it. None lies before 1970, nor beyond
  // what a viewer's stamp can tell.
  Instant utc(std::int64_t ns, Duration offset = Duration(0)) const {
    constexpr std::int64_t kLast_ns = 4'000'000'000'000'000'000;
    const std::int64_t on_clock = wrapped_sum(ns, offset.count());
    const Duration to_utc = facts_.utc_minus_monotonic.value_or(Duration(0));
    return from_ns(std::clamp<std::int64_t>(wrapped_sum(on_clock, to_utc.count()), 0, kLast_ns));
  }

  template <class T>
  void write(const T& message, Instant at) {
    if (auto written = writer_.write(message, at); !written) error_ = written.error();
  }

  // What cannot be decoded is damaged, or newer than this program: the rest is exported.
  void use(RecordingPlayer& player, const RecordedMessage& message) {
    const RecordingReader& reader = player.reader();
    const Duration offset = offset_of(player);
    if (message.channel == channels::kSurface) {
      const auto surface = reader.decode<perimap_Surface>(message);
      if (surface && stream_ == (*surface)->stream) use_surface(**surface, message.arrival);
    } else if (message.channel == channels::kSurfaceModel) {
      if (auto model = reader.decode<perimap_SurfaceModel>(message)) gate_.take(std::move(*model));
    } else if (message.channel == channels::kSurfaceMesh) {
      if (auto mesh = reader.decode<perimap_SurfaceMesh>(message)) gate_.take(std::move(*mesh));
    } else if (message.channel == channels::kTool) {
      if (const auto tool = reader.decode<perimap_ToolDistance>(message)) gate_.take(**tool);
    } else if (message.channel == channels::kEcgSamples) {
      if (const auto block = reader.decode<perimap_EcgSamples>(message)) use_ecg(**block, offset);
    } else if (message.channel == channels::kTrackerPose) {
      if (const auto pose = reader.decode<perimap_TrackerPose>(message)) use_pose(**pose, offset);
    } else if (message.channel == channels::kCameraImage) {
      use_picture(reader, message, offset);
    }
  }

  void use_picture(const RecordingReader& reader, const RecordedMessage& message, Duration offset) {
    if (!frame_.read(reader, message)) return;
    CameraFrame frame = frame_.as_it_came();
    const Instant at = utc(to_ns(message.source_time), offset);
    frame.stamp.capture = at;
    const std::string name = view_names::kCameraFrame;
    if (!calibrated_) write_calibration(facts_.lens, at);
    // What no viewer knows is shown in grey.
    const bool known =
        frame.format == PixelFormat::kGrey || frame.format == PixelFormat::kYuyv || frame.format == PixelFormat::kUyvy;
    if (frame.format == PixelFormat::kMjpg) {
      write(borrow_compressed_image(frame, name), at);
    } else if (known) {
      write(borrow_raw_image(frame, name), at);
    } else if (const auto grey = frame_.grey()) {
      write(borrow_raw_image(*grey, at, name, packed_), at);
    } else {
      return;
    }
    ++summary_.pictures;
  }

  void use_surface(const perimap_Surface& surface, Instant receipt) {
    if (!facts_.utc_minus_monotonic && surface.release_utc_ns > 0) {
      facts_.utc_minus_monotonic = Duration(wrapped_difference(surface.release_utc_ns, surface.release_time_ns));
    }
    const ShownSurface shown = gate_.show(surface, receipt);
    const Instant valid = utc(surface.valid_time_ns);
    const Instant capture = utc(surface.capture_time_ns);
    ++summary_.surfaces;
    if (shown.usable()) ++summary_.shown;
    if (const auto aim = aim_at(shown)) summary_.aim = aim;
    std::optional<CameraModel> lens = facts_.lens;
    if (shown.X_WC) {
      if (lens) lens = PictureProjector(surface, *lens).lens();
      write_transform(*shown.X_WC, capture, view_names::kCameraFrame);
      write_calibration(lens, capture);
    }
    write(scene_.of(shown, valid, facts_.world_frame, lens), valid);
    write(annotations_.of(surface, shown, gate_, facts_.lens, receipt, capture), capture);
    write(worth_.of(shown, valid), valid);
  }

  void use_ecg(const perimap_EcgSamples& block, Duration offset) {
    if (block.lead_off || block.sample_period_ns <= 0) return;
    std::int64_t ns = block.first_sample_time_ns;
    for (std::uint32_t i = 0; i < block.ecg_mV._length; ++i, ns = wrapped_sum(ns, block.sample_period_ns)) {
      const auto mV = static_cast<double>(block.ecg_mV._buffer[i]);
      if (!std::isfinite(mV)) continue;
      const Instant at = utc(ns, offset);
      write(perimap_view_EcgValue{to_foxglove_time(at), mV}, at);
      ++summary_.ecg_values;
    }
  }

  void use_pose(const perimap_TrackerPose& message, Duration offset) {
    const auto sample = to_tracker_sample(message);
    if (!sample || sample->state != ToolState::kOk) return;
    write_transform(sample->X_WS, utc(message.source_time_ns, offset), view_names::kSensorFrame);
  }

  void write_transform(const Pose& X_WP, Instant at, const char* child) {
    write(borrow_frame_transform(X_WP, at, facts_.world_frame, child), at);
    ++summary_.transforms;
  }

  void write_calibration(const std::optional<CameraModel>& lens, Instant at) {
    if (!lens || calibrated_ == at) return;
    calibrated_ = at;
    write(borrow_camera_calibration(*lens, at, coefficients_), at);
  }

  void tell_damage() {
    std::vector<std::string> damage;
    for (const RecordingPlayer& player : players_) {
      for (const Error& error : player.reader().damage()) damage.push_back(error.message);
    }
    for (std::size_t i = 0; i < std::min(damage.size(), kMostDamage); ++i) summary_.warnings.push_back(damage[i]);
    if (damage.size() > kMostDamage) {
      summary_.warnings.push_back(fmt::format("{} places more are damaged", damage.size() - kMostDamage));
    }
    if (!damage.empty()) summary_.warnings.emplace_back("what is whole was exported");
    if (!facts_.utc_minus_monotonic) {
      summary_.warnings.emplace_back("nothing in the recording tells UTC: its times begin at 1970");
    }
    if (!facts_.lens) {
      summary_.warnings.emplace_back(
          "the recording has no calibration of its camera: nothing is drawn over the picture");
    }
    if (summary_.surfaces == 0) {
      summary_.warnings.emplace_back(
          "there are no surfaces; perimap replay RECORDING --samples SAMPLES makes some, and perimap export-view "
          "RECORDING "
          "OUT --samples SAMPLES exports both");
    }
  }

  std::vector<RecordingPlayer> players_;
  std::string stream_;
  Duration offset_;
  Facts facts_;
  ViewWriter writer_;
  SurfaceGate gate_;
  ViewScene scene_;
  ViewAnnotations annotations_;
  ViewWorth worth_;
  RecordedFrame frame_;
  std::vector<std::uint8_t> packed_;
  std::vector<double> coefficients_;
  std::optional<Instant> calibrated_;  // by the last one that was written
  ViewExportSummary summary_;
  Error error_;  // of the first message that could not be written
};

Expected<std::optional<CameraModel>> read_lens(RecordingReader& reader, const std::string& name) {
  const auto text = reader.attachment(attachments::kCalibration);
  if (!text) return std::optional<CameraModel>();
  const auto lens = parse_calibration(*text, name);
  if (!lens) return tl::unexpected(lens.error());
  return std::optional<CameraModel>(*lens);
}

// Of the publisher where both are there: its UTC is that of the surfaces.
Expected<Facts> read_facts(const ViewExportFiles& files) {
  Facts facts;
  std::vector<std::string> names{files.recording};
  if (!files.samples.empty()) names.push_back(files.samples);
  for (const std::string& name : names) {
    auto reader = RecordingReader::open(name, ReadMode::kWhole);
    if (!reader) return tl::unexpected(reader.error());
    if (name == files.recording) {
      auto lens = read_lens(*reader, name);
      if (!lens) return tl::unexpected(lens.error());
      facts.lens = *lens;
    }
    constexpr std::array<std::string_view, 1> kWanted = {channels::kRecordingInfo};
    if (!reader->select(kWanted)) continue;
    const auto message = reader->next();
    if (!message || !*message) continue;
    const auto info = reader->decode<perimap_RecordingInfo>(**message);
    if (!info) continue;
    if ((*info)->utc_minus_monotonic_ns > 0) facts.utc_minus_monotonic = Duration((*info)->utc_minus_monotonic_ns);
    if ((*info)->world_frame_id[0] != '\0') facts.world_frame = (*info)->world_frame_id;
  }
  return facts;
}

}  // namespace

Expected<ViewExportSummary> export_view(const ViewExportFiles& files, const std::string& generator) {
  std::vector<std::string> names{files.recording};
  if (!files.samples.empty()) names.push_back(files.samples);
  auto players = open_players(names);
  if (!players) return tl::unexpected(players.error());
  const auto states = read_published_states(names.back());
  if (!states) return tl::unexpected(states.error());
  Duration offset{0};
  if (!files.samples.empty()) {
    if (states->stream.empty()) return fail(fmt::format("{}: has no surfaces", files.samples));
    const auto found = offset_to(*states, files.recording);
    if (!found) return tl::unexpected(found.error());
    if (!*found) return fail(fmt::format("{}: holds no surface of a frame of {}", files.samples, files.recording));
    offset = **found;
  }
  auto facts = read_facts(files);
  if (!facts) return tl::unexpected(facts.error());
  auto writer = ViewWriter::create(files.output, generator);
  if (!writer) return tl::unexpected(writer.error());
  auto summary = Exporter(std::move(*players), states->stream, offset, std::move(*facts), std::move(*writer)).run();
  if (!summary) return summary;
  if (auto written = write_text_file(files.layout, view_layout(summary->world_frame, summary->aim)); !written) {
    return tl::unexpected(written.error());
  }
  return summary;
}

}  // namespace perimap

#include "daemon/view/recorded/recorded_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "daemon/publishing/wire_names.hpp"
#include "daemon/view/messages/messages.hpp"
#include "daemon/view/messages/milliseconds.hpp"
#include "daemon/view/recorded/overlay.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/image/jpeg_encoder.hpp"
#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

// After a jump so much of what came before is read: beats and phases of some cycles, a status, a mesh.
constexpr Duration kBefore = std::chrono::seconds(3);
// A page that plays asks for the next instant long before.
constexpr Duration kLongestStep = std::chrono::seconds(2);
// A surface is of a frame of one or two of those that came before it.
constexpr std::size_t kMostPictures = 16;
constexpr int kQuality = 80;
constexpr std::size_t kMostDamage = 3;  // that is told one by one

}  // namespace

Expected<std::unique_ptr<RecordedView>> RecordedView::open(const Files& files, WebServer& server, Say say) {
  std::vector<std::string> names{files.recording};
  if (!files.samples.empty()) names.push_back(files.samples);
  auto players = open_players(names);
  if (!players) return tl::unexpected(players.error());
  auto states = read_published_states(names.back());
  if (!states) return tl::unexpected(states.error());
  if (names.size() > 1 && states->stream.empty()) return fail(fmt::format("{}: has no surfaces", names.back()));
  std::unique_ptr<RecordedView> view(
      new RecordedView(files.recording, std::move(*players), std::move(*states), server, std::move(say)));
  if (names.size() > 1) {
    const auto offset = offset_to(view->states_, files.recording);
    if (!offset) return tl::unexpected(offset.error());
    if (!*offset) return fail(fmt::format("{}: holds no surface of a frame of {}", files.samples, files.recording));
    view->offset_ = **offset;
  }
  view->begin_ = view->players_.back().begin();
  view->end_ = view->players_.back().end();
  for (const RecordingPlayer& player : view->players_) {
    view->begin_ = std::min(view->begin_, player.begin() + view->offset_of(player));
    view->end_ = std::max(view->end_, player.end() + view->offset_of(player));
  }
  view->read_lens();
  view->say_what_is_missing();
  return view;
}

RecordedView::RecordedView(std::string name, std::vector<RecordingPlayer> players, PublishedStates states,
                           WebServer& server, Say say)
    : name_(std::move(name)),
      players_(std::move(players)),
      states_(std::move(states)),
      server_(server),
      say_(std::move(say)) {}

void RecordedView::read_lens() {
  auto reader = RecordingReader::open(name_, ReadMode::kWhole);
  if (!reader) return;
  const auto text = reader->attachment(attachments::kCalibration);
  if (!text) return;  // without one nothing is drawn over the picture
  const auto lens = parse_calibration(*text, name_);
  if (lens) {
    lens_ = *lens;
  } else {
    warnings_.push_back(lens.error().message);
  }
}

void RecordedView::say_what_is_missing() {
  std::vector<Error> damage = states_.damage;
  for (const RecordingPlayer& player : players_) {
    for (const Error& error : player.reader().damage()) {
      const auto same = [&error](const Error& known) { return known.message == error.message; };
      if (std::none_of(damage.begin(), damage.end(), same)) damage.push_back(error);
    }
  }
  if (!damage.empty()) warnings_.push_back("a file is damaged, or was cut off: what is whole is shown");
  for (std::size_t i = 0; i < std::min(damage.size(), kMostDamage); ++i) warnings_.emplace_back(damage[i].message);
  if (damage.size() > kMostDamage) {
    warnings_.push_back(fmt::format("{} places more are damaged", damage.size() - kMostDamage));
  }
  if (states_.stream.empty()) {
    warnings_.push_back(
        fmt::format("{}: has no surfaces; perimap replay {} --samples SAMPLES makes some, and perimap "
                    "view {} --samples SAMPLES shows both",
                    name_, name_, name_));
  }
  for (const std::string& warning : warnings_) say_(warning);
}

RecordedView::Json RecordedView::hello() const {
  const auto seconds = [this](Instant instant) { return to_seconds(instant - begin_); };
  Json spans = Json::array();
  for (const StateSpan& span : states_.spans) {
    spans.push_back({seconds(span.begin), seconds(span.end), name_of(span.state)});
  }
  return {{"kind", "hello"},
          {"mode", "recording"},
          {"name", name_},
          {"length_s", seconds(end_)},
          {"warnings", warnings_},
          {"states", std::move(spans)},
          {"pictures", players_.front().has(channels::kCameraImage)},
          {"statuses", states_.statuses}};
}

void RecordedView::opened(PageId page) { server_.send(page, text_message(hello())); }

Expected<void> RecordedView::said(PageId page, std::string_view text) {
  const auto request = parse_page_request(text);
  if (!request) return tl::unexpected(request.error());
  show(page, *request);
  return {};
}

void RecordedView::show(PageId page, const PageRequest& request) {
  const Instant at = std::clamp(begin_ + from_seconds(request.at_s), begin_, end_);
  const bool goes_on = request.from_here && page_ == page && at >= at_ && at - at_ <= kLongestStep;
  if (!goes_on) {
    teller_.forget();
    shown_.reset();
    pictures_.clear();
  }
  page_ = page;
  at_ = at;
  Json told = Json::array();
  for (RecordingPlayer& player : players_) {
    const Duration offset = offset_of(player);
    const auto from = goes_on ? std::nullopt : std::optional(at - kBefore - offset);
    const auto read =
        player.advance(at - offset, from, [&](const RecordedMessage& message) { use(player, message, told); });
    if (!read) {
      say_(read.error().message);
      told.push_back({{"kind", "damage"}, {"words", read.error().message}});
    }
  }
  if (shown_) told.push_back(teller_.tell(*shown_->surface, shown_->receipt));
  send_picture(page, told);
  told.push_back({{"kind", "at"},
                  {"at_s", to_seconds(at - begin_)},
                  {"at_ms", page_ms(to_ns(at))},
                  {"surface_age_ms", shown_ ? Json(page_ms((at - shown_->receipt).count())) : Json(nullptr)}});
  server_.send(page, text_message(Json{{"kind", "moment"}, {"messages", std::move(told)}}));
}

void RecordedView::use(RecordingPlayer& player, const RecordedMessage& message, Json& told) {
  const RecordingReader& reader = player.reader();
  // What cannot be decoded is damaged, or newer than this program: the rest is shown.
  if (message.channel == channels::kSurface) {
    if (auto surface = reader.decode<perimap_Surface>(message)) use_surface(std::move(*surface), message.arrival, told);
  } else if (message.channel == channels::kSurfaceModel) {
    if (auto model = reader.decode<perimap_SurfaceModel>(message)) teller_.hear(std::move(*model));
  } else if (message.channel == channels::kSurfaceMesh) {
    if (auto mesh = reader.decode<perimap_SurfaceMesh>(message)) teller_.hear(std::move(*mesh));
  } else if (message.channel == channels::kTool) {
    if (const auto tool = reader.decode<perimap_ToolDistance>(message)) teller_.hear(**tool);
  } else if (message.channel == channels::kPhase) {
    const auto phase = reader.decode<perimap_Phase>(message);
    if (phase && states_.stream == (*phase)->stream) told.push_back(phase_json(**phase));
  } else if (message.channel == channels::kStatus) {
    const auto status = reader.decode<perimap_Status>(message);
    if (status && states_.stream == (*status)->stream) told.push_back(status_message_json(**status));
  } else if (message.channel == channels::kEcgSamples) {
    auto block = reader.decode<perimap_EcgSamples>(message);
    if (!block) return;
    block->mutable_value().first_sample_time_ns += offset_of(player).count();
    told.push_back(ecg_json(**block));
  } else if (message.channel == channels::kCameraImage) {
    keep_picture(message);
  }
}

void RecordedView::use_surface(Sample<perimap_Surface> surface, Instant receipt, Json& told) {
  if (states_.stream != surface->stream) return;
  // Of those before the one that is shown the phase alone is drawn.
  if (shown_) {
    const perimap_Surface& before = *shown_->surface;
    told.push_back({{"kind", "past"},
                    {"state", name_of(before.state)},
                    {"valid_ms", page_ms(before.valid_time_ns)},
                    {"phase_rad", before.cardiac_phase_rad},
                    {"phase_deviation_rad", before.cardiac_phase_deviation_rad}});
  }
  shown_.emplace(Shown{std::move(surface), receipt});
}

void RecordedView::keep_picture(const RecordedMessage& message) {
  pictures_[message.sequence] =
      Picture{message, {message.bytes.begin(), message.bytes.end()}, std::string(message.type)};
  if (pictures_.size() > kMostPictures) pictures_.erase(pictures_.begin());
}

// Of the frame that the surface belongs to; without surfaces the last one.
void RecordedView::send_picture(PageId page, Json& told) {
  if (pictures_.empty()) return;
  const auto found = shown_ ? pictures_.find(shown_->surface->frame_sequence) : std::prev(pictures_.end());
  if (found == pictures_.end()) return;
  const Picture& picture = found->second;
  RecordedMessage message = picture.message;
  message.type = picture.type;
  message.channel = channels::kCameraImage;
  message.bytes = picture.bytes;
  if (const auto read = frame_.read(players_.front().reader(), message); !read) return;
  const CameraFrame& frame = frame_.as_it_came();
  PageMessage jpeg{nullptr, true};
  if (frame.format == PixelFormat::kMjpg) {
    jpeg.bytes =
        std::make_shared<const std::string>(reinterpret_cast<const char*>(frame.bytes.data()), frame.bytes.size());
  } else {
    const auto grey = frame_.grey();
    if (!grey) return;
    auto encoded = encode_jpeg(*grey, kQuality);
    if (!encoded) return;
    jpeg.bytes = std::make_shared<const std::string>(std::move(*encoded));
  }
  server_.send(page, jpeg);
  Json overlay = nullptr;
  if (shown_ && lens_)
    overlay = overlay_json(*shown_->surface, teller_.model(), teller_.mesh(), *lens_, shown_->receipt);
  told.push_back({{"kind", "overlay"}, {"frame", found->first}, {"drawn", std::move(overlay)}});
}

}  // namespace perimap

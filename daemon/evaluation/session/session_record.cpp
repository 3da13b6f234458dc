#include "daemon/evaluation/session/session_record.hpp"

#include <fmt/format.h>
#include <perimap_mesh.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "daemon/evaluation/session/published_session.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/recording/sensor_messages.hpp"

namespace perimap {
namespace {

using Key = std::pair<std::string, std::string>;  // source, stream

// What is known of all that is published under any name, until it is told which is meant.
struct Published {
  std::map<Key, PublishedSession> sessions;
  std::map<std::string, std::vector<MeshMoment>> meshes;  // by source: a mesh is of all its streams
  std::vector<Key> order;                                 // as they first came
  WatchStatistics statistics;
  PublishedSession beyond;

  // Beyond so many names none is kept: a file may say anything.
  static constexpr std::size_t kMostStreams = 64;

  PublishedSession& of(const char* source, const char* stream) {
    const Key key(source, stream);
    if (sessions.size() >= kMostStreams && sessions.find(key) == sessions.end()) return beyond;
    const auto [session, is_new] = sessions.try_emplace(key);
    if (is_new) order.push_back(key);
    return session->second;
  }
};

void count(RecordedFile& file, const RecordedMessage& message) {
  auto channel = std::find_if(file.channels.begin(), file.channels.end(),
                              [&message](const auto& known) { return known.name == message.channel; });
  if (channel == file.channels.end()) {
    file.channels.push_back({std::string(message.channel), std::string(message.type), 0, 0, message.arrival, {}});
    channel = file.channels.end() - 1;
  }
  ++channel->messages;
  channel->bytes += message.bytes.size();
  channel->last = message.arrival;
}

// Damaged, or of a newer perimapd: told for each channel, with the first.
struct Unread {
  std::uint64_t messages = 0;
  std::string first;
};

// Of what is published, and of the recording's own facts.
class Reading {
 public:
  Reading(const RecordingReader& reader, Published* published, RecordedFile& file)
      : reader_(reader), published_(published), file_(file) {}

  void use(const RecordedMessage& message) {
    if (message.channel == channels::kRecordingInfo) {
      decode<perimap_RecordingInfo>(message, [this](const perimap_RecordingInfo& info) {
        file_.generator = info.generator;
        file_.description = info.description;
      });
    }
    if (published_ == nullptr) return;
    const Instant receipt = message.arrival;
    if (message.channel == channels::kSurface) {
      decode<perimap_Surface>(message, [&](const perimap_Surface& surface) {
        const SurfaceDigest brief = published_->statistics.add(surface, receipt);
        published_->of(surface.source, surface.stream).add(surface, brief, receipt);
      });
    } else if (message.channel == channels::kPhase) {
      decode<perimap_Phase>(
          message, [&](const perimap_Phase& phase) { published_->of(phase.source, phase.stream).add(phase, receipt); });
    } else if (message.channel == channels::kStatus) {
      decode<perimap_Status>(message, [&](const perimap_Status& status) {
        published_->statistics.add(status);
        published_->of(status.source, status.stream).add(status, receipt);
      });
    } else if (message.channel == channels::kSurfaceMesh) {
      decode<perimap_SurfaceMesh>(message, [&](const perimap_SurfaceMesh& mesh) {
        if (mesh.state != perimap_MESH_THERE) return;
        published_->meshes[mesh.source].push_back(
            {to_seconds(receipt.time_since_epoch()), mesh.leave_one_out_rms_mm, mesh.leave_one_out_nees});
      });
    }
  }

  void tell_unread() const {
    for (const auto& [channel, unread] : unread_) {
      file_.damage.push_back(fmt::format("channel {}: {} messages can not be read, the first: {}", channel,
                                         unread.messages, unread.first));
    }
  }

 private:
  template <class T, class Use>
  void decode(const RecordedMessage& message, Use use) {
    if (const auto sample = reader_.decode<T>(message)) {
      use(**sample);
      return;
    }
    Unread& unread = unread_[std::string(message.channel)];
    if (unread.messages++ == 0) unread.first = reader_.decode<T>(message).error().message;
  }

  const RecordingReader& reader_;
  Published* published_;
  RecordedFile& file_;
  std::map<std::string, Unread> unread_;
};

// `published`: null where nothing that is published is wanted of the file.
Expected<RecordedFile> read_file(const std::string& path, Published* published) {
  auto reader = RecordingReader::open(path, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  RecordedFile file;
  file.path = path;
  Reading reading(*reader, published, file);
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    count(file, **message);
    reading.use(**message);
  }
  for (const Error& error : reader->damage()) file.damage.push_back(error.message);
  reading.tell_unread();
  file.attachments = reader->attachment_names();
  const auto attached = [&](std::string_view name, std::string& place) {
    if (std::find(file.attachments.begin(), file.attachments.end(), name) == file.attachments.end()) return;
    if (auto text = reader->attachment(name)) place = *std::move(text);
  };
  attached(attachments::kConfiguration, file.configuration);
  attached(attachments::kVerification, file.verification);
  return file;
}

bool has_surfaces(const Published& published, const Key& key) {
  const auto session = published.sessions.find(key);
  return session != published.sessions.end() && !session->second.surfaces().empty();
}

// Which of them is meant.
std::optional<Key> choose(const Published& published, const SessionFiles& files) {
  std::optional<Key> chosen;
  for (const Key& key : published.order) {
    if (!has_surfaces(published, key)) continue;
    if (!files.source.empty() && key.first != files.source) continue;
    if (!files.stream.empty() && key.second != files.stream) continue;
    const bool better = chosen && key.first == chosen->first && key.second == "frame";
    if (!chosen || better) chosen = key;
  }
  return chosen;
}

tl::unexpected<Error> nothing_published(const RecordedFile& file, const Published& published) {
  const std::string& path = file.path;
  std::string there;
  for (const auto& [source, stream] : published.order) {
    if (has_surfaces(published, {source, stream}))
      there += fmt::format("{}{}, {}", there.empty() ? "" : "; ", source, stream);
  }
  if (!there.empty()) {
    return fail(path + ": holds no surface of that source and stream; it has " + there);
  }
  return fail(
      path +
      ": holds no published surface: perimap watch --record receives them, perimap replay --samples makes them; "
      "that file is given by --samples");
}

}  // namespace

Expected<SessionRecord> read_session(const SessionFiles& files) {
  std::error_code ignored;
  if (!files.published.empty() && std::filesystem::equivalent(files.recording, files.published, ignored)) {
    return fail(files.published + ": is given twice, as the recording and as its samples");
  }
  Published published;
  std::vector<RecordedFile> read;
  const bool two = !files.published.empty();
  auto first = read_file(files.recording, two ? nullptr : &published);
  if (!first) return tl::unexpected(std::move(first.error()));
  read.push_back(*std::move(first));
  if (two) {
    auto file = read_file(files.published, &published);
    if (!file) return tl::unexpected(std::move(file.error()));
    read.push_back(*std::move(file));
  }
  const std::optional<Key> chosen = choose(published, files);
  if (!chosen) return nothing_published(read.back(), published);

  SessionRecord record = published.sessions.at(*chosen).record();
  record.source = chosen->first;
  record.stream = chosen->second;
  for (const Key& key : published.order) {
    if (key != *chosen && has_surfaces(published, key)) record.other_streams.push_back(key.first + ", " + key.second);
  }
  const double begin_s = published.sessions.at(*chosen).begin_s();
  for (MeshMoment moment : published.meshes[chosen->first]) {
    moment.at_s -= begin_s;
    if (moment.at_s >= 0.0 && moment.at_s <= record.length_s) record.mesh.push_back(moment);
  }
  for (StreamReport& report : published.statistics.totals()) {
    if (report.source == chosen->first && report.stream == chosen->second) record.counts = std::move(report);
  }
  record.files = std::move(read);
  return record;
}

}  // namespace perimap

#include "daemon/evaluation/session/session_record.hpp"

#include <perimap_mesh.h>

#include <algorithm>
#include <map>
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

  PublishedSession& of(const char* source, const char* stream) {
    const Key key(source, stream);
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

// One that cannot be decoded is of a newer perimapd, or damaged: then the file's damage tells.
void use(const RecordingReader& reader, const RecordedMessage& message, Published& published, RecordedFile& file) {
  if (message.channel == channels::kSurface) {
    if (const auto surface = reader.decode<perimap_Surface>(message)) {
      published.statistics.add(**surface, message.arrival);
      published.of((*surface)->source, (*surface)->stream).add(**surface, message.arrival);
    }
  } else if (message.channel == channels::kPhase) {
    if (const auto phase = reader.decode<perimap_Phase>(message)) {
      published.of((*phase)->source, (*phase)->stream).add(**phase, message.arrival);
    }
  } else if (message.channel == channels::kStatus) {
    if (const auto status = reader.decode<perimap_Status>(message)) {
      published.statistics.add(**status);
      published.of((*status)->source, (*status)->stream).add(**status, message.arrival);
    }
  } else if (message.channel == channels::kSurfaceMesh) {
    const auto mesh = reader.decode<perimap_SurfaceMesh>(message);
    if (mesh && (*mesh)->state == perimap_MESH_THERE) {
      published.meshes[(*mesh)->source].push_back(
          {to_seconds(message.arrival.time_since_epoch()), (*mesh)->leave_one_out_rms_mm, (*mesh)->leave_one_out_nees});
    }
  } else if (message.channel == channels::kRecordingInfo) {
    if (const auto info = reader.decode<perimap_RecordingInfo>(message)) {
      file.generator = (*info)->generator;
      file.description = (*info)->description;
    }
  }
}

Expected<RecordedFile> read_file(const std::string& path, Published& published) {
  auto reader = RecordingReader::open(path, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  RecordedFile file;
  file.path = path;
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    count(file, **message);
    use(*reader, **message, published, file);
  }
  for (const Error& error : reader->damage()) file.damage.push_back(error.message);
  file.attachments = reader->attachment_names();
  if (std::find(file.attachments.begin(), file.attachments.end(), attachments::kConfiguration) !=
      file.attachments.end()) {
    if (auto text = reader->attachment(attachments::kConfiguration)) file.configuration = *std::move(text);
  }
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

tl::unexpected<Error> nothing_published(const SessionFiles& files, const Published& published) {
  const std::string& path = files.published.empty() ? files.recording : files.published;
  std::string there;
  for (const auto& [source, stream] : published.order) {
    if (has_surfaces(published, {source, stream})) there += (there.empty() ? "" : "; ") + source + ", " + stream;
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
  Published published;
  std::vector<RecordedFile> read;
  for (const std::string& path : {files.recording, files.published}) {
    if (path.empty()) continue;
    auto file = read_file(path, published);
    if (!file) return tl::unexpected(std::move(file.error()));
    read.push_back(*std::move(file));
  }
  const std::optional<Key> chosen = choose(published, files);
  if (!chosen) return nothing_published(files, published);

  SessionRecord record = published.sessions.at(*chosen).record();
  record.source = chosen->first;
  record.stream = chosen->second;
  for (const Key& key : published.order) {
    if (key != *chosen && has_surfaces(published, key)) record.other_streams.push_back(key.first + ", " + key.second);
  }
  const double begin_s = published.sessions.at(*chosen).begin_s();
  for (MeshMoment moment : published.meshes[chosen->first]) {
    moment.at_s -= begin_s;
    record.mesh.push_back(moment);
  }
  for (StreamReport& report : published.statistics.totals()) {
    if (report.source == chosen->first && report.stream == chosen->second) record.counts = std::move(report);
  }
  record.files = std::move(read);
  return record;
}

}  // namespace perimap

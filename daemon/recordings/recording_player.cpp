#include "daemon/recordings/recording_player.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace perimap {

Expected<RecordingPlayer> RecordingPlayer::open(const std::string& file) {
  auto reader = RecordingReader::open(file, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  const auto times = reader->times();
  if (!times) return fail(fmt::format("{}: has no messages", file));
  return RecordingPlayer(std::move(*reader), *times);
}

bool RecordingPlayer::has(std::string_view channel) const {
  const auto channels = reader_.channels();
  return std::any_of(channels.begin(), channels.end(),
                     [channel](const RecordedChannel& known) { return known.name == channel; });
}

Expected<void> RecordingPlayer::advance(Instant until, std::optional<Instant> from, const Use& use) {
  if (from) {
    reader_.seek(*from);
    next_.reset();
    ended_ = false;
  }
  while (!ended_) {
    if (!next_) {
      auto message = reader_.next();
      if (!message) return tl::unexpected(message.error());
      if (!*message) {
        ended_ = true;
        break;
      }
      next_ = **message;
    }
    if (next_->arrival > until) break;
    if (!from || next_->arrival >= *from) use(*next_);
    next_.reset();
  }
  return {};
}

Expected<std::vector<RecordingPlayer>> open_players(const std::vector<std::string>& files) {
  std::vector<RecordingPlayer> players;
  for (const std::string& file : files) {
    auto player = RecordingPlayer::open(file);
    if (!player) return tl::unexpected(player.error());
    players.push_back(std::move(*player));
  }
  return players;
}

}  // namespace perimap

// A recording read to an instant, forwards or from elsewhere.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

// Of a damaged recording what is whole.
class RecordingPlayer {
 public:
  using Use = std::function<void(const RecordedMessage&)>;

  // Fails when it cannot be read, or has no message.
  [[nodiscard]] static Expected<RecordingPlayer> open(const std::string& file);

  [[nodiscard]] const RecordingReader& reader() const noexcept { return reader_; }
  [[nodiscard]] bool has(std::string_view channel) const;
  [[nodiscard]] Instant begin() const noexcept { return times_.first; }
  [[nodiscard]] Instant end() const noexcept { return times_.second; }

  // Gives each message that arrived until then: those after the last call's, or from `from` on. They are valid during
  // the call of `use`.
  [[nodiscard]] Expected<void> advance(Instant until, std::optional<Instant> from, const Use& use);

 private:
  RecordingPlayer(RecordingReader reader, std::pair<Instant, Instant> times)
      : reader_(std::move(reader)), times_(std::move(times)) {}

  RecordingReader reader_;
  std::pair<Instant, Instant> times_;
  std::optional<RecordedMessage> next_;  // read, and later than was asked for
  bool ended_ = false;
};

// One of each file. Fails with the first that fails.
[[nodiscard]] Expected<std::vector<RecordingPlayer>> open_players(const std::vector<std::string>& files);

}  // namespace perimap

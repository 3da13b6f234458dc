// Reads an MCAP file, by its index where it has one, by scanning where it has not (a recording that was cut off).
//
// Nothing in the file is trusted: lengths are held against what is left of the file before anything is allocated, every
// CRC is checked, a chunk is examined whole before its first message is given out.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/recording/byte_source.hpp"
#include "drivers/recording/mcap_format.hpp"

namespace perimap {

enum class ReadMode {
  kStrict,  // any damage is an error
  kWhole    // gives all that is whole, and keeps a list of what was not
};

// Errors have the form "byte N: what is wrong", N counted from the start of the file.
class McapReader {
 public:
  // Fails in both modes when the file does not start as MCAP or cannot be read at all.
  [[nodiscard]] static Expected<McapReader> open(std::unique_ptr<ByteSource> source, ReadMode mode);
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) noexcept;
  ~McapReader();

  // By id. Complete after open() when the file has a summary or was scanned, which is so for all but files of other
  // writers that leave channels out of their summary; those become known as their chunks are read.
  [[nodiscard]] const std::map<std::uint16_t, McapSchema>& schemas() const noexcept;
  [[nodiscard]] const std::map<std::uint16_t, McapChannel>& channels() const noexcept;

  // The next message in the order of the file, nullopt at its end. One chunk is in memory at a time; the message's data
  // is valid until the next call.
  [[nodiscard]] Expected<std::optional<McapMessage>> next();
  // Where in the file the last message is: the start of its chunk.
  [[nodiscard]] std::uint64_t position() const noexcept;

  // Starts over from the first message and gives only those of these channels (nullopt: all). Chunks without any of
  // them are not read, where the index tells; the CRC over the whole data section is then left out.
  void select(std::optional<std::set<std::uint16_t>> channel_ids);

  // Goes on with the first chunk that has a message logged then or later; its first ones may be earlier. What is
  // selected stays; the CRC over the whole data section is left out.
  void seek(std::uint64_t log_time_ns);
  // Of all messages, as the index has them.
  [[nodiscard]] mcap::LogTimes times() const noexcept;

  [[nodiscard]] std::vector<std::string> attachment_names() const;
  // The first of that name.
  [[nodiscard]] Expected<McapAttachment> read_attachment(std::string_view name);

  // With ReadMode::kWhole: what was found damaged so far. Complete once next() has given nullopt.
  [[nodiscard]] const std::vector<Error>& damage() const noexcept;

 private:
  class Impl;
  explicit McapReader(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace perimap

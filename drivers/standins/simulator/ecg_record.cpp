#include "drivers/standins/simulator/ecg_record.hpp"

#include <zlib.h>

#include <array>
#include <span>

#include "drivers/standins/simulator/embedded_data.hpp"
#include "drivers/text_file/csv.hpp"

namespace perimap {
namespace {

Expected<std::vector<unsigned char>> gunzip(std::string_view name, std::span<const unsigned char> packed) {
  z_stream stream{};
  constexpr int kGzipWrapper = 16;
  if (inflateInit2(&stream, MAX_WBITS + kGzipWrapper) != Z_OK) return fail("zlib did not start");
  std::vector<unsigned char> out;
  std::array<unsigned char, 65536> piece{};
  // zlib only reads through next_in; its type says so when ZLIB_CONST is defined, which Debian's default lacks.
  stream.next_in = const_cast<unsigned char*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  int status = Z_OK;
  while (status == Z_OK) {
    stream.next_out = piece.data();
    stream.avail_out = static_cast<uInt>(piece.size());
    status = inflate(&stream, Z_NO_FLUSH);
    out.insert(out.end(), piece.data(), stream.next_out);
  }
  const auto consumed = packed.size() - stream.avail_in;
  inflateEnd(&stream);
  if (status != Z_STREAM_END)
    return fail("ECG record " + std::string(name) + ": damaged gzip data at byte " + std::to_string(consumed));
  return out;
}

}  // namespace

std::string ecg_record_names() {
  std::string names;
  for (const EmbeddedEcgRecord& record : embedded_ecg_records()) {
    if (!names.empty()) names += ", ";
    names += record.name;
  }
  return names;
}

Expected<EcgRecord> load_ecg_record(std::string_view name) {
  for (const EmbeddedEcgRecord& embedded : embedded_ecg_records()) {
    if (embedded.name != name) continue;
    EcgRecord record;
    record.name = name;
    record.sample_rate_hz = embedded.sample_rate_hz;
    record.counts_per_mV = embedded.counts_per_mV;
    const auto bytes = gunzip(name, embedded.samples_gz);
    if (!bytes) return tl::unexpected(bytes.error());
    if (bytes->size() % 2 != 0) return fail("ECG record " + record.name + ": its last sample is cut");
    record.samples.reserve(bytes->size() / 2);
    for (std::size_t i = 0; i + 1 < bytes->size(); i += 2)
      record.samples.push_back(static_cast<std::int16_t>((*bytes)[i] | ((*bytes)[i + 1] << 8)));

    CsvCursor rows(record.name + "_beats.csv", embedded.beats_csv);
    if (!rows.next_line()) return rows.wrong("the table is empty");
    while (rows.next_line()) {
      static_cast<void>(rows.field());  // time, which the sample index gives more exactly
      static_cast<void>(rows.field());  // kind of beat: every kind moves the heart
      const auto sample = rows.number<std::uint32_t>();
      if (!sample) return tl::unexpected(sample.error());
      if (*sample >= record.samples.size()) return rows.wrong("the beat lies behind the record's end");
      if (!record.beat_samples.empty() && *sample <= record.beat_samples.back())
        return rows.wrong("the beats do not ascend");
      record.beat_samples.push_back(*sample);
    }
    return record;
  }
  return fail("there is no ECG record '" + std::string(name) + "'; choose one of " + ecg_record_names());
}

}  // namespace perimap

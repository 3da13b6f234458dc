// WFDB records, the format of PhysioNet: a header (.hea) that describes signals, and files that hold their samples.
//
// After "WFDB Applications Guide", header(5) and signal(5), PhysioNet. Read are records of one segment with signals of
// formats 212 (two 12-bit samples in three bytes) and 16 (little-endian), one sample a frame:
//
//   100 2 360 650000                               record, signals, frames/s, frames
//   100.dat 212 200 11 1024 995 -22131 0 MLII      file, format, counts/mV, bits, zero, first value, checksum, block
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap {

struct WfdbSignal {
  std::string file;
  int format = 0;  // 16 or 212
  std::size_t byte_offset = 0;
  double gain = 200.0;  // counts a mV
  int baseline = 0;     // counts at 0 mV
  bool has_checksum = false;
  int checksum = 0;  // of all its samples, modulo 2^16
  std::string description;
};

struct WfdbHeader {
  double rate_hz = 250.0;
  std::size_t frames = 0;  // 0: as many as there are
  std::vector<WfdbSignal> signals;
};

// Errors: "NAME:LINE: what is wrong".
[[nodiscard]] Expected<WfdbHeader> parse_wfdb_header(std::string_view text, const std::string& name);

// The samples of one signal, from the bytes of its file. Errors: "NAME: byte N: what is wrong".
[[nodiscard]] Expected<EcgTrace> decode_wfdb_signal(const WfdbHeader& header, std::size_t signal,
                                                    std::span<const std::uint8_t> bytes, const std::string& name);

// The header and the files of samples that it names; only the header where it cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> wfdb_files(const std::string& header_file);

// Reads header and samples. `signal` counts from 1.
[[nodiscard]] Expected<EcgTrace> read_wfdb(const std::string& header_file, int signal);

}  // namespace perimap

// WFDB records, the format of PhysioNet: a header (.hea) that describes signals, and files that hold their samples.
//
// After "WFDB Applications Guide", header(5) and signal(5), PhysioNet. Read are records of one segment with signals of
// formats 212 (two 12-bit samples in three bytes), 16, 24 and 32 (little-endian), 61 (16 bits, big-endian) and 80 (8
// bits, offset binary), one or several samples a frame:
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
  int format = 0;
  std::size_t samples_a_frame = 1;
  std::size_t skew = 0;  // its first sample belongs to the frame of that number
  std::size_t byte_offset = 0;
  double gain = 200.0;  // counts a unit
  std::string units = "mV";
  int baseline = 0;  // counts at 0
  bool has_checksum = false;
  int checksum = 0;  // of all its samples, modulo 2^16; 0 is written where it is not known as well, and not checked
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

// Which signal of a record is meant: its number, from 1, or what the header calls it, in letters of any size. Without
// either the first that the header calls a lead of an ECG; else the first whose name is that of nothing else. Gives its
// index. Errors name what there is.
[[nodiscard]] Expected<std::size_t> choose_wfdb_signal(const WfdbHeader& header, const std::string& wanted,
                                                       const std::string& name);

struct WfdbTrace {
  EcgTrace trace;
  int signal = 0;           // that was read, from 1
  std::string description;  // of it
};

// Reads header and samples; `signal` as for choose_wfdb_signal. Files of samples lie where the header says, in its
// folder or below, or beside it.
[[nodiscard]] Expected<WfdbTrace> read_wfdb(const std::string& header_file, const std::string& signal);

}  // namespace perimap

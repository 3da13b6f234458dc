// The simulator's data files (drivers/standins/simulator/data), linked into the program.
#pragma once

#include <span>
#include <string_view>

namespace perimap {

struct EmbeddedEcgRecord {
  std::string_view name;  // of the record in its database, such as "100"
  double sample_rate_hz;
  double counts_per_mV;
  std::span<const unsigned char> samples_gz;  // gzip of int16 little-endian
  std::string_view beats_csv;                 // time_s,symbol,sample
};

[[nodiscard]] std::string_view embedded_epicardium_fourier_csv() noexcept;
[[nodiscard]] std::string_view embedded_epicardium_faces_csv() noexcept;
[[nodiscard]] std::span<const EmbeddedEcgRecord> embedded_ecg_records() noexcept;

}  // namespace perimap

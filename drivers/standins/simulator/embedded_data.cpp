#include "drivers/standins/simulator/embedded_data.hpp"

#include <array>

// The assembler copies each file in as it is; CMake gives the folder and makes this file depend on the data.
// clang-format off
// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define PERIMAP_EMBED(symbol, file)                                       \
  __asm__(".pushsection .rodata\n"                                        \
          ".balign 16\n"                                                  \
          #symbol "_begin:\n"                                             \
          ".incbin \"" PERIMAP_SIMULATOR_DATA "/" file "\"\n"             \
          #symbol "_end:\n"                                               \
          ".byte 0\n"                                                     \
          ".popsection\n");                                               \
  extern "C" const char symbol##_begin[] __attribute__((visibility("hidden"))); \
  extern "C" const char symbol##_end[] __attribute__((visibility("hidden")))

PERIMAP_EMBED(perimap_epicardium_fourier, "epi_fourier_H4.csv");
PERIMAP_EMBED(perimap_epicardium_faces, "epi_faces.csv");
PERIMAP_EMBED(perimap_ecg_100, "100_ch0_200perMV_360Hz.i16.gz");
PERIMAP_EMBED(perimap_ecg_105, "105_ch0_200perMV_360Hz.i16.gz");
PERIMAP_EMBED(perimap_ecg_106, "106_ch0_200perMV_360Hz.i16.gz");
PERIMAP_EMBED(perimap_ecg_119, "119_ch0_200perMV_360Hz.i16.gz");
PERIMAP_EMBED(perimap_ecg_123, "123_ch0_200perMV_360Hz.i16.gz");
PERIMAP_EMBED(perimap_beats_100, "100_beats.csv");
PERIMAP_EMBED(perimap_beats_105, "105_beats.csv");
PERIMAP_EMBED(perimap_beats_106, "106_beats.csv");
PERIMAP_EMBED(perimap_beats_119, "119_beats.csv");
PERIMAP_EMBED(perimap_beats_123, "123_beats.csv");
PERIMAP_EMBED(perimap_ecg_03700181, "03700181_ch0_10000perMV_500Hz.i16.gz");
PERIMAP_EMBED(perimap_beats_03700181, "03700181_beats.csv");
// clang-format on

namespace perimap {
namespace {

std::string_view text(const char* begin, const char* end) noexcept {
  return {begin, static_cast<std::size_t>(end - begin)};
}

std::span<const unsigned char> bytes(const char* begin, const char* end) noexcept {
  return {reinterpret_cast<const unsigned char*>(begin), static_cast<std::size_t>(end - begin)};
}

}  // namespace

std::string_view embedded_epicardium_fourier_csv() noexcept {
  return text(perimap_epicardium_fourier_begin, perimap_epicardium_fourier_end);
}

std::string_view embedded_epicardium_faces_csv() noexcept {
  return text(perimap_epicardium_faces_begin, perimap_epicardium_faces_end);
}

std::span<const EmbeddedEcgRecord> embedded_ecg_records() noexcept {
  // MIT-BIH Arrhythmia Database: 360 Hz, 200 counts a mV. The bedside monitor: 500 Hz.
  static const std::array<EmbeddedEcgRecord, 6> records{{
      {"100", 360.0, 200.0, bytes(perimap_ecg_100_begin, perimap_ecg_100_end),
       text(perimap_beats_100_begin, perimap_beats_100_end)},
      {"105", 360.0, 200.0, bytes(perimap_ecg_105_begin, perimap_ecg_105_end),
       text(perimap_beats_105_begin, perimap_beats_105_end)},
      {"106", 360.0, 200.0, bytes(perimap_ecg_106_begin, perimap_ecg_106_end),
       text(perimap_beats_106_begin, perimap_beats_106_end)},
      {"119", 360.0, 200.0, bytes(perimap_ecg_119_begin, perimap_ecg_119_end),
       text(perimap_beats_119_begin, perimap_beats_119_end)},
      {"123", 360.0, 200.0, bytes(perimap_ecg_123_begin, perimap_ecg_123_end),
       text(perimap_beats_123_begin, perimap_beats_123_end)},
      {"03700181", 500.0, 10000.0, bytes(perimap_ecg_03700181_begin, perimap_ecg_03700181_end),
       text(perimap_beats_03700181_begin, perimap_beats_03700181_end)},
  }};
  return records;
}

}  // namespace perimap

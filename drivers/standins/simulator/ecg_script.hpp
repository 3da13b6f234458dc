// The ECG of a session: a stretch of a record, or with a procedure stretches of several, one after the other.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/procedure/procedure.hpp"
#include "drivers/standins/simulator/ecg_record.hpp"

namespace perimap {

// Samples are counted from the session's start.
class EcgScript {
 public:
  // Of a record from one of its samples on, to its end.
  static EcgScript plain(EcgRecord record, std::uint32_t first_sample);

  // Likewise, with an ectopic run in the place of the record for each such event of the procedure, and from its
  // beginning again where it ends. One stretch ends and another begins in the middle of the rest between two beats, and
  // the second comes level with the first. `seed` draws which stretch of the other record it is. `length`: of the
  // session. Errors name a record that can not be used.
  static Expected<EcgScript> with_runs(EcgRecord record, std::uint32_t first_sample, const Procedure& procedure,
                                       Duration length, std::uint64_t seed);

  [[nodiscard]] double sample_rate_hz() const noexcept { return pieces_.front().record->sample_rate_hz; }
  [[nodiscard]] Instant time_of(Instant start, std::int64_t sample) const noexcept {
    return start + from_seconds(static_cast<double>(sample) / sample_rate_hz());
  }
  [[nodiscard]] float mV(std::int64_t sample) const;
  // Of every R peak, ascending, from before the session's start to after its end.
  [[nodiscard]] const std::vector<std::int64_t>& beats() const noexcept { return beats_; }

 private:
  struct Piece {
    std::shared_ptr<const EcgRecord> record;
    std::int64_t begin = 0;  // in the session; ends where the next begins
    std::int64_t from = 0;   // of the record, at its beginning
    float lift_mV = 0.0F;    // to come level with the one before, at its beginning
  };
  class Splicing;

  [[nodiscard]] const Piece& piece_at(std::int64_t sample) const noexcept;

  std::vector<Piece> pieces_;
  std::vector<std::int64_t> beats_;
};

}  // namespace perimap

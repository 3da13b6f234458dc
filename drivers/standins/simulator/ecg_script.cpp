#include "drivers/standins/simulator/ecg_script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kRunStream = 0x656374;
// Between an R peak and the next: behind the T wave and before the P wave.
constexpr double kRest = 0.6;

// The first place from `sample` on where a record may be left or entered.
std::int64_t cut_from(const EcgRecord& record, std::int64_t sample) {
  const auto& beats = record.beat_samples;
  for (std::size_t i = 0; i + 1 < beats.size(); ++i) {
    if (beats[i + 1] <= sample) continue;
    const auto cut = static_cast<std::int64_t>(beats[i] + kRest * (beats[i + 1] - beats[i]));
    if (cut >= sample) return cut;
  }
  return std::numeric_limits<std::int64_t>::max();
}

constexpr std::size_t kMargin = 8;  // beats that a stretch keeps off a record's end

// Beats that come early, among those of a stretch.
int early_beats(const EcgRecord& record, std::int64_t from, std::int64_t to) {
  constexpr double kEarly = 0.8;
  const auto& beats = record.beat_samples;
  int early = 0;
  for (std::size_t i = 2; i < beats.size(); ++i) {
    if (beats[i] < from || beats[i] >= to) continue;
    const double now = beats[i] - beats[i - 1], before = beats[i - 1] - beats[i - 2];
    early += now < kEarly * before ? 1 : 0;
  }
  return early;
}

}  // namespace

EcgScript EcgScript::plain(EcgRecord record, std::uint32_t first_sample) {
  EcgScript script;
  const auto first = static_cast<std::int64_t>(first_sample);
  for (const std::uint32_t beat : record.beat_samples) script.beats_.push_back(static_cast<std::int64_t>(beat) - first);
  script.pieces_.push_back({std::make_shared<const EcgRecord>(std::move(record)), 0, first});
  return script;
}

// Puts a script together, from its beginning.
class EcgScript::Splicing {
 public:
  Splicing(std::shared_ptr<const EcgRecord> base, std::int64_t first, std::uint64_t seed)
      : base_(std::move(base)), noise_(seed, kRunStream) {
    script_.pieces_.push_back({base_, 0, first});
    for (const std::uint32_t beat : base_->beat_samples) {
      if (beat < first) script_.beats_.push_back(static_cast<std::int64_t>(beat) - first);
    }
  }

  // The record goes on until its first cut from `sample` of the session on; from its beginning again where it ends.
  void go_on(std::int64_t sample) {
    for (;;) {
      const Piece& piece = script_.pieces_.back();
      const std::int64_t cut = cut_from(*piece.record, piece.from + sample - piece.begin);
      if (cut != std::numeric_limits<std::int64_t>::max()) {
        end_at(cut);
        return;
      }
      const auto& beats = piece.record->beat_samples;
      end_at(cut_from(*piece.record, beats[beats.size() - 2]));
      enter(base_, cut_from(*base_, base_->beat_samples[1]));
    }
  }

  // A stretch of `other` in its place, and back.
  void run(const std::shared_ptr<const EcgRecord>& other, std::int64_t length) {
    constexpr int kTried = 20;
    const Piece left = script_.pieces_.back();
    const std::int64_t back = left.from + end_ - left.begin;
    const auto& beats = other->beat_samples;
    const std::int64_t last = beats[beats.size() - kMargin] - length;
    std::int64_t best = cut_from(*other, beats[1]);
    for (int i = 0; i < kTried; ++i) {
      const auto from = static_cast<std::int64_t>(noise_.uniform(index_++, beats[1], static_cast<double>(last)));
      const std::int64_t cut = cut_from(*other, from);
      if (early_beats(*other, cut, cut + length) > early_beats(*other, best, best + length)) best = cut;
    }
    enter(other, best);
    end_at(cut_from(*other, best + length));
    enter(base_, back);
  }

  // With some beats beyond the session.
  EcgScript finish(std::int64_t session_end) {
    constexpr std::int64_t kBeyond_s = 20;
    go_on(session_end + kBeyond_s * static_cast<std::int64_t>(base_->sample_rate_hz));
    return std::move(script_);
  }

 private:
  void end_at(std::int64_t cut) {
    const Piece& piece = script_.pieces_.back();
    end_ = piece.begin + cut - piece.from;
    for (const std::uint32_t beat : piece.record->beat_samples) {
      if (beat >= piece.from && beat < cut) script_.beats_.push_back(piece.begin + beat - piece.from);
    }
  }

  void enter(const std::shared_ptr<const EcgRecord>& record, std::int64_t from) {
    const float before = script_.mV(end_ - 1);
    script_.pieces_.push_back({record, end_, from, before - record->mV(static_cast<std::size_t>(from))});
  }

  std::shared_ptr<const EcgRecord> base_;
  CounterNoise noise_;
  std::uint64_t index_ = 0;
  EcgScript script_;
  std::int64_t end_ = 0;  // of the last piece, in the session
};

Expected<EcgScript> EcgScript::with_runs(EcgRecord record, std::uint32_t first_sample, const Procedure& procedure,
                                         Duration length, std::uint64_t seed) {
  const double rate_hz = record.sample_rate_hz;
  std::shared_ptr<const EcgRecord> other;
  if (procedure.has<EctopicRun>()) {
    auto loaded = load_ecg_record(record.name == "119" ? "106" : "119");
    if (!loaded) return tl::unexpected(loaded.error());
    if (loaded->sample_rate_hz != rate_hz) {
      return fail(fmt::format("ectopic-run: expected an ECG record of {} Hz, as {} is, got {} of {} Hz",
                              loaded->sample_rate_hz, loaded->name, record.name, rate_hz));
    }
    const auto& beats = loaded->beat_samples;
    const double most_s = (beats[beats.size() - kMargin] - beats[kMargin]) / rate_hz;
    for (const ProcedureEvent& event : procedure.events) {
      if (std::holds_alternative<EctopicRun>(event.what) && to_seconds(event.length) > most_s) {
        return fail(fmt::format("ectopic-run: expected at most {:.0f} s, got {}", most_s, to_seconds(event.length)));
      }
    }
    other = std::make_shared<const EcgRecord>(*std::move(loaded));
  }
  const auto samples = [rate_hz](Duration d) { return static_cast<std::int64_t>(to_seconds(d) * rate_hz); };
  Splicing splicing(std::make_shared<const EcgRecord>(std::move(record)), first_sample, seed);
  for (const ProcedureEvent& event : procedure.events) {
    if (!std::holds_alternative<EctopicRun>(event.what)) continue;
    splicing.go_on(samples(event.at));
    splicing.run(other, samples(event.length));
  }
  return splicing.finish(samples(length));
}

const EcgScript::Piece& EcgScript::piece_at(std::int64_t sample) const noexcept {
  const auto after = std::upper_bound(pieces_.begin(), pieces_.end(), sample,
                                      [](std::int64_t value, const Piece& piece) { return value < piece.begin; });
  return after == pieces_.begin() ? *after : *(after - 1);
}

float EcgScript::mV(std::int64_t sample) const {
  constexpr double kLevels_s = 0.4;  // in this time the lift falls to 1/e
  const Piece& piece = piece_at(sample);
  const float mV = piece.record->mV(static_cast<std::size_t>(piece.from + sample - piece.begin));
  if (piece.lift_mV == 0.0F) return mV;
  const double since_s = static_cast<double>(sample - piece.begin) / piece.record->sample_rate_hz;
  return mV + piece.lift_mV * static_cast<float>(std::exp(-since_s / kLevels_s));
}

}  // namespace perimap

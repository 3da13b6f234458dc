#include "daemon/evaluation/ecg/ecg_analysis.hpp"

#include <cmath>
#include <memory>
#include <optional>

#include "core/phase/beat_finder.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

constexpr std::size_t kProgressEvery = 1 << 14;

// Each method as the clock would use it.
class Predictions {
 public:
  void take(AnalysedBeat& beat) {
    for (std::size_t i = 0; i < kPredictionMethods.size(); ++i) {
      CardiacClockTracker& tracker = *trackers_[i];
      tracker.on_r_peak(beat.peak);
      if (tracker.clock().anchor() != beat.peak.time) continue;  // refused
      beat.predicted_rr_s[i] = to_seconds(tracker.clock().predicted_length());
    }
  }
  void interrupt() {
    for (const auto& tracker : trackers_) tracker->interrupt();
  }
  [[nodiscard]] Rhythm rhythm() const { return trackers_.back()->clock().rhythm(); }

 private:
  static std::unique_ptr<CardiacClockTracker> tracker(RrMethod method) {
    CardiacClockSettings settings;
    settings.predictor = method;
    return std::make_unique<CardiacClockTracker>(settings);
  }

  std::array<std::unique_ptr<CardiacClockTracker>, 3> trackers_{
      tracker(kPredictionMethods[0]), tracker(kPredictionMethods[1]), tracker(kPredictionMethods[2])};
};

void add(EcgSignal signal, double step_s, LeadUse& use) {
  if (signal == EcgSignal::kLeadOff || signal == EcgSignal::kFlat) use.unusable_s += step_s;
  if (signal == EcgSignal::kLearning) use.without_beats_s += step_s;
  if (signal == EcgSignal::kNoisy) use.noisy_s += step_s;
}

}  // namespace

EcgAnalysis analyse(const EcgTrace& trace, const std::function<bool(std::size_t)>& progress) {
  EcgAnalysis analysis;
  const auto finder = std::make_unique<BeatFinder>();
  Predictions predictions;
  bool unheard = false;
  if (!trace.second_mV.empty()) analysis.leads.resize(2);
  const auto take = [&](const std::optional<RPeak>& peak) {
    if (!peak) return;
    AnalysedBeat beat;
    beat.peak = *peak;
    beat.after_interruption = unheard;
    unheard = unheard && peak->beat_class == BeatClass::kNoise;
    predictions.take(beat);
    analysis.beats.push_back(beat);
  };

  for (std::size_t i = 0; i < trace.mV.size(); ++i) {
    if (i % kProgressEvery == 0 && !progress(i)) break;
    const double step_s = i > 0 ? trace.time_s[i] - trace.time_s[i - 1] : 0.0;
    const Instant t(from_seconds(trace.time_s[i]));
    take(trace.second_mV.empty() ? finder->push(t, trace.mV[i]) : finder->push(t, trace.mV[i], trace.second_mV[i]));
    const bool interrupted = finder->take_interruption();
    if (interrupted) {
      predictions.interrupt();
      ++analysis.interruptions;
      unheard = true;
    }
    const EcgSignal signal = finder->signal();
    analysis.duration_s += step_s;
    if (interrupted || signal == EcgSignal::kLeadOff || signal == EcgSignal::kFlat) {
      analysis.unusable_s += step_s;
    } else if (signal == EcgSignal::kLearning) {
      analysis.without_beats_s += step_s;
      unheard = true;
    }
    if (signal == EcgSignal::kNoisy) analysis.noisy_s += step_s;
    for (std::size_t lead = 0; lead < analysis.leads.size(); ++lead) {
      add(finder->signal(static_cast<int>(lead)), step_s, analysis.leads[lead]);
    }
    if (predictions.rhythm() == Rhythm::kUnpredictable) analysis.unpredictable_s += step_s;
  }
  while (const auto peak = finder->flush()) take(peak);
  static_cast<void>(progress(trace.mV.size()));
  return analysis;
}

}  // namespace perimap

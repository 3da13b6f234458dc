// The constants of the R peak detector that is made of EcgLine, EcgLevels, CandidateFinder and BeatDecision.
//
// "dev" as a reason: chosen on the development part of the records (docs/evidence/ecg.md), where its worth on the part
// aside stands as well.
#pragma once

#include <array>
#include <chrono>

#include "core/phase/ecg_line.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct EcgLevelSettings {
  Duration quiet_step = std::chrono::milliseconds(20);  // the energy is a mean of 80 ms: nothing is missed
  double quiet_quantile = 0.3;                          // of the last 2.5 s: diastole even at 180 beats a minute
  Duration window = std::chrono::milliseconds(1500);    // holds a beat at 40 a minute and more
  double rough = 4.0;                                   // times the usual roughness,
  double rough_to_beats = 0.5;    // and this share of the beats' slope over 20 ms: nothing can be seen (dev)
  double rough_hysteresis = 0.5;  // a burst fluctuates about its limit
  double rough_rise_s = 30.0;     // longer than a burst lasts, shorter than hum that comes to stay
  Duration rough_at_least = std::chrono::milliseconds(200);  // a QRS complex is rough for less
  Duration rough_before = std::chrono::milliseconds(100);    // the burst begins before its mean is rough,
  Duration rough_after = std::chrono::milliseconds(150);     // and the filters ring after it
};

struct CandidateSettings {
  Duration confirm = std::chrono::milliseconds(50);  // a maximum is one when nothing exceeded it for so long,
  double confirm_fall = 0.75;                        // or when the energy has fallen to this share of it (dev)
  double rise_again = 1.5;  // the next one begins when the energy has risen by this factor: ripple (dev)
  Duration shape_step = std::chrono::milliseconds(5);  // averages of 20 ms pass little above 50 Hz
  // Half of a wide (ventricular) QRS complex and its onset, and no more after the peak than the delay allows. Not
  // round: at the usual rates a whole number of steps would be one more or less by the last digit of the period.
  Duration shape_before = std::chrono::milliseconds(91);
  Duration shape_after = std::chrono::milliseconds(49);
  Duration one_complex = std::chrono::milliseconds(60);  // a maximum of the energy and a fit so far apart are one
  int fit_confirm = 3;                                   // steps after which a maximum of the correlation is one
  double alike = 0.6;           // correlation with a template that makes a candidate, whatever its energy (dev)
  double least_of_quiet = 1.2;  // times the quiet level: what is less is no candidate
  double quanta = 2.0;          // times the converter's resolution; a single step of it reaches 0.75
  Duration peak_window = std::chrono::milliseconds(80);       // each side of the middle: wide complexes take 160 ms
  Duration fit_peak_window = std::chrono::milliseconds(15);   // as far as peaks of one shape are displaced
  Duration baseline_before = std::chrono::milliseconds(200);  // so that the complex is the smaller part of the stretch
  Duration step_reach = std::chrono::milliseconds(100);       // each side, outside the complex
  Duration parabola = std::chrono::milliseconds(10);          // each side of the peak: an R wave is a parabola so far
  Duration wave_half = std::chrono::milliseconds(4);  // of the mean in which a wave is an extremum: no last bit is one
  Duration waves_beside = std::chrono::milliseconds(45);   // other waves of one complex, each side of its peak,
  Duration waves_before = std::chrono::milliseconds(110);  // and a QRS complex before an artefact that hides its end
  double opposite = 2.0;             // a beat points the other way when its other excursion is larger by this factor
  double deviation_floor_s = 0.001;  // clean beats scatter by that about their peaks (docs/design/phase.md)
  double deviation_cap_s = 0.020;    // where there is no vertex: uniform over the complex's top
};

struct DecisionSettings {
  double sure = 0.9;         // probability from which on a beat is told at once (dev)
  double more_likely = 0.5;  // and when it has had its time: more likely than not
  // When a P wave's own QRS complex would have been measured: the longest PR interval that is usual, 260 ms, and 90 ms.
  Duration time_to_decide = std::chrono::milliseconds(350);
  Duration time_if_known = std::chrono::milliseconds(180);      // of a kind that is known to be none
  Duration time_of_strangers = std::chrono::milliseconds(195);  // what is like nothing: the beat itself may yet come,
  double before_due = 0.85;                                     // unless it comes so early, in usual cycles
  Duration cut_off = std::chrono::milliseconds(49);    // before the signal's end: half the shape is made up, and a beat
  double certain = 0.99;                               // must be as probable as that
  Duration too_late = std::chrono::milliseconds(950);  // after that a beat is told no more
  Duration evaluate_every = std::chrono::milliseconds(20);
  double larger = 1.2;          // energy, by which another measure of one complex is the better one
  double sure_by_itself = 0.7;  // log odds that the complex alone must have for it, and the other way at the start,
                                // when as much against it makes it none: rhythm makes no beat
  Duration time_at_start = std::chrono::milliseconds(700);
  int beats_at_start = 3;  // until so many are known none is told at once: the first wave may be a P wave
  Duration refractory = std::chrono::milliseconds(180);  // of the ventricles; Pan & Tompkins 1985 have 200 ms
  double size_of_disturbance = 0.33;  // of a beat's, from which on what is like nothing says that there is noise
  double disturbance_memory_s = 1.5;  // they come in trains
  double too_large = 4.0;             // times the beats' energy: no ectopic beat is
  double stand_out = 1.25;      // log of energy to the quiet level; bare noise reaches 3.5 times it about once a minute
  double exactly_alike = 0.97;  // correlation that noise hardly reaches: where waves fill the cycle nothing stands out
  double unheard = 0.3;  // probability that no beat has come since the line began: the last may have been just before
  Duration begins =
      std::chrono::milliseconds(400);  // after the line broke off, what is like nothing is no beat for so long
  double qrs_like = 0.7;               // log odds of a complex by itself
  Duration crowd_from = std::chrono::milliseconds(110);  // longer than a wide complex has two maxima
  Duration crowd_to = std::chrono::milliseconds(240);    // shorter than a cycle at 240 a minute
  double crowd_of_cycle = 0.4;  // in a heart that is faster still premature beats come sooner as well
  double most_disturbances = 3.0;
  double some_noise = 0.3;  // disturbances, fading,
  double burst = 0.5;       // of which so many are electrosurgery or a loose cable,
  double much_noise = 1.5;  // and so many one in which nothing is a beat that comes early,
  double chaos = 2.2;       // and so many a lead that is off,
  Duration chaos_after = std::chrono::milliseconds(900);  // when no known beat has come for so long
  Duration beats_come = std::chrono::milliseconds(1500);  // since the last of a known kind; else less noise is a burst
  double near_to_beats = 0.5;                             // noisiness from which on no beat is believed (made leads)
  double very_familiar = 0.92;                            // correlation of a beat that is like its kind
  double unlike_by_size =
      0.1;  // of a beat to its kind: 1 - correlation and the difference in size, logarithm, times this
  double unlike_in_noise = 4.0;     // times 1 and the disturbances times this, and 1 and how early it comes:
  double suspicious = 0.17;         // from which on it may be an arc (dev; see beat_confidence)
  double doubtful = 0.5;            // confidence that nothing in them exceeds,
  double long_known_in_calm = 2.0;  // power of the odds against a beat of a kind that nothing speaks against (dev)
  double lost_in_noise = 0.25;      // and nothing that is unlike the beats among disturbances,
  double early_in_noise = 0.1;      // nor what comes early there: BeatClasser takes them for noise
  Duration longer_than_bursts = std::chrono::seconds(25);
  Duration around = std::chrono::milliseconds(500);  // what is strange so near makes a strange one less likely
  Duration pr_shortest = std::chrono::milliseconds(100);
  Duration pr_longest = std::chrono::milliseconds(280);
  double pr_of_cycle = 0.45;  // in a fast heart a beat follows another as soon as a QRS complex its P wave
  Duration t_wave_begins = std::chrono::milliseconds(120);
  Duration t_wave_ends = std::chrono::milliseconds(420);
  double most_odds = 6.0;             // of a complex by itself, log: no measure is as sure as that
  double as_sharp = 1.0;              // times another, from which on it is the QRS complex of a P wave,
  double sharper_of_one_kind = 1.15;  // and so much sharper where both have one shape
  double followed_by_chance = 0.3;    // share of its kind, from which on a complex may be a P wave
  Duration rt_longest = std::chrono::milliseconds(440);  // from R to the peak of T; longer than any PR interval
  double rival_odds = 2.0;  // log odds by which another complex in the cycle may be the less likely one, and a rival
  Duration rival_scatter = std::chrono::milliseconds(20);  // of its distance, from one cycle to the next (dev)
  Duration even = std::chrono::milliseconds(40);           // of three intervals that are of one length: a fast heart's
  double rivalled = 0.6;                                   // share of its kind, from which on a complex is doubtful
  double cluster_of_quiet = 2.5;  // times the quiet level, from which on a complex is learnt as one that recurs
  double cluster_of_top = 0.1;    // and this share of the largest
  int displaced = 3;              // steps; the peaks of unknown shapes are found so far apart
  double familiar = 0.8;
  double most_step = 0.75;              // change of level to the excursions: of clean beats one in a thousand has more,
  double pure_step = 0.9;               // of it, from which on a complex is a disturbance as soon as it is seen,
  double most_rough = 0.5;              // and of this, to the energy
  int changed_after = 5;                // beats in a row that are alike and of no known kind: arcs are neither
  double same_gain = 0.3;               // logarithm, of two beats that are of one size
  double learnt = 0.8;                  // probability from which on a beat teaches rhythm and levels
  double polarity_hysteresis = 1.3;     // an RS complex of equal parts must not change sides with each beat
  double polarity_memory = 8.0;         // beats, as the levels
  double larger_wave = 1.2;             // times the peak: of a complex that is not exactly like its kind it is R (dev)
  double height_of_beat = 0.5;          // of the usual excursion, from which on a wave in noise may be the beat's
  double doubtful_deviation_s = 0.087;  // uniform over the 150 ms of a match
  double silence_s = 3.0;               // without a beat: longer than a compensatory pause,
  double silence_cycles = 3.0;          // and usual cycles
  double slowest_cycle_s = 2.2;         // a block must not make the detector wait for ever
};

struct RPeakDetectorSettings {
  EcgLineSettings line;
  EcgLevelSettings levels;
  CandidateSettings candidates;
  DecisionSettings decision;
};

}  // namespace perimap

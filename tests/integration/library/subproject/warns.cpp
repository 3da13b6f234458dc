#include "core/phase/r_peak_detector.hpp"

long beats_hidden(const perimap::RPeakDetector& detector) {
  int unused;
  return (long)detector.interruptions();
}

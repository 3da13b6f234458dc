#include "daemon/evaluation/report/report_text.hpp"

#include <fmt/format.h>

#include <chrono>

#include "daemon/evaluation/report/accuracy_text.hpp"

namespace perimap {
namespace {

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

std::string figures_text(const DurationFigures& figures) {
  return fmt::format("{:.2f} / {:.2f} / {:.2f} ms", milliseconds(figures.p50), milliseconds(figures.p99),
                     milliseconds(figures.max));
}

nlohmann::json figures_json(const DurationFigures& figures) {
  return {{"p50_ms", milliseconds(figures.p50)},
          {"p99_ms", milliseconds(figures.p99)},
          {"max_ms", milliseconds(figures.max)}};
}

// In lockstep nothing takes time.
bool timed(const SamplesReport& report) { return report.release_to_receipt.max != Duration(0); }

}  // namespace

std::string to_text(const SamplesReport& report) {
  std::string text = fmt::format("samples     {} received, {} missed, {} without frame, {} from a late update\n",
                                 report.samples, report.missed, report.without_frame, report.from_late_update);
  if (!timed(report)) {
    text += "latency     not measured: these samples are of a lockstep replay\n";
  } else {
    text += fmt::format(
        "latency     capture to receipt p50 / p99 / max {}\n"
        "release     receipt after its deadline {}, jitter {}\n",
        figures_text(report.capture_to_receipt), figures_text(report.release_to_receipt), figures_text(report.jitter));
  }
  return text + to_text(report.accuracy) + "\n";
}

nlohmann::json to_json(const SamplesReport& report) {
  const auto figures = [&report](const DurationFigures& measured) {
    return timed(report) ? figures_json(measured) : nlohmann::json(nullptr);
  };
  return {{"samples",
           {{"received", report.samples},
            {"missed", report.missed},
            {"without_frame", report.without_frame},
            {"from_late_update", report.from_late_update}}},
          {"capture_to_receipt", figures(report.capture_to_receipt)},
          {"release_to_receipt", figures(report.release_to_receipt)},
          {"jitter", figures(report.jitter)},
          {"accuracy", to_json(report.accuracy)}};
}

}  // namespace perimap

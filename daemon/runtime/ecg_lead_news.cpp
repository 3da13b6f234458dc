#include "daemon/runtime/ecg_lead_news.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/phase/ecg_signal.hpp"

namespace perimap {
namespace {

constexpr Duration kLasts = std::chrono::seconds(2);
constexpr std::array<const char*, 2> kWhich{"first", "second"};

bool counted_as(EcgSignal signal, std::uint64_t counted) { return counted == 1 + static_cast<std::uint64_t>(signal); }

// What that means for the beats, by how the other lead is heard.
const char* consequence(std::uint64_t other) {
  if (counted_as(EcgSignal::kGood, other) || counted_as(EcgSignal::kNoisy, other)) {
    return ": beats are found in the other alone";
  }
  const bool is_off = counted_as(EcgSignal::kFlat, other) || counted_as(EcgSignal::kLeadOff, other) ||
                      counted_as(EcgSignal::kRepeated, other);
  return is_off ? ", and so is the other: no beats are found" : "";
}

}  // namespace

std::optional<EcgLeadNews::Line> EcgLeadNews::next(const PipelineCounters& counters, Instant now) {
  if (counters.ecg_leads[1].get() == 0) return std::nullopt;
  for (std::size_t i = 0; i < leads_.size(); ++i) {
    Lead& lead = leads_[i];
    const bool flat = counted_as(EcgSignal::kFlat, counters.ecg_leads[i].get());
    const bool repeated = counted_as(EcgSignal::kRepeated, counters.ecg_leads[i].get());
    const bool off = flat || repeated || counted_as(EcgSignal::kLeadOff, counters.ecg_leads[i].get());
    if (off != lead.off) lead.since = now;
    lead.off = off;
    if (off == lead.told_off || now - lead.since < kLasts) continue;
    lead.told_off = off;
    if (!off) return Line{false, fmt::format("the {} lead of the ECG is heard again", kWhich[i])};
    return Line{true, fmt::format("the {} lead of the ECG is {}{}; look at its electrodes", kWhich[i],
                                  flat       ? "flat"
                                  : repeated ? "giving the same again and again"
                                             : "off",
                                  consequence(counters.ecg_leads[1 - i].get()))};
  }
  return std::nullopt;
}

}  // namespace perimap

// Which of two leads of the ECG is off, said once.
#include "daemon/runtime/ecg_lead_news.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/phase/ecg_signal.hpp"

namespace perimap {
namespace {

struct LeadNews : ::testing::Test {
  std::unique_ptr<PipelineCounters> counters = std::make_unique<PipelineCounters>();
  EcgLeadNews news;
  double now_s = 100.0;

  void lead(std::size_t which, EcgSignal signal) {
    counters->ecg_leads[which].set(1 + static_cast<std::uint64_t>(signal));
  }
  // All that is said within so long, asked ten times a second.
  std::vector<EcgLeadNews::Line> said_in(double duration_s) {
    std::vector<EcgLeadNews::Line> lines;
    for (const double end_s = now_s + duration_s; now_s < end_s; now_s += 0.1) {
      if (const auto line = news.next(*counters, Instant(from_seconds(now_s)))) lines.push_back(*line);
    }
    return lines;
  }
};

TEST_F(LeadNews, ALeadThatIsOffIsSaidOnceAndSoIsThatItIsBack) {
  for (const std::size_t which : {0U, 1U}) {
    lead(which, EcgSignal::kGood);
    lead(1 - which, EcgSignal::kGood);
    EXPECT_TRUE(said_in(5.0).empty());
    lead(which, EcgSignal::kLeadOff);
    const auto off = said_in(20.0);
    ASSERT_EQ(off.size(), 1U);
    EXPECT_TRUE(off[0].warning);
    EXPECT_NE(off[0].text.find(which == 0 ? "first lead of the ECG is off" : "second lead of the ECG is off"),
              std::string::npos)
        << off[0].text;
    lead(which, EcgSignal::kGood);
    const auto back = said_in(20.0);
    ASSERT_EQ(back.size(), 1U);
    EXPECT_FALSE(back[0].warning);
  }
}

TEST_F(LeadNews, WhereBothAreOffNoBeatsAreFoundInTheOther) {
  lead(0, EcgSignal::kLeadOff);
  lead(1, EcgSignal::kFlat);
  const auto lines = said_in(5.0);
  ASSERT_EQ(lines.size(), 2U);
  for (const auto& line : lines) {
    EXPECT_NE(line.text.find("no beats are found"), std::string::npos) << line.text;
    EXPECT_EQ(line.text.find("in the other alone"), std::string::npos) << line.text;
  }
}

TEST_F(LeadNews, OfALeadThatIsStillLearntNothingIsPromised) {
  lead(0, EcgSignal::kLeadOff);
  lead(1, EcgSignal::kLearning);
  const auto lines = said_in(5.0);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].text.find("beats are found"), std::string::npos) << lines[0].text;
}

TEST_F(LeadNews, WhatDoesNotLastIsNotSaid) {
  lead(0, EcgSignal::kGood);
  lead(1, EcgSignal::kGood);
  for (int i = 0; i < 10; ++i) {
    lead(1, EcgSignal::kFlat);
    EXPECT_TRUE(said_in(1.5).empty());
    lead(1, EcgSignal::kNoisy);
    EXPECT_TRUE(said_in(1.5).empty());
  }
}

TEST_F(LeadNews, OfOneLeadNothingIsSaid) {
  lead(0, EcgSignal::kFlat);
  EXPECT_TRUE(said_in(10.0).empty());
}

}  // namespace
}  // namespace perimap

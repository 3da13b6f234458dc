#include "daemon/evaluation/ecg/ecg_input.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "daemon/evaluation/ecg/ecg_text.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

class EcgInputTest : public testing::Test {
 protected:
  EcgInputTest() {
    std::string name = testing::TempDir() + "ecg-input-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~EcgInputTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  std::filesystem::path folder_;
};

TEST_F(EcgInputTest, ATableIsReadWithItsGain) {
  EcgFile file;
  file.path = write("ecg.csv", "time_s,mV\n0,1\n0.004,2\n0.008,3\n");
  file.gain = 2.0;
  const auto input = read_ecg(file);
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_THAT(input->trace.mV, ::testing::ElementsAre(2.0F, 4.0F, 6.0F));
  EXPECT_TRUE(input->damage.empty());
  EXPECT_EQ(input->whole_until, "");
}

TEST_F(EcgInputTest, ARateThatTheDetectorDoesNotTakeIsRefused) {
  EcgFile file;
  file.path = write("ecg.csv", "time_s,mV\n0,1\n1,2\n2,3\n");
  EXPECT_THAT(read_ecg(file).error().message, HasSubstr("1 samples a second; from 100 to 1000 are taken"));
}

TEST_F(EcgInputTest, WhatDoesNotGoWithTheKindOfFileIsSaid) {
  EcgFile file;
  file.path = "heart.mcap";
  EXPECT_EQ(misfit(file), "");
  file.rate_hz = 250.0;
  EXPECT_THAT(misfit(file), HasSubstr("a recording knows its rate"));
  file.path = "100.hea";
  EXPECT_THAT(misfit(file), HasSubstr("a WFDB record knows its rate"));
  file.path = "ecg.csv";
  EXPECT_EQ(misfit(file), "");
  file.gain = 0.0;
  EXPECT_THAT(misfit(file), HasSubstr("--gain must be a number other than 0"));
}

TEST_F(EcgInputTest, OfAWfdbRecordHeaderAndSignalsAreRead) {
  EcgFile file;
  file.path = write("100.hea", "100 1 360 10\n100.dat 212 200 11 1024 995 -22131 0 MLII\n");
  EXPECT_THAT(files_of(file), ::testing::Contains(folder_ / "100.dat"));
  file.path = "ecg.csv";
  EXPECT_TRUE(files_of(file).empty());
}

TEST(EcgText, OfNoBeatsSaysNoneWhereThereIsNoFigure) {
  EXPECT_EQ(beat_rows({}), "time_s,class,confidence,detected_at_s\n");
  EXPECT_THAT(to_text(EcgAnalysis{}, PredictionErrors{}), HasSubstr("median / 95 %: none\n"));
  EXPECT_THAT(to_text(EcgAnalysis{}, PredictionErrors{}), HasSubstr("prediction  next cycle: none"));
  EXPECT_TRUE(to_json(EcgAnalysis{}, PredictionErrors{})["delay_ms"]["median"].is_null());
}

}  // namespace
}  // namespace perimap

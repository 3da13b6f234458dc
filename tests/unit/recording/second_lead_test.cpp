// A second lead of the ECG in a recording: on a channel of its own, and one block with the first when it is read.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {
namespace {

class RecordedLeads : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-leads-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static EcgBlock block(int i, bool two) {
    EcgBlock block;
    block.first_sample_time = from_ns(1'000'000'000 + 12'000'000LL * i);
    block.sample_period = std::chrono::milliseconds(4);
    block.device_sequence = static_cast<std::uint32_t>(3 * i);
    block.count = 3;
    block.arrival = block.last_sample_time() + std::chrono::milliseconds(1);
    const auto value = static_cast<float>(i);
    block.mV = {value, value + 0.25F, value + 0.5F};
    block.has_second = two;
    block.second_off = two && i == 2;
    if (two) block.second_mV = {-value, -value - 0.25F, -value - 0.5F};
    return block;
  }

  std::string write(std::string_view name, bool two) {
    const std::string file = (folder_ / name).string();
    SensorRecordingFacts facts;
    facts.second_lead = two;
    auto writer = SensorWriter::create(file, facts, from_ns(900'000'000)).value();
    for (int i = 0; i < 5; ++i) {
      const EcgBlock b = block(i, two && i != 3);
      EXPECT_TRUE(writer.write(b, b.arrival));
    }
    EXPECT_TRUE(writer.finish());
    return file;
  }

  static std::vector<EcgBlock> read(const std::string& file, const std::vector<std::string_view>& channels) {
    auto reader = ReplayReader::open(file, ReadMode::kStrict, channels).value();
    std::vector<EcgBlock> blocks;
    for (auto event = reader.next().value(); event; event = reader.next().value()) {
      blocks.push_back(std::get<EcgBlock>(*event));
    }
    return blocks;
  }

  std::filesystem::path folder_;
};

TEST_F(RecordedLeads, ComeBackAsTheyWent) {
  const auto blocks = read(write("two.mcap", true), {channels::kEcgSamples, channels::kEcgSecondLead});
  ASSERT_EQ(blocks.size(), 5U);
  for (int i = 0; i < 5; ++i) {
    const EcgBlock& b = blocks[static_cast<std::size_t>(i)];
    const EcgBlock went = block(i, i != 3);
    EXPECT_EQ(b.arrival, went.arrival);
    EXPECT_EQ(b.mV, went.mV);
    EXPECT_EQ(b.has_second, went.has_second) << i;
    EXPECT_EQ(b.second_off, went.second_off) << i;
    EXPECT_EQ(b.second_mV, went.second_mV) << i;
  }
}

// Who does not know of a second lead reads the first as if it were alone.
TEST_F(RecordedLeads, TheFirstReadsAsIfItWereAlone) {
  const auto of_two = read(write("two.mcap", true), {channels::kEcgSamples});
  const auto of_one = read(write("one.mcap", false), {channels::kEcgSamples});
  ASSERT_EQ(of_two.size(), of_one.size());
  for (std::size_t i = 0; i < of_two.size(); ++i) {
    EXPECT_EQ(of_two[i].first_sample_time, of_one[i].first_sample_time);
    EXPECT_EQ(of_two[i].mV, of_one[i].mV);
    EXPECT_FALSE(of_two[i].has_second);
  }
}

TEST_F(RecordedLeads, ASecondLeadThatTheRecordingWasNotBegunWithIsAnError) {
  auto writer = SensorWriter::create((folder_ / "none.mcap").string(), {}, from_ns(900'000'000)).value();
  const EcgBlock b = block(0, true);
  const auto written = writer.write(b, b.arrival);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("second lead"), std::string::npos);
}

}  // namespace
}  // namespace perimap

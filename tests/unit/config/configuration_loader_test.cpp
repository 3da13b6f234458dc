#include "daemon/config/configuration_loader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>

#include "daemon/config/configuration_keys.hpp"
#include "daemon/config/configuration_text.hpp"
#include "daemon/config/session_keys.hpp"
#include "daemon/config/surface_traffic.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Expected<Configuration> parse(std::string_view text, const Configuration& base = {}) {
  return parse_configuration(text, "test.toml", base, NamedFiles::kMayBeMissing);
}

std::string error_of(std::string_view text) {
  const Expected<Configuration> result = parse(text);
  return result ? "accepted" : result.error().message;
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-config-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path write(const std::string& name, std::string_view text) const {
    std::ofstream(path_ / name) << text;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

TEST(ConfigurationLoader, AFileWithNothingButItsVersionGivesTheDefaults) {
  const Expected<Configuration> result = parse("version = 1\n");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(*result, Configuration{});
}

TEST(ConfigurationLoader, ReadsEveryKindOfValueInItsUnit) {
  const Expected<Configuration> result = parse(R"(
version = 1
[source]
name = "theatre 3"
[tracker]
position_deviation_mm = 1.4
rotation_deviation_deg = 0.5
error_correlation_s = 5
time_offset_ms = -2.5
hand_eye_translation_SC_mm = [1, -2.5, 3]
hand_eye_rotation_SC_wxyz = [0, 0, 1, 0]
[phase]
law = "time-locked"
[pipeline]
latency_ms = 40
workers = 4
[estimation]
start_depths_mm = [60, 120.5]
[realtime]
lock_memory = false
cpus = [2, 3]
[dds]
surface_lifespan_ms = 0.25
[log]
level = "debug"
)");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->source.name, "theatre 3");
  EXPECT_EQ(result->tracker.position_deviation_mm, 1.4);
  EXPECT_NEAR(result->tracker.rotation_deviation_rad, std::numbers::pi / 360.0, 1e-15);
  EXPECT_EQ(result->tracker.error_correlation, std::chrono::seconds(5));
  EXPECT_EQ(result->tracker.time_offset, microseconds(-2500));
  EXPECT_THAT(result->tracker.translation_SC_mm, ::testing::ElementsAre(1.0, -2.5, 3.0));
  EXPECT_THAT(result->tracker.rotation_SC_wxyz, ::testing::ElementsAre(0.0, 0.0, 1.0, 0.0));
  EXPECT_EQ(result->phase.law, PhaseLaw::kTimeLocked);
  EXPECT_EQ(result->pipeline.latency, milliseconds(40));
  EXPECT_EQ(result->pipeline.workers, 4);
  EXPECT_THAT(result->estimation.start_depths_mm, ::testing::ElementsAre(60.0, 120.5));
  EXPECT_FALSE(result->realtime.lock_memory);
  EXPECT_THAT(result->realtime.cpus, ::testing::ElementsAre(2, 3));
  EXPECT_EQ(result->dds.surface_lifespan, microseconds(250));
  EXPECT_EQ(result->log.level, LogConfiguration::Level::kDebug);
}

TEST(ConfigurationLoader, ReadsListsOfTextsAndAnEmptyOne) {
  const auto result = parse("version = 1\n[tracker]\npointer = \"0C\"\ninstruments = [\"0D\", \"Grasper 2\"]\n");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->tracker.pointer, "0C");
  EXPECT_THAT(result->tracker.instruments, ::testing::ElementsAre("0D", "Grasper 2"));
  const auto none = parse("version = 1\n[tracker]\ninstruments = []\n", *result);
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_TRUE(none->tracker.instruments.empty());
  for (const char* list :
       {"[1]", "\"0D\"", "[\"\"]", "[\"0D\", 2]", "[\"1\",\"2\",\"3\",\"4\",\"5\",\"6\",\"7\",\"8\",\"9\"]"}) {
    const auto wrong = parse(std::string("version = 1\n[tracker]\ninstruments = ") + list + "\n");
    ASSERT_FALSE(wrong) << list;
    EXPECT_THAT(wrong.error().message, ::testing::HasSubstr("up to 8 texts of 1 to 20 printable characters"));
  }
  const auto missing = parse_configuration("version = 1\n[tracker]\ninstrument_definitions = [\"not-there.rom\"]\n",
                                           "test.toml", {}, NamedFiles::kMustExist);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, ::testing::HasSubstr("not-there.rom is not there"));
}

TEST(ConfigurationLoader, ADayIsOneOfTheCalendar) {
  const auto dated = [](const std::string& day) {
    return parse("version = 1\n[tracker]\nhand_eye_date = \"" + day + "\"\n").has_value();
  };
  for (const char* day : {"2026-11-25", "2024-02-29", "2026-11-25 18:30 UTC"}) EXPECT_TRUE(dated(day)) << day;
  for (const char* day :
       {"", "2026-13-45", "2026-02-31", "2026-11-25garbage", "2026-11-25 18:30", "25.11.2026", "2026-1-2"}) {
    EXPECT_FALSE(dated(day)) << day;
  }
}

TEST(ConfigurationLoader, TextMayBeInAnyScriptWithinStringsAndComments) {
  const Expected<Configuration> result = parse(
      "version = 1  # \xe3\x80\x81\n[source]\nname = \"th\xc3\xa9\xc3\xa2tre \\\"\xe3\x80\x81\\\" \"\nworld_frame = "
      "'\xef\xbb\xa3'\n");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->source.name, "th\xc3\xa9\xc3\xa2tre \"\xe3\x80\x81\" ");
  EXPECT_EQ(result->source.world_frame, "\xef\xbb\xa3");
}

TEST(ConfigurationLoader, AByteOrderMarkIsSkipped) {
  const Expected<Configuration> result = parse("\xef\xbb\xbfversion = 1\n");
  EXPECT_TRUE(result) << result.error().message;
}

TEST(ConfigurationLoader, AFileOverlaysItsBaseKeyByKey) {
  const Expected<Configuration> recorded =
      parse("version = 1\n[tracker]\nposition_deviation_mm = 1.4\n[phase]\nlaw = \"warped\"\n");
  ASSERT_TRUE(recorded);
  const Expected<Configuration> result = parse("version = 1\n[phase]\nlaw = \"linear\"\n", *recorded);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->phase.law, PhaseLaw::kLinear);
  EXPECT_EQ(result->tracker.position_deviation_mm, 1.4);
}

TEST(ConfigurationLoader, WhatIsPrintedLoadsBackToTheSame) {
  Configuration configuration;
  configuration.source.name = "a \"quoted\" \\ name";
  configuration.replay.recording = "/data/x.mcap";
  configuration.tracker.rotation_deviation_rad = 0.5 * std::numbers::pi / 180.0;
  configuration.tracker.time_offset = Duration(-1234567);
  configuration.tracker.translation_SC_mm[1] = 1.0 / 3.0;
  configuration.phase.law = PhaseLaw::kWarped;
  configuration.pipeline.latency = Duration(33333333);
  configuration.pipeline.release = PipelineConfiguration::Release::kBoth;
  configuration.pipeline.clock_rate_hz = 250.0;
  configuration.pipeline.shedding = false;
  configuration.estimation.start_depths_mm = {40, 80.25, 1e4};
  configuration.estimation.gate_chi2 = 0.1 + 0.2;
  configuration.realtime.cpus = {1, 3};
  configuration.dds.enabled = false;
  configuration.log.level = LogConfiguration::Level::kError;
  for (const Configuration& printed : {Configuration{}, configuration}) {
    const Expected<Configuration> result = parse(to_toml(printed));
    ASSERT_TRUE(result) << result.error().message << "\n" << to_toml(printed);
    EXPECT_EQ(*result, printed) << to_toml(printed);
  }
}

TEST(ConfigurationLoader, FileNamesStartAtTheFoldersOfTheirConfiguration) {
  const TemporaryFolder folder;
  const std::filesystem::path recording = folder.write("x.mcap", "");
  const std::filesystem::path file = folder.write("a.toml", "version = 1\n[replay]\nrecording = \"./x.mcap\"\n");
  const Expected<Configuration> result = load_configuration(file);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->replay.recording, recording);
}

TEST(ConfigurationLoader, AMissingNamedFileIsAnErrorAtItsKey) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.write("a.toml", "version = 1\n[replay]\nrecording = \"x.mcap\"\n");
  const Expected<Configuration> result = load_configuration(file);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message,
              StartsWith(file.string() + ":3:13: key 'replay.recording': expected the name of an existing file, got "
                                         "\"x.mcap\""));
}

TEST(ConfigurationLoader, AMissingOrUnreadableConfigurationFileIsNamed) {
  const TemporaryFolder folder;
  const Expected<Configuration> missing = load_configuration("/nowhere/a.toml");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().message,
            "/nowhere/a.toml: expected a readable configuration file, got: No such file or directory");
  const Expected<Configuration> a_folder = load_configuration(std::filesystem::temp_directory_path());
  ASSERT_FALSE(a_folder);
  EXPECT_THAT(a_folder.error().message, HasSubstr("expected a readable configuration file, got: Is a directory"));
}

TEST(ConfigurationLoader, WhatARefusalOfTooMuchTrafficSaysWouldFitIsAccepted) {
  const std::string all = "version = 1\n[pipeline]\nrelease = \"both\"\n";
  EXPECT_THAT(error_of(all + "clock_rate_hz = 1000\n[features]\nmaximum = 1000\n"),
              HasSubstr("(at most 303.19, or features.maximum of at most 362)"));
  EXPECT_TRUE(parse(all + "clock_rate_hz = 303.19\n[features]\nmaximum = 1000\n"));
  EXPECT_TRUE(parse(all + "clock_rate_hz = 1000\n[features]\nmaximum = 362\n"));
  EXPECT_FALSE(parse(all + "clock_rate_hz = 303.20\n[features]\nmaximum = 1000\n"));
  EXPECT_FALSE(parse(all + "clock_rate_hz = 1000\n[features]\nmaximum = 363\n"));
  EXPECT_TRUE(parse(all + "clock_rate_hz = 1000\n[features]\nmaximum = 1000\n[dds]\nmaximum_MB_per_s = 137\n"));
}

TEST(ConfigurationLoader, AClockOfAnyRateFitsTheDefaults) {
  EXPECT_TRUE(parse("version = 1\n[pipeline]\nrelease = \"both\"\nclock_rate_hz = 1000\n"));
}

TEST(SurfaceTraffic, CountsTheStreamsThatArePublishedAndTheModels) {
  Configuration configuration;
  configuration.features.maximum = 100;
  configuration.camera.frame_rate_hz = 25.0;
  configuration.pipeline.clock_rate_hz = 200.0;
  configuration.estimation.harmonics = 8;
  const auto mega_bytes = static_cast<double>(kSurfaceBytes + 100 * kSurfaceFeatureBytes) * 1e-6;
  // Ten models a second, of 3 x 17 coefficients a feature, and with breathing of 3 x 21.
  const auto models = [](std::size_t coefficients) {
    return 10.0 * static_cast<double>(kModelBytes + 100 * (kModelFeatureBytes + coefficients * 8)) * 1e-6;
  };
  EXPECT_NEAR(surface_traffic(configuration).MB_per_s(), 25.0 * mega_bytes + models(51), 1e-9);
  configuration.pipeline.release = PipelineConfiguration::Release::kClock;
  EXPECT_NEAR(surface_traffic(configuration).MB_per_s(), 200.0 * mega_bytes + models(51), 1e-9);
  configuration.pipeline.release = PipelineConfiguration::Release::kBoth;
  EXPECT_NEAR(surface_traffic(configuration).MB_per_s(), 225.0 * mega_bytes + models(51), 1e-9);
  configuration.respiration.enabled = true;
  EXPECT_NEAR(surface_traffic(configuration).MB_per_s(), 225.0 * mega_bytes + models(63), 1e-9);
  configuration.respiration.enabled = false;
  const std::vector<std::string> lines = traffic_lines(configuration);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[0], HasSubstr("stream \"frame\""));
  EXPECT_THAT(lines[1], HasSubstr("200 surfaces/s, at the multiples of 5000000 ns"));
  EXPECT_THAT(lines[2], HasSubstr("at most 0.513 MB/s"));
  EXPECT_THAT(lines[3], HasSubstr("together at most 3.43 of 50 MB/s to one reader"));
}

TEST(ConfigurationLoader, AllErrorsAreToldInTheOrderOfTheFile) {
  std::istringstream lines(
      error_of("version = 1\n[tracker]\nposition_deviation_mm = -1\n[phase]\nlaw = 3\nx = 1\n[camera]\ny = 2\n"));
  for (const char* told :
       {"test.toml:3:25: key 'tracker.position_deviation_mm': expected ", "test.toml:5:7: key 'phase.law': expected ",
        "test.toml:6:1: key 'phase.x': expected ", "test.toml:8:1: key 'camera.y': expected "}) {
    std::string line;
    ASSERT_TRUE(std::getline(lines, line)) << told;
    EXPECT_THAT(line, StartsWith(told));
  }
  EXPECT_EQ(lines.peek(), EOF);
}

TEST(ConfigurationLoader, AFileOfAnotherKindIsNotToldToItsEnd) {
  std::string text = "version = 1\n";
  for (int i = 0; i < 100; ++i) text += "x" + std::to_string(i) + " = 1\n";
  const std::string error = error_of(text);
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 20);
  EXPECT_THAT(error, ::testing::EndsWith("\ntest.toml: and 80 more wrong keys"));
}

TEST(ConfigurationLoader, AMisspeltKeyIsToldWhatWasMeant) {
  using ::testing::EndsWith;
  EXPECT_THAT(error_of("version = 1\n[traker]\n"), EndsWith("got an unknown key; did you mean 'tracker'?"));
  EXPECT_THAT(error_of("version = 1\n[phase]\nlost_afer_s = 1\n"), EndsWith("; did you mean 'lost_after_s'?"));
  EXPECT_THAT(error_of("version = 1\n[phase]\nworkers = 1\n"), EndsWith("; did you mean 'pipeline.workers'?"));
  EXPECT_THAT(error_of("version = 1\nlatency_ms = 1\n"), EndsWith("; did you mean 'pipeline.latency_ms'?"));
  EXPECT_THAT(error_of("version = 1\n[phase]\nxyz = 1\n"), EndsWith("got an unknown key"));
}

struct Wrong {
  const char* name;
  std::string text;
  std::string error;
};

class WrongConfiguration : public ::testing::TestWithParam<Wrong> {};

TEST_P(WrongConfiguration, GivesOneLineThatNamesPlaceKeyAndWhatWouldBeRight) {
  const std::string error = error_of(GetParam().text);
  EXPECT_THAT(error, StartsWith(GetParam().error));
  EXPECT_EQ(error.find_first_of("\r\n"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Table, WrongConfiguration,
    ::testing::Values(
        Wrong{"Empty", "", "test.toml:1:1: key 'version': expected 1, got nothing"},
        Wrong{"OtherVersion", "version = 2", "test.toml:1:11: key 'version': expected 1, got 2"},
        Wrong{"VersionAsText", "version = \"1\"", "test.toml:1:11: key 'version': expected 1, got \"1\""},
        Wrong{
            "UnknownSection", "version = 1\n[traker]\n",
            "test.toml:2:2: key 'traker': expected one of version, source, replay, camera, tracker, setup, ecg, phase, "
            "respiration, pipeline, features, estimation, use, model, realtime, dds, recording, status, log, control, "
            "checkpoint, blackbox, got an unknown key"},
        Wrong{"UnknownKey", "version = 1\n[phase]\nlow = 1\n",
              "test.toml:3:1: key 'phase.low': expected one of law, lost_after_s, from_image, image_alone_s, "
              "predictor, got an unknown key"},
        Wrong{"InputThatABitalinoHasNot",
              "version = 1\n[ecg]\nprotocol = \"bitalino\"\n[respiration]\ndevice_channel = 7\n",
              "test.toml:5:18: key 'respiration.device_channel': expected 1 to 6 of a bitalino, but for 2, which "
              "carries the ECG, got 7"},
        Wrong{"InputThatCarriesTheEcg",
              "version = 1\n[ecg]\nprotocol = \"cyton\"\nchannel = 3\n[respiration]\ndevice_channel = 3\n",
              "test.toml:6:18: key 'respiration.device_channel': expected 1 to 8 of a cyton, but for 3, which carries "
              "the ECG, got 3"},
        Wrong{"UsualInputOfTheEcg", "version = 1\n[ecg]\nprotocol = \"cyton\"\n[respiration]\ndevice_channel = 1\n",
              "test.toml:5:18: key 'respiration.device_channel': expected 1 to 8 of a cyton, but for 1, which carries "
              "the ECG, got 1"},
        Wrong{
            "InputOfAMedlab", "version = 1\n[ecg]\nprotocol = \"medlab\"\n[respiration]\ndevice_channel = 2\n",
            "test.toml:5:18: key 'respiration.device_channel': expected 0, since a medlab tells the rate of breathing "
            "alone, got 2"},
        Wrong{"OtherInputOfCan", "version = 1\n[ecg]\nprotocol = \"can\"\n[respiration]\ndevice_channel = 1\n",
              "test.toml:5:18: key 'respiration.device_channel': expected 2, the second word of "
              "config/perimap_ecg.dbc, got 1"},
        Wrong{"InputOfNoDevice", "version = 1\n[respiration]\ndevice_channel = 1\n",
              "test.toml:3:18: key 'respiration.device_channel': expected 0 without an ECG device in 'ecg.protocol', "
              "got 1"},
        Wrong{"InputOfTheSecondLead",
              "version = 1\n[ecg]\nprotocol = \"cyton\"\nsecond_channel = 2\n[respiration]\ndevice_channel = 2\n",
              "test.toml:6:18: key 'respiration.device_channel': expected 1 to 8 of a cyton, but for 1 and 2, which "
              "carry the ECG, got 2"},
        Wrong{"SecondLeadOfOneInput", "version = 1\n[ecg]\nprotocol = \"cyton\"\nsecond_channel = 1\n",
              "test.toml:4:18: key 'ecg.second_channel': expected 1 to 8 of a cyton, but for 1, which carries the "
              "first lead, got 1"},
        Wrong{"SecondLeadThatABitalinoHasNot", "version = 1\n[ecg]\nprotocol = \"bitalino\"\nsecond_channel = 7\n",
              "test.toml:4:18: key 'ecg.second_channel': expected 1 to 6 of a bitalino, but for 2, which carries the "
              "first lead, got 7"},
        Wrong{"SecondLeadOfAMedlab", "version = 1\n[ecg]\nprotocol = \"medlab\"\nsecond_channel = 2\n",
              "test.toml:4:18: key 'ecg.second_channel': expected 0 but with a bitalino or a cyton, which have inputs, "
              "got 2"},
        Wrong{"EcgInputThatABitalinoHasNot", "version = 1\n[ecg]\nchannel = 8\nprotocol = \"bitalino\"\n",
              "test.toml:3:11: key 'ecg.channel': expected 1 to 6 of a bitalino, got 8"},
        Wrong{"TriggerOnTheEcgsPort",
              "version = 1\n[ecg]\nprotocol = \"cyton\"\nport = \"/dev/ttyUSB0\"\nr_trigger = true\n"
              "r_trigger_port = \"/dev/ttyUSB0\"\n",
              "test.toml:6:18: key 'ecg.r_trigger_port': expected a serial port of its own, got /dev/ttyUSB0"},
        Wrong{"SectionIsAValue", "version = 1\nphase = 3\n", "test.toml:2:9: key 'phase': expected a table, got 3"},
        Wrong{"SectionIsAnArrayOfTables", "version = 1\n[[phase]]\nlaw = \"linear\"\n",
              "test.toml:2:1: key 'phase': expected a table, got [a table]"},
        Wrong{"KeyIsATable", "version = 1\n[phase.law]\n",
              "test.toml:2:1: key 'phase.law': expected \"auto\" or \"linear\" or \"warped\" or \"time-locked\", got a "
              "table"},
        Wrong{"WordForNumber", "version = 1\n[pipeline]\nworkers = \"two\"\n",
              "test.toml:3:11: key 'pipeline.workers': expected an integer from 1 to 64, got \"two\""},
        Wrong{"NumberForInteger", "version = 1\n[pipeline]\nworkers = 2.0\n",
              "test.toml:3:11: key 'pipeline.workers': expected an integer from 1 to 64, got 2"},
        Wrong{"TooFewWorkers", "version = 1\n[pipeline]\nworkers = 0\n",
              "test.toml:3:11: key 'pipeline.workers': expected an integer from 1 to 64, got 0"},
        Wrong{"LargestInteger", "version = 1\n[pipeline]\nworkers = 9223372036854775807\n",
              "test.toml:3:11: key 'pipeline.workers': expected an integer from 1 to 64, got 9223372036854775807"},
        Wrong{"NotANumber", "version = 1\n[tracker]\nposition_deviation_mm = nan\n",
              "test.toml:3:25: key 'tracker.position_deviation_mm': expected a number from 0 to 100, got nan"},
        Wrong{"Infinity", "version = 1\n[tracker]\ntime_offset_ms = inf\n",
              "test.toml:3:18: key 'tracker.time_offset_ms': expected a number from -1000 to 1000, got inf"},
        Wrong{"FlagAsNumber", "version = 1\n[dds]\nenabled = 1\n",
              "test.toml:3:11: key 'dds.enabled': expected true or false, got 1"},
        Wrong{"Date", "version = 1\n[dds]\nenabled = 1979-05-27\n",
              "test.toml:3:11: key 'dds.enabled': expected true or false, got a date or time"},
        Wrong{"UnknownRelease", "version = 1\n[pipeline]\nrelease = \"none\"\n",
              "test.toml:3:11: key 'pipeline.release': expected \"frame\" or \"clock\" or \"both\", got \"none\""},
        Wrong{"ClockTooFast", "version = 1\n[pipeline]\nrelease = \"clock\"\nclock_rate_hz = 1001\n",
              "test.toml:4:17: key 'pipeline.clock_rate_hz': expected a number from 1 to 1000, got 1001"},
        Wrong{"MoreThanMayBePublished",
              "version = 1\n[pipeline]\nrelease = \"both\"\nclock_rate_hz = 1000\n[features]\nmaximum = 1000\n",
              "test.toml:4:17: key 'pipeline.clock_rate_hz': expected what dds.maximum_MB_per_s = 50 allows (at most "
              "303.19, or features.maximum of at most 362), got 136.795 MB/s of surfaces with 1000 features, 1060 of "
              "them a second, and their models"},
        Wrong{"MoreFramesThanMayBePublished",
              "version = 1\n[camera]\nframe_rate_hz = 2000\n[features]\nmaximum = 1000\n",
              "test.toml:5:11: key 'features.maximum': expected what dds.maximum_MB_per_s = 50 allows "
              "(features.maximum of at "
              "most 193), got 253.881 MB/s of surfaces with 1000 features, 2000 of them a second, and their models"},
        Wrong{
            "MoreFramesUnderwayThanAreKept",
            "version = 1\n[pipeline]\nlatency_ms = 1000\n[camera]\nframe_rate_hz = 300\n",
            "test.toml:3:14: key 'pipeline.latency_ms': expected at most 800 at camera.frame_rate_hz = 300 (240 frames "
            "between capture and release), got 1000"},
        Wrong{"BudgetBeyondLatency", "version = 1\n[pipeline]\nbudget_ms = 50\n",
              "test.toml:3:13: key 'pipeline.budget_ms': expected less than latency_ms (50), got 50"},
        Wrong{"QuaternionNotUnit", "version = 1\n[tracker]\nhand_eye_rotation_SC_wxyz = [1, 1, 0, 0]\n",
              "test.toml:3:29: key 'tracker.hand_eye_rotation_SC_wxyz': expected four numbers of norm 1 within "
              "1e-3, got [1, 1, 0, 0]"},
        Wrong{"TranslationTooShort", "version = 1\n[tracker]\nhand_eye_translation_SC_mm = [1, 2]\n",
              "test.toml:3:30: key 'tracker.hand_eye_translation_SC_mm': expected three numbers from -10000 to 10000, "
              "got [1, 2]"},
        Wrong{"MixedArray", "version = 1\n[tracker]\nhand_eye_translation_SC_mm = [1, 2, \"3\"]\n",
              "test.toml:3:30: key 'tracker.hand_eye_translation_SC_mm': expected three numbers from -10000 to 10000, "
              "got [1, 2, \"3\"]"},
        Wrong{"DepthsFalling", "version = 1\n[estimation]\nstart_depths_mm = [90, 50]\n",
              "test.toml:3:19: key 'estimation.start_depths_mm': expected 1 to 8 rising numbers"},
        Wrong{"NoDepths", "version = 1\n[estimation]\nstart_depths_mm = []\n",
              "test.toml:3:19: key 'estimation.start_depths_mm': expected 1 to 8 rising numbers"},
        Wrong{"NegativeCpu", "version = 1\n[realtime]\ncpus = [-1]\n",
              "test.toml:3:8: key 'realtime.cpus': expected up to 64 integers from 0 to 1023, got [-1]"},
        Wrong{"NameTooLong", "version = 1\n[source]\nname = \"" + std::string(64, 'x') + "\"\n",
              "test.toml:3:8: key 'source.name': expected a printable text of 1 to 63 bytes, got \"xxx"},
        Wrong{"NameWithNewLine", "version = 1\n[source]\nname = \"a\\nb\"\n",
              "test.toml:3:8: key 'source.name': expected a printable text of 1 to 63 bytes, got \"a b\""},
        Wrong{"EmptyFileName", "version = 1\n[replay]\nrecording = \"\"\n",
              "test.toml:3:13: key 'replay.recording': expected the name of an existing file, got \"\""},
        Wrong{"FileNameWithNul", "version = 1\n[replay]\nrecording = \"a\\u0000b\"\n",
              "test.toml:3:13: key 'replay.recording': expected the name of an existing file, got "},
        Wrong{"KeyTwice", "version = 1\nversion = 1\n", "test.toml:2:"},
        Wrong{"NoValue", "version = \n", "test.toml:1:"}, Wrong{"OpenString", "version = \"1\n", "test.toml:1:"},
        Wrong{"OpenTable", "version = 1\n[phase\n", "test.toml:2:"},
        Wrong{"NotUtf8", "version = 1\nx = \"\xff\xfe\"\n", "test.toml:2:"},
        Wrong{"LetterOutsideOfStrings", "version = 1\n[source]\nn\xef\xbb\xa3me = \"a\"\n",
              "test.toml:3:2: expected TOML, got: a letter beyond ASCII outside of strings and comments"},
        Wrong{"LetterAfterAnEscapedQuote", "version = 1\n[source]\nname = \"a\\\"b\" \xef\xbb\xa3\n",
              "test.toml:3:15: expected TOML, got: a letter beyond ASCII outside of strings and comments"},
        Wrong{"LetterInWhatOnlyLooksLikeAString", "version = 1ro==='=oke\xcc\x8dro='\n",
              "test.toml:1:22: expected TOML, got: a letter beyond ASCII outside of strings and comments"},
        Wrong{"LetterInAQuotedKey", "version = 1\n\"\xc3\xa9\" = 2\n",
              "test.toml:2:2: expected TOML, got: a letter beyond ASCII outside of strings and comments"},
        Wrong{"StringOverSeveralLines", "version = 1\n[source]\nname = \"\"\"a\nb\"\"\"\n",
              "test.toml:3:8: expected a string on one line, got: one over several lines"},
        Wrong{"NoKeyInBrackets", "version = 1\n[(phase]\n", "test.toml:2:2: expected TOML"},
        Wrong{"NotUtf8InAKey", "version = 1\n[tracker]\nhand_\xd1m = 1\n", "test.toml:3:"},
        Wrong{"Nul", std::string("version = 1\n\0", 13), "test.toml:2:"},
        Wrong{"Binary", "\x89MCAP0\r\n", "test.toml:1:"},
        Wrong{"DeepArrays", "version = 1\nx = " + std::string(5000, '['), "test.toml:2:"},
        Wrong{"DeepKeys",
              "version = 1\nx" +
                  [] {
                    std::string dots;
                    for (int i = 0; i < 30000; ++i) dots += ".a";
                    return dots;
                  }() +
                  " = 1\n",
              "test.toml:2:402: expected TOML, got: a line of more than 200 dots"},
        Wrong{"TooLarge", std::string(70000, '#'), "test.toml:1:1: expected at most 65536 bytes of TOML, got 70000"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(FormerKeys, FramesAtTheUsualRateAreReadAsTheirDurationAndNotWritten) {
  const auto result = parse_configuration(
      "version = 1\n[pipeline]\nadoption_delay_frames = 30\n[features]\ndetection_interval_frames = 12\n", "test.toml",
      {}, NamedFiles::kMayBeMissing);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->pipeline.adoption_delay, std::chrono::seconds(1));
  EXPECT_EQ(result->features.detection_interval, std::chrono::milliseconds(400));
  EXPECT_EQ(to_toml(*result).find("_frames ="), std::string::npos);
}

TEST(ShippedConfiguration, EachIsAcceptedAndListsEveryKey) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PERIMAP_CONFIG)) {
    if (entry.path().extension() != ".toml") {
      continue;
    }
    ++files;
    const Expected<Configuration> result = load_configuration(entry.path(), {}, NamedFiles::kMayBeMissing);
    ASSERT_TRUE(result) << result.error().message;
    std::ifstream stream(entry.path());
    const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    for (const ConfigurationKey& key : configuration_keys()) {
      if (key.is_former) continue;
      EXPECT_THAT(text, ::testing::AnyOf(HasSubstr("\n" + key.name + " = "), HasSubstr("\n# " + key.name + " = ")))
          << entry.path();
    }
  }
  EXPECT_GT(files, 0);
}

TEST(ShippedConfiguration, TheReplayConfigurationHoldsTheDefaults) {
  Expected<Configuration> result =
      load_configuration(std::filesystem::path(PERIMAP_CONFIG) / "replay.toml", {}, NamedFiles::kMayBeMissing);
  ASSERT_TRUE(result) << result.error().message;
  result->replay.recording.reset();
  EXPECT_EQ(*result, Configuration{});
}

}  // namespace
}  // namespace perimap

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_csv.hpp"
#include "drivers/ecg_file/wfdb.hpp"

namespace perimap {
namespace {

std::string error_of(const std::string& text, const EcgCsvOptions& options = {}) {
  const auto trace = parse_ecg_csv(text, "ecg.csv", options);
  return trace ? "" : trace.error().message;
}

EcgCsvOptions at_rate(std::optional<int> column = {}) { return {.rate_hz = 250.0, .column = column, .gain = 1.0}; }

TEST(EcgCsv, ReadsTimesAndValues) {
  const auto trace = parse_ecg_csv("time_s,mV\r\n0.0,0.5\n\n# a remark\n0.01,\n0.02,nan\n0.03,-1e-1\n", "e", {});
  ASSERT_TRUE(trace) << trace.error().message;
  EXPECT_EQ(trace->time_s, (std::vector<double>{0.0, 0.01, 0.02, 0.03}));
  EXPECT_FLOAT_EQ(trace->mV[0], 0.5F);
  EXPECT_TRUE(std::isnan(trace->mV[1]) && std::isnan(trace->mV[2]));
  EXPECT_FLOAT_EQ(trace->mV[3], -0.1F);
}

TEST(EcgCsv, ReadsValuesAloneAtARateAndAnyColumnWithGain) {
  const auto alone = parse_ecg_csv("1\n2\n3\n", "e", {.rate_hz = 250.0, .column = {}, .gain = 0.005});
  ASSERT_TRUE(alone) << alone.error().message;
  EXPECT_DOUBLE_EQ(alone->time_s[2], 0.008);
  EXPECT_FLOAT_EQ(alone->mV[2], 0.015F);
  const auto third = parse_ecg_csv("time_s,I,II\n0,1,2\n1,3,4\n", "e", {.rate_hz = {}, .column = 3, .gain = 1.0});
  ASSERT_TRUE(third) << third.error().message;
  EXPECT_EQ(third->mV, (std::vector<float>{2.0F, 4.0F}));
}

TEST(EcgCsv, NamesLineAndColumnOfWhatIsWrong) {
  EXPECT_EQ(error_of(""), "ecg.csv: there are no samples in it");
  EXPECT_EQ(error_of("time_s,mV\n"), "ecg.csv: there are no samples in it");
  EXPECT_EQ(error_of("time_s,mV\n0,1\n0.1,x\n"), "ecg.csv:3:5: expected a number, found 'x'");
  EXPECT_EQ(error_of("0,1\nx,1\n"), "ecg.csv:2:1: expected a number, found 'x'");
  EXPECT_EQ(error_of("0,1\n0,1\n"), "ecg.csv:2:1: the times do not ascend");
  EXPECT_EQ(error_of("0,1\n1\n"), "ecg.csv:2:1: the line has no column 2");
  EXPECT_NE(error_of("1\n2\n").find("say --rate"), std::string::npos);
  EXPECT_NE(error_of("0,1\n", {.rate_hz = {}, .column = 5, .gain = 1.0}).find("there is no column 5"),
            std::string::npos);
  for (const char* garbled : {"nan,1\n", "inf,1\n", "1e99,1\n", "0,1e99\n", "0,inf\n", "\x01\x02,\n1\n"}) {
    const std::string message = error_of(garbled);
    EXPECT_FALSE(message.empty()) << garbled;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

// What a heading must say for its first column to be passed over.
TEST(EcgCsv, AtARateTimesAreThoseThatTheHeadingNames) {
  for (const char* heading : {"time_s,mV\n", "Time,mV\n", "TIME , mV\n", "\"Elapsed time\",\"MLII\"\n", " time,mV\n",
                              "\xEF\xBB\xBFtime_s,mV\n", "t (s),mV\n", "# a remark\n\ntime,mV\n",
                              "'Elapsed time','MLII'\n'hh:mm:ss.mmm','mV'\n"}) {
    const auto trace = parse_ecg_csv(std::string(heading) + "60,0.5\n61,0.25\n", "e", at_rate());
    ASSERT_TRUE(trace) << heading << trace.error().message;
    EXPECT_EQ(trace->mV, (std::vector<float>{0.5F, 0.25F})) << heading;
    EXPECT_EQ(trace->time_s, (std::vector<double>{0.0, 0.004})) << heading;
  }
}

TEST(EcgCsv, AtARateSeveralColumnsWithoutTimesNeedToBeTold) {
  for (const char* text : {"60,0.5\n61,0.25\n", "I,II\n60,0.5\n61,0.25\n", "'sample #','MLII'\n60,0.5\n61,0.25\n",
                           "centimetre,mV\n60,0.5\n61,0.25\n"}) {
    const std::string error = error_of(text, at_rate());
    EXPECT_EQ(error.rfind("ecg.csv:1:1: 2 columns, and no heading that begins with a time: say by --column", 0), 0U)
        << text << error;
    const auto second = parse_ecg_csv(text, "e", at_rate(2));
    ASSERT_TRUE(second) << text << second.error().message;
    EXPECT_EQ(second->mV, (std::vector<float>{0.5F, 0.25F})) << text;
    const auto first = parse_ecg_csv(text, "e", at_rate(1));
    ASSERT_TRUE(first) << text << first.error().message;
    EXPECT_EQ(first->mV, (std::vector<float>{60.0F, 61.0F})) << text;
  }
  EXPECT_EQ(error_of("time_s,mV\n0,1\n", at_rate(1)), "ecg.csv:1:1: column 1 holds the time; choose another");
}

TEST(EcgCsv, ReadsHeadingsWithUnitsSpacesAndQuotes) {
  for (const char* text : {"'Elapsed time','MLII'\n'seconds','mV'\n60.5,0.25\n", "time,ecg\n(s),[uV]\n60.5,0.25\n",
                           "time_s,mV\n 60.5 ,\t0.25\n", "\"60.5\",\"0.25\"\n",
                           "\xEF\xBB\xBF"
                           "60.5,0.25\n",
                           "time,0,1\n60.5,0.25,1\n"}) {
    const auto trace = parse_ecg_csv(text, "e", {});
    ASSERT_TRUE(trace) << text << trace.error().message;
    EXPECT_EQ(trace->time_s, (std::vector<double>{60.5})) << text;
    EXPECT_EQ(trace->mV, (std::vector<float>{0.25F})) << text;
  }
  const auto alone = parse_ecg_csv("MLII\nmV\n0.25\n", "e", at_rate());
  ASSERT_TRUE(alone) << alone.error().message;
  EXPECT_EQ(alone->mV, (std::vector<float>{0.25F}));
}

TEST(EcgCsv, TakesNoLineOfValuesForAHeadingOrUnits) {
  struct Case {
    const char* text;
    EcgCsvOptions options;
    const char* error;
  };
  const EcgCsvOptions rate = at_rate();
  for (const Case& one : {
           Case{"x,1\n0,1\n", {}, "ecg.csv:1:1: expected a number, found 'x'"},
           Case{"time,ecg\n'minutes','mV'\n1,1\n", {}, "ecg.csv:2:1: expected times in seconds, found 'minutes'"},
           Case{"'Elapsed time','I'\n'hh:mm:ss','mV'\n1,1\n",
                {},
                "ecg.csv:2:1: expected times in seconds, found 'hh:mm:ss'"},
           Case{"time,ecg\ns,mV\ns,mV\n1,1\n", {}, "ecg.csv:3:1: expected a number, found 's'"},
           Case{"s,mV\n", {}, "ecg.csv: there are no samples in it"},
           Case{"time,ecg\nx,y\n", {}, "ecg.csv:2:1: expected a number, found 'x'"},
           Case{"0,1\ns,mV\n", {}, "ecg.csv:2:1: expected a number, found 's'"},
           Case{"mV\nx\n1\n", rate, "ecg.csv:2:1: expected a number, found 'x'"},
           Case{"mV\n0,5\n", rate, "ecg.csv:2:1: expected one value in a line, as in the first"},
           Case{"1\n2,\n", rate, "ecg.csv:2:1: expected one value in a line, as in the first"},
           Case{"time_s,mV\n0, \" \n", {}, "ecg.csv:2:3: expected a number, found ' \" '"},
           Case{"'0:00.000',1\n", {}, "ecg.csv:1:1: expected a number, found ''0:00.000''"},
           Case{"time\n1\n", rate, "ecg.csv:1:1: column 1 holds the time; choose another"},
       }) {
    EXPECT_EQ(error_of(one.text, one.options), one.error) << one.text;
  }
}

std::string beat_error_of(std::string_view text) {
  const auto beats = parse_beat_table(text, "r.csv");
  return beats ? "" : beats.error().message;
}

TEST(BeatTable, ReadsTimesWithAndWithoutKinds) {
  for (const char* text : {
           "time_s,symbol,sample\n0.5,N,180\n1.2,V,432\n2.0,Q,1\n",
           "time_s, symbol ,sample\n 0.5, N,180\n1.2,V ,432\n2.0,Q,1\n",
           "\"Time\",\"Symbol\"\n0.5,\"N\"\n1.2,'V'\n2.0,Q\n",
           "time_s,sample,class\n0.5,180,normal\n1.2,432,premature\n2.0,1,pause\n",
           "0.5,N\n1.2,V,x\n2.0,Q\n",
           "\xEF\xBB\xBF"
           "0.5,N\n1.2,V\n2.0,noise\n",
       }) {
    const auto table = parse_beat_table(text, "r.csv");
    ASSERT_TRUE(table) << text << table.error().message;
    ASSERT_EQ(table->beats.size(), 3U) << text;
    EXPECT_EQ(table->beats[0].kind, ReferenceBeat::Kind::kNormal) << text;
    EXPECT_EQ(table->beats[1].kind, ReferenceBeat::Kind::kPremature) << text;
    EXPECT_EQ(table->beats[2].kind, ReferenceBeat::Kind::kUnknown) << text;
    EXPECT_EQ(table->beats[1].time_s, 1.2) << text;
    EXPECT_EQ(table->left_out, 0U) << text;
  }
  // A second column of numbers is no kind, and neither is one that the heading calls otherwise.
  for (const char* text :
       {"0.5\n1.5\n", "0.5,180\n1.5,540\n", "time_s,sample\n0.5,180\n1.5,540\n", "time_s,lead\n0.5,V\n1.5,V\n"}) {
    const auto table = parse_beat_table(text, "r.csv");
    ASSERT_TRUE(table) << text << table.error().message;
    EXPECT_EQ(table->beats.size(), 2U) << text;
    EXPECT_EQ(table->beats[0].symbol, "") << text;
  }
}

TEST(BeatTable, LeavesOutAnnotationsThatAreNoBeats) {
  std::string text = "time_s,symbol\n0.1,N\n";
  const std::string no_beats = "[!]x()ptu`'^|~+sTD=\"@";
  for (const char symbol : no_beats) text += std::string("0.2,") + symbol + '\n';
  text += "0.2,\"\"\"\"\n0.2,V\n0.2,+\n0.3,*\n";
  const auto table = parse_beat_table(text, "r.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->left_out, no_beats.size() + 2);
  ASSERT_EQ(table->beats.size(), 3U);
  EXPECT_EQ(table->beats[1].symbol, "V");
  EXPECT_EQ(table->beats[2].kind, ReferenceBeat::Kind::kNormal);
  // Every symbol of a beat is one.
  for (const char symbol : std::string("NLRBAaJSVrFejnE/fQ?*")) {
    const auto one = parse_beat_table(std::string("0.1,") + symbol + '\n', "r.csv");
    ASSERT_TRUE(one) << symbol;
    EXPECT_EQ(one->beats[0].symbol, std::string(1, symbol));
  }
}

TEST(BeatTable, NamesLineAndColumnOfWhatIsWrong) {
  EXPECT_EQ(beat_error_of(""), "r.csv: there are no beats in it");
  EXPECT_EQ(beat_error_of("time_s,symbol\n"), "r.csv: there are no beats in it");
  EXPECT_EQ(beat_error_of("time_s,symbol\n1,+\n"), "r.csv: there are no beats in it");
  EXPECT_EQ(beat_error_of("1\n0.5\n"), "r.csv:2:1: the beats do not ascend");
  EXPECT_EQ(beat_error_of("1,N\n1,V\n"), "r.csv:2:1: the beats do not ascend");
  EXPECT_EQ(beat_error_of("1,N\n0.5,+\n"), "r.csv:2:1: the beats do not ascend");
  EXPECT_EQ(beat_error_of("1,+\n0.5,N\n"), "r.csv:2:1: the beats do not ascend");
  EXPECT_EQ(beat_error_of("sample,symbol\n1,N\n"), "r.csv:1:1: expected a number, found 'sample'");
  EXPECT_EQ(beat_error_of("time_s\ntime_s\n"), "r.csv:2:1: expected a number, found 'time_s'");
  EXPECT_EQ(beat_error_of("1:N\n"), "r.csv:1:1: expected a number, found '1:N'");
  EXPECT_EQ(beat_error_of("1,N\n,N\n"), "r.csv:2:1: expected a number");
  for (const char* garbled : {"nan,N\n", "inf\n", "-1e99,N\n"}) {
    EXPECT_EQ(beat_error_of(garbled), "r.csv:1:1: the time is out of bounds") << garbled;
  }
}

constexpr const char* kHeader = "x 2 360 3\nx.dat 212 200 11 1024 995 2 0 MLII\nx.dat 212 200 11 1024 1011 1 0 V5\n";

TEST(Wfdb, ReadsFormat212) {
  const auto header = parse_wfdb_header(kHeader, "x.hea");
  ASSERT_TRUE(header) << header.error().message;
  EXPECT_EQ(header->rate_hz, 360.0);
  EXPECT_EQ(header->signals[0].description, "MLII");
  // Frames (1024, 1), (-2048, 2), (1026, 3): twelve bits each, two samples in three bytes.
  const std::vector<std::uint8_t> bytes{0x00, 0x04, 0x01, 0x00, 0x08, 0x02, 0x02, 0x04, 0x03};
  const auto first = decode_wfdb_signal(*header, 0, bytes, "x.dat");
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_FLOAT_EQ(first->mV[0], 0.0F);
  EXPECT_TRUE(std::isnan(first->mV[1]));  // the format's "no value"
  EXPECT_FLOAT_EQ(first->mV[2], 0.01F);
  EXPECT_NE(decode_wfdb_signal(*header, 1, bytes, "x.dat").error().message.find("checksum"), std::string::npos);
  const std::span<const std::uint8_t> cut(bytes.data(), 8);
  EXPECT_NE(decode_wfdb_signal(*header, 0, cut, "x.dat").error().message.find("byte 8"), std::string::npos);
}

TEST(Wfdb, ReadsFormat16) {
  const auto header = parse_wfdb_header("y 1 500\ny.dat 16+2 100(-5)/mV\n", "y.hea");
  ASSERT_TRUE(header) << header.error().message;
  const std::vector<std::uint8_t> bytes{0xFF, 0xFF, 0x5F, 0x00, 0x00, 0x80};
  const auto trace = decode_wfdb_signal(*header, 0, bytes, "y.dat");
  ASSERT_TRUE(trace) << trace.error().message;
  ASSERT_EQ(trace->mV.size(), 2U);
  EXPECT_FLOAT_EQ(trace->mV[0], 1.0F);
  EXPECT_TRUE(std::isnan(trace->mV[1]));
}

TEST(Wfdb, RefusesGarbledHeaders) {
  for (const char* text : {"",
                           "# only\n",
                           "x\n",
                           "x 0\n",
                           "x 99999\n",
                           "x -1\n",
                           "x/3 1 360\n",
                           "x 1 0\n",
                           "x 1 -5\n",
                           "x 1 nan\n",
                           "x 1 360 -3\n",
                           "x 2 360\nx.dat 212\n",
                           "x 1 360\nx.dat\n",
                           "x 1 360\nx.dat 212x0\n",
                           "x 1 360\nx.dat 212x\n",
                           "x 1 360\nx.dat 212:\n",
                           "x 1 360\nx.dat 212+\n",
                           "x 1 360\nx.dat 212y4\n",
                           "x 1 360\nx.dat ECG\n",
                           "x/1 1 360\nx_1 650000\n",
                           "x 1 360\nx.dat 212 inf\n",
                           "x 1 360\nx.dat 212 200(\n",
                           "x 1 360\nx.dat 212 200mmHg\n",
                           "x 1 360\nx.dat 212 200 11 zero\n",
                           "x 1 360\nx.dat 212 200 11 0 0 sum\n"}) {
    const auto header = parse_wfdb_header(text, "x.hea");
    ASSERT_FALSE(header) << text;
    EXPECT_EQ(header.error().message.rfind("x.hea", 0), 0U) << header.error().message;
  }
}

// The same three samples in each format.
TEST(Wfdb, ReadsFormatsOfOneToFourBytes) {
  const std::vector<std::pair<std::string, std::vector<std::uint8_t>>> written{
      {"80", {0x7F, 0xE4, 0x00}},
      {"16", {0xFF, 0xFF, 0x64, 0x00, 0x00, 0x80}},
      {"61", {0xFF, 0xFF, 0x00, 0x64, 0x80, 0x00}},
      {"24", {0xFF, 0xFF, 0xFF, 0x64, 0x00, 0x00, 0x00, 0x00, 0x80}},
      {"32", {0xFF, 0xFF, 0xFF, 0xFF, 0x64, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80}}};
  for (const auto& [format, bytes] : written) {
    const auto header = parse_wfdb_header("y 1 500\ny.dat " + format + " 100/mV\n", "y.hea");
    ASSERT_TRUE(header) << header.error().message;
    const auto trace = decode_wfdb_signal(*header, 0, bytes, "y.dat");
    ASSERT_TRUE(trace) << trace.error().message;
    ASSERT_EQ(trace->mV.size(), 3U) << format;
    EXPECT_FLOAT_EQ(trace->mV[0], -0.01F) << format;
    EXPECT_FLOAT_EQ(trace->mV[1], 1.0F) << format;
    EXPECT_TRUE(std::isnan(trace->mV[2])) << format;
  }
  const auto other = parse_wfdb_header("y 1 500\ny.dat 310\n", "y.hea");
  ASSERT_TRUE(other);
  EXPECT_EQ(decode_wfdb_signal(*other, 0, {}, "y.dat").error().message,
            "y.dat: signal 1 is of format 310; 16, 24, 32, 61, 80 and 212 are read");
}

// Two samples a frame of the first signal, one of the second; the third is a frame late.
TEST(Wfdb, ReadsSeveralSamplesAFrameAndASkew) {
  const auto header = parse_wfdb_header(
      "z 3 100 2\nz.dat 80x2 1/mV 8 0 0 0 0 II\nz.dat 80 1/mmHg 8 0 0 0 0 ABP\nz.dat 80:1 1/mV 8 0 0 0 0 V5\n",
      "z.hea");
  ASSERT_TRUE(header) << header.error().message;
  const std::vector<std::uint8_t> bytes{129, 130, 131, 132, 133, 134, 135, 136};
  const auto fast = decode_wfdb_signal(*header, 0, bytes, "z.dat");
  ASSERT_TRUE(fast) << fast.error().message;
  EXPECT_EQ(fast->mV, (std::vector<float>{1.0F, 2.0F, 5.0F, 6.0F}));
  EXPECT_EQ(fast->time_s, (std::vector<double>{0.0, 0.005, 0.01, 0.015}));
  EXPECT_NE(decode_wfdb_signal(*header, 1, bytes, "z.dat").error().message.find("in mmHg, which is no voltage"),
            std::string::npos);
  const auto late = decode_wfdb_signal(*header, 2, bytes, "z.dat");
  ASSERT_TRUE(late) << late.error().message;
  EXPECT_EQ(late->mV, (std::vector<float>{8.0F}));
}

TEST(Wfdb, ChoosesTheFirstLeadOrWhatIsNamed) {
  const auto chosen = [](const std::string& signals, const std::string& wanted) -> std::string {
    const auto header = parse_wfdb_header("x 3 360\n" + signals, "x.hea");
    if (!header) return header.error().message;
    const auto index = choose_wfdb_signal(*header, wanted, "x.hea");
    return index ? header->signals[*index].description : index.error().message;
  };
  const std::string monitor =
      "x.dat 16 1/mV 16 0 0 0 0 RESP\nx.dat 16 1/mmHg 16 0 0 0 0 ABP\nx.dat 16 1/mV 16 0 0 0 0 MLII\n";
  EXPECT_EQ(chosen(monitor, ""), "MLII");
  EXPECT_EQ(chosen(monitor, "resp"), "RESP");
  EXPECT_EQ(chosen(monitor, "2"), "ABP");
  EXPECT_EQ(chosen(monitor, "V5"), "x.hea: there is no signal V5; it has 3: 1 RESP, 2 ABP, 3 MLII");
  EXPECT_EQ(chosen(monitor, "4"), "x.hea: there is no signal 4; it has 3: 1 RESP, 2 ABP, 3 MLII");
  EXPECT_EQ(chosen("x.dat 16 1/mV 16 0 0 0 0 PLETH\nx.dat 16 1/mV 16 0 0 0 0 chest\nx.dat 16\n", ""), "chest");
  EXPECT_NE(
      chosen("x.dat 16 1/NU 16 0 0 0 0 PLETH\nx.dat 16 1/mV 16 0 0 0 0 RESP\nx.dat 16 1/mmHg 16 0 0 0 0 ABP\n", "")
          .find("none of its signals looks like an ECG; say which by --signal"),
      std::string::npos);
}

// As spreadsheets, loggers and statistics programs write it.
TEST(EcgCsv, ReadsOtherSeparatorsAndDecimalCommas) {
  for (const char* text :
       {"time_s,mV\n0,0.5\n0.01,0.6\n0.02,-0.7\n", "time_s;mV\r\n0;0,5\r\n0,01;0,6\r\n0,02;-0,7\r\n",
        "t (s)\tII, chest\n0\t0,5\n0,01\t0,6\n0,02\t-0,7\n", "\xEF\xBB\xBFtime_s;mV\n0;0.5\n0.01;0.6\n0.02;-0.7\n",
        "# a logger's\n0.00  0.5\n0.01  0.6 \n0.02 -0.7\n",
        "time_s\tmV\n0\t\"0.5\"\n0.01\t\"0.6\"\n0.02\t\"-0.7\"\n"}) {
    const auto trace = parse_ecg_csv(text, "e", {});
    ASSERT_TRUE(trace) << trace.error().message << '\n' << text;
    EXPECT_EQ(trace->time_s, (std::vector<double>{0.0, 0.01, 0.02})) << text;
    EXPECT_EQ(trace->mV, (std::vector<float>{0.5F, 0.6F, -0.7F})) << text;
  }
  const auto thousands = parse_ecg_csv("time_s,uV\n0.0,\"1,041.2\"\n0.1,\"-12,000\"\n0.2,\"0,5\"\n", "e", {});
  ASSERT_TRUE(thousands) << thousands.error().message;
  EXPECT_EQ(thousands->mV, (std::vector<float>{1041.2F, -12000.0F, 0.5F}));
  const auto alone = parse_ecg_csv("0,5\n0,6\n", "e", at_rate());
  EXPECT_FALSE(alone) << "a comma between numbers of one column";
}

TEST(EcgCsv, TakesWhatProgramsWriteForNothingAsNothing) {
  const auto trace = parse_ecg_csv("time_s,mV\n0,NA\n1,N/A\n2,null\n3,-\n4,?\n5,NaN\n6,\n7,\"\"\n", "e", {});
  ASSERT_TRUE(trace) << trace.error().message;
  ASSERT_EQ(trace->mV.size(), 8U);
  for (const float mV : trace->mV) EXPECT_TRUE(std::isnan(mV));
}

TEST(EcgCsv, ReadsUnixTimesAndSaysWhatOthersMayBe) {
  const auto trace = parse_ecg_csv("timestamp,ecg\n1700000000.000000,1\n1700000000.002778,2\n", "e", {});
  ASSERT_TRUE(trace) << trace.error().message;
  EXPECT_DOUBLE_EQ(trace->time_s[0], 1.7e9);
  EXPECT_NE(error_of("timestamp,ecg\n1700000000000,1\n").find("is it in milliseconds?"), std::string::npos);
  EXPECT_NE(error_of(std::string("\xFF\xFEt\0", 4)).find("UTF-16"), std::string::npos);
}

TEST(EcgCsv, RefusesCommasThatAreDecimalSignsAsWell) {
  for (const EcgCsvOptions& options : {EcgCsvOptions{}, at_rate()}) {
    EXPECT_NE(error_of("time_s,mV\n0,000000,0,01288\n0,002778,0,01493\n", options)
                  .find("are commas the decimal signs as well?"),
              std::string::npos);
  }
}

TEST(BeatTable, ReadsOtherSeparators) {
  const auto table = parse_beat_table("time_s;symbol\n0,5;N\n1,25;V\n", "r.csv");
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->beats.size(), 2U);
  EXPECT_DOUBLE_EQ(table->beats[1].time_s, 1.25);
  EXPECT_EQ(table->beats[1].kind, ReferenceBeat::Kind::kPremature);
}

}  // namespace
}  // namespace perimap

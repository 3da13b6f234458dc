// The figures of docs/evidence/ecg.md that are made of whole records and of thousands of made leads.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "tables.hpp"

namespace {

struct Options {
  std::vector<std::string> tables;
  std::string folder;
  std::vector<std::string> only;
  std::uint64_t seed = 1;
  int draws = 3000;
};

// False where a table has bounds and they are not kept to.
bool print(const std::string& table, const Options& options) {
  using perimap::test::RecordedLead;
  if (table == "made") return perimap::test::print_made(options.draws, options.seed);
  if (table == "paced") return perimap::test::print_paced(options.draws, options.seed);
  if (options.folder.empty()) throw std::runtime_error(table + ": --records names the folder that its records are in");
  const std::vector<RecordedLead> records = perimap::test::load_records(options.folder, options.only);
  const std::map<std::string, void (*)(const std::vector<RecordedLead>&)> whole{
      {"records", perimap::test::print_records},
      {"peak-times", perimap::test::print_peak_times},
      {"ventricular", perimap::test::print_ventricular},
      {"prediction", perimap::test::print_prediction},
      {"starts", perimap::test::print_starts}};
  if (const auto found = whole.find(table); found != whole.end()) {
    found->second(records);
  } else if (table == "disturbed") {
    perimap::test::print_disturbed(records, options.seed);
  } else {
    perimap::test::print_two_leads(records, options.seed);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tables of the ECG's evidence");
  Options options;
  app.add_option("TABLE", options.tables,
                 "records, peak-times, ventricular, prediction, starts, disturbed, two-leads, made, paced")
      ->required()
      ->check(CLI::IsMember(
          {"records", "peak-times", "ventricular", "prediction", "starts", "disturbed", "two-leads", "made", "paced"}));
  app.add_option("--records", options.folder,
                 "Folder with NNN.hea and its .dat (or NNN_ch0_200perMV_360Hz.i16.gz) and NNN_beats.csv of the records "
                 "of tests/statistics/ecg_records.csv");
  app.add_option("--only", options.only, "These records alone")->delimiter(',');
  app.add_option("--seed", options.seed, "disturbed, two-leads, made, paced: other draws")->capture_default_str();
  app.add_option("--draws", options.draws, "made, paced: so many leads")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    bool kept = true;
    for (const std::string& table : options.tables) {
      if (print(table, options)) continue;
      std::fprintf(stderr, "statistics_ecg: %s: beyond its bounds\n", table.c_str());
      kept = false;
    }
    return kept ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "statistics_ecg: %s\n", error.what());
    return 1;
  }
}

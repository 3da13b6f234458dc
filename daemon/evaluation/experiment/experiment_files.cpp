#include "daemon/evaluation/experiment/experiment_files.hpp"

#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>

#include "daemon/evaluation/experiment/experiment_text.hpp"
#include "daemon/evaluation/traces/trace_text.hpp"
#include "daemon/pages/html_page.hpp"
#include "daemon/pages/png_picture.hpp"
#include "daemon/pages/svg_plot.hpp"
#include "drivers/file/whole_file.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

std::filesystem::path file_of(const std::filesystem::path& folder, int number, const std::string& rest) {
  return folder / ("experiment-" + std::to_string(number) + rest);
}

// Of what their names end with, after "experiment-N".
std::vector<std::string> endings(int number) {
  std::vector<std::string> all{".csv", ".json", ".html"};
  if (number == 3) {
    all.insert(all.end(), {".svg", ".png"});
    return all;
  }
  for (const char* figure : experiment_figures(number)) {
    for (const char* ending : {".svg", ".png", ".csv"}) all.push_back("-" + std::string(figure) + ending);
  }
  return all;
}

}  // namespace

std::vector<std::filesystem::path> experiment_files(int number, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const std::string& ending : endings(number)) files.push_back(file_of(folder, number, ending));
  return files;
}

Expected<void> prepare_experiment_files(int number, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return fail(folder.string() + ": " + error.message());
  for (const std::filesystem::path& file : experiment_files(number, folder)) {
    if (auto able = check_writable(file); !able) return able;
  }
  return {};
}

Expected<void> write_files(const Experiment& experiment, const std::filesystem::path& folder) {
  const auto path = [&](const std::string& rest) { return file_of(folder, experiment.number, rest); };
  for (const ExperimentFigure& figure : experiment.figures) {
    const std::string svg = svg_document(figure.plots, figure.title);
    const auto png = png_of_svg(svg);
    if (!png) return tl::unexpected(png.error());
    for (const auto& [rest, text] : {std::pair{".svg", &svg}, std::pair{".png", &*png}}) {
      if (auto done = write_text_file(path("-" + figure.name + rest), *text); !done) return done;
    }
    if (auto done = write_text_file(path("-" + figure.name + ".csv"), to_csv(figure)); !done) return done;
  }
  return write_text_file(path(".csv"), to_csv(experiment))
      .and_then([&] { return write_text_file(path(".json"), json_document(to_json(experiment))); })
      .and_then([&] { return write_text_file(path(".html"), to_html(experiment)); });
}

Expected<void> write_files(const TraceExperiment& experiment, const std::filesystem::path& folder) {
  const std::string title = "Experiment 3: motion of a real heart, predicted";
  const std::string svg = svg_document(to_plots(experiment), title);
  const auto png = png_of_svg(svg);
  if (!png) return tl::unexpected(png.error());
  const std::pair<const char*, std::string> files[] = {
      {".svg", svg},
      {".png", *png},
      {".csv", to_csv(experiment)},
      {".json", json_document(to_json(experiment))},
      {".html", html_page(title, svg + "<pre>" + escaped(to_table(experiment)) + "</pre>\n")}};
  for (const auto& [ending, text] : files) {
    if (auto done = write_text_file(file_of(folder, 3, ending), text); !done) return done;
  }
  return {};
}

}  // namespace perimap

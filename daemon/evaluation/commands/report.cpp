// `perimap report`: received samples against the truth.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/evaluation/report/accuracy_picture.hpp"
#include "daemon/evaluation/report/report_text.hpp"
#include "daemon/pages/png_picture.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

struct ReportOptions {
  std::string recording;
  std::string samples;
  std::string stream;
  std::string picture;
  std::string json;
  bool whole = false;
  std::vector<double> registration;  // empty: the samples are in the recording's frame
};

// Into the frame of the patient's image.
Expected<std::optional<Pose>> registration_of(const ReportOptions& options) {
  const std::vector<double>& given = options.registration;
  if (given.empty()) return std::optional<Pose>();
  const double wxyz[4] = {given.at(3), given.at(4), given.at(5), given.at(6)};
  if (std::abs(std::hypot(std::hypot(wxyz[0], wxyz[1]), std::hypot(wxyz[2], wxyz[3])) - 1.0) > 1e-3) {
    return fail("--registration: expected a translation and a unit quaternion, TX TY TZ W X Y Z");
  }
  return std::optional(pose_from_wxyz(Vector3d(given.at(0), given.at(1), given.at(2)), wxyz));
}

bool is_png(const std::string& picture) { return std::filesystem::path(picture).extension() == ".png"; }

// The ending says which kind of picture is wanted.
Expected<void> check_picture(const std::string& picture) {
  const std::string ending = std::filesystem::path(picture).extension();
  if (picture.empty() || ending == ".svg" || ending == ".png") return {};
  return fail(fmt::format("--picture: expected a file that ends in .svg or .png, got {}", picture));
}

Expected<void> write_picture(const ReportOptions& options, const AccuracyReport& accuracy) {
  const std::string svg = to_svg(accuracy, options.recording);
  if (!is_png(options.picture)) return write_text_file(options.picture, svg);
  return png_of_svg(svg).and_then([&options](const std::string& png) { return write_text_file(options.picture, png); });
}

Outcome report(const ReportOptions& options) {
  const Output json{"--json", options.json};
  const Output picture{"--picture", options.picture};
  const auto usable = check_apart({json, picture}, {{"a file that is read", options.recording},
                                                    {"a file that is read", options.samples}})
                          .and_then([&options] { return check_picture(options.picture); });
  if (!usable) return refuse(usable.error(), ExitCode::kWrongUsage);
  const auto X_IW = registration_of(options);
  if (!X_IW) return refuse(X_IW.error(), ExitCode::kWrongUsage);
  if (auto able = check_writable({json, picture}); !able) return refuse(able.error());
  const auto result = report_samples(options.recording, options.samples, options.stream,
                                     options.whole ? ReadMode::kWhole : ReadMode::kStrict, *X_IW);
  if (!result) return refuse(result.error());
  fmt::print("{}", to_text(*result));
  if (!options.picture.empty()) {
    if (auto written = write_picture(options, result->accuracy); !written) return refuse(written.error());
    fmt::print("picture     {}\n", options.picture);
  }
  if (options.json.empty()) return {};
  nlohmann::json figures = to_json(*result);
  figures["recording"] = options.recording;
  if (auto written = write_text_file(options.json, json_document(figures)); !written) return refuse(written.error());
  return {};
}

}  // namespace

void add_report_command(Commands& commands) {
  const auto options = std::make_shared<ReportOptions>();
  Command& command =
      commands.add("report", "Compare received samples with the truth of the simulated recording they are of",
                   [options](const Console&) { return report(*options); });
  command.add_option("RECORDING", options->recording, "The simulated recording (MCAP)")->required();
  command.add_option("--samples", options->samples, "What was received (perimap watch --record, replay --samples)")
      ->required();
  command.add_option("--stream", options->stream, "The stream to report on, where there are several: frame or clock");
  command.add_option("--picture", options->picture,
                     "Write motion paths and error over time to this picture (.svg or .png)");
  command.add_option("--json", options->json, "Write the report as JSON to this file");
  command
      .add_option("--registration", options->registration,
                  "TX TY TZ W X Y Z, mm and unit quaternion: the true place of the recording's frame in the patient's "
                  "image, where the samples are in that [they are in the recording's]")
      ->expected(7);
  command.add_flag("--whole", options->whole, "Use what is whole of damaged files");
}

}  // namespace perimap

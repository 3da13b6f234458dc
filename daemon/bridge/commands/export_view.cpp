// `perimap export-view`: a recording for common viewers.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "daemon/bridge/export/view_export.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"

namespace perimap {
namespace {

Outcome export_for_viewers(ViewExportFiles files, const Console& console) {
  if (files.layout.empty()) {
    files.layout = std::filesystem::path(files.output).replace_extension(".layout.json").string();
  }
  const Output output{"OUT", files.output};
  const Output layout{"--layout", files.layout};
  const auto apart = check_apart({output, layout},
                                 {{"the recording itself", files.recording}, {"a file that is read", files.samples}});
  if (!apart) return refuse(apart.error(), ExitCode::kWrongUsage);
  if (auto able = check_writable({output, layout}); !able) return refuse(able.error());
  const auto summary = export_view(files, "perimap " PERIMAP_VERSION);
  if (!summary) return refuse(summary.error());
  for (const std::string& warning : summary->warnings) console.complain(warning);
  fmt::print("pictures    {}\n", summary->pictures);
  fmt::print("surfaces    {}, {} of them shown\n", summary->surfaces, summary->shown);
  fmt::print("ECG values  {}\n", summary->ecg_values);
  fmt::print("poses       {}\n", summary->transforms);
  fmt::print("written     {}\nlayout      {}\n", files.output, files.layout);
  return {};
}

}  // namespace

void add_export_view_command(Commands& commands) {
  const auto files = std::make_shared<ViewExportFiles>();
  Command& command =
      commands.add("export-view",
                   "Writes a recording for Foxglove, Lichtblick and others that read MCAP with Foxglove's schemas: the "
                   "picture with the "
                   "surface over it, the surface and the camera in three dimensions, the ECG, the state, in UTC",
                   [files](const Console& console) { return export_for_viewers(*files, console); });
  command
      .add_option("RECORDING", files->recording,
                  "A recording (MCAP): of the devices, of what was published, or of both")
      ->required();
  command.add_option("OUT", files->output, "Write this file (MCAP)")->required();
  command.add_option("--samples", files->samples,
                     "What was published of it (perimap watch --record, perimap replay --samples)");
  command.add_option("--layout", files->layout,
                     "Write the viewer's layout to this file; without it beside OUT, with the ending .layout.json");
}

}  // namespace perimap

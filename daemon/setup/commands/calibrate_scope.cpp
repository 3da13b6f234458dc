#include "daemon/setup/commands/calibrate_scope.hpp"

#include <fmt/format.h>

#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/pictures.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "daemon/setup/scope_rotation.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {
namespace {

struct CalibrateScopeOptions {
  CommonOptions common;
  std::vector<std::string> pictures;
  std::string recording;
  std::vector<std::vector<std::string>> setups;  // picture, hand-eye, camera

  [[nodiscard]] std::vector<std::string> inputs() const {
    return recording.empty() ? pictures : std::vector{recording};
  }
};

class Readings {
 public:
  void add(const std::string& name, double t_s, const GreyImage& grey) {
    const auto reading = read_field_stop(grey);
    if (reading) {
      pictures_.push_back({name, t_s, *reading});
    } else {
      without_.push_back(name + ": " + reading.error().message);
    }
  }
  [[nodiscard]] Expected<ScopeRotation> rotation() && { return rotation_of(std::move(pictures_), std::move(without_)); }

 private:
  std::vector<ReadPicture> pictures_;
  std::vector<std::string> without_;
};

Expected<ScopeRotation> rotation_in_pictures(const std::vector<std::string>& named) {
  const auto pictures = read_pictures(named);
  if (!pictures) return tl::unexpected(pictures.error());
  Readings readings;
  for (const NamedPicture& picture : *pictures) readings.add(picture.name, 0.0, picture.grey());
  return std::move(readings).rotation();
}

Expected<ScopeRotation> rotation_in_recording(const std::string& recording) {
  constexpr double kFrames_per_s = 2.0;
  Readings readings;
  const auto read = for_each_recorded_frame(recording, kFrames_per_s, [&](double t_s, const GreyImage& grey) {
    readings.add(fmt::format("frame at {:.3f} s", t_s), t_s, grey);
  });
  if (!read) return tl::unexpected(read.error());
  auto rotation = std::move(readings).rotation();
  if (!rotation) return fail(recording + ": " + rotation.error().message);
  return rotation;
}

// The set-up as a function of the rotation, from those that --at names.
Expected<TurnedScope> turned_scope(const CalibrateScopeOptions& options) {
  std::vector<SetupAtRotation> setups;
  Vector2d turn_px = Vector2d::Zero();
  for (const std::vector<std::string>& files : options.setups) {
    const auto rotation = rotation_in_pictures({files.at(0)});
    if (!rotation) return tl::unexpected(rotation.error());
    auto setup = read_setup(files.at(1), files.at(2));
    if (!setup) return tl::unexpected(setup.error());
    const auto lens = read_calibration(files.at(2));
    if (!lens) return tl::unexpected(lens.error());
    const auto picture = read_pictures({files.at(0)});
    if (!picture) return tl::unexpected(picture.error());
    const PictureFile& of = picture->front().picture;
    if (of.width != lens->width || of.height != lens->height) {
      return fail(fmt::format("{}: is {}x{}, and {} is for {}x{}: they belong to one camera as it is used", files.at(0),
                              of.width, of.height, files.at(2), lens->width, lens->height));
    }
    setup->rotation_rad = rotation->rotation_rad;
    setups.push_back(*setup);
    turn_px += rotation->centre_px / static_cast<double>(options.setups.size());
  }
  return fit_turned_scope(setups, turn_px);
}

Expected<Measurement> measure(const CalibrateScopeOptions& options) {
  Measurement measured{"", nlohmann::json::object(), {}};
  if (!options.setups.empty()) {
    const auto scope = turned_scope(options);
    if (!scope) return tl::unexpected(scope.error());
    measured.text += text_of(*scope);
    measured.json["turned_scope"] = json_of(*scope);
    if (options.pictures.empty() && options.recording.empty()) return measured;
  }
  if (options.pictures.empty() == options.recording.empty()) {
    return fail("expected pictures of the field stop, a recording with --from, or set-ups with --at");
  }
  const auto rotation =
      options.recording.empty() ? rotation_in_pictures(options.pictures) : rotation_in_recording(options.recording);
  if (!rotation) return tl::unexpected(rotation.error());
  measured.text += text_of(*rotation);
  measured.json.update(json_of(*rotation));
  measured.plots = plots_of(*rotation);
  return measured;
}

}  // namespace

void add_calibrate_scope(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<CalibrateScopeOptions>();
  Command& command = commands.add(
      calibrate, "scope",
      "How far an angled scope is turned in its camera head, by its field stop's notch; and the set-up by it",
      [options](const Console&) -> Outcome {
        std::vector<std::string> read = options->inputs();
        for (const auto& files : options->setups) read.insert(read.end(), files.begin(), files.end());
        if (auto able = check_outputs(options->common, read); !able) return able;
        return finish(measure(*options), options->common, joined(options->inputs()));
      });
  command.footer(
      "perimapd does not take a turned scope's state: it maps with the set-up of its configuration. Who turns the "
      "scope "
      "measures hand-eye and lens anew, or writes what this says of the new turn into the configuration.");
  command.add_option("IMAGES", options->pictures, "Pictures with the field stop, folders of them, or a video");
  add_from(command, options->recording);
  command
      .add_option_function<std::vector<std::string>>(
          "--at", [options](const std::vector<std::string>& files) { options->setups.push_back(files); },
          "PICTURE HAND_EYE CAMERA: a picture at one turn of the scope, and what perimap calibrate hand-eye --output "
          "and "
          "calibrate camera --output wrote then; give it twice and more, for the set-up as a function of the turn")
      ->expected(3)
      ->trigger_on_parse();
  add_common(command, options->common, false, false);
}

}  // namespace perimap

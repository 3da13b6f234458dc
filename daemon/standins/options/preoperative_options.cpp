#include "daemon/standins/options/preoperative_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <system_error>

#include "core/angle/angle.hpp"
#include "core/error/one_line.hpp"
#include "drivers/mesh_file/mesh_file.hpp"
#include "drivers/standins/simulator/second_heart.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr int kMostPhases = 64;
constexpr int kFewestPhases = 3;

// The phase at that share of a cycle of middle length, by the law of the session.
double phase_at(const HeartMotion& motion, double cycle_share) {
  const std::size_t first = (motion.r_peaks.size() - 2) / 2;
  const Duration length = motion.r_peaks[first + 1] - motion.r_peaks[first];
  return motion_phase(motion, motion.r_peaks[first] + from_seconds(cycle_share * to_seconds(length))).phase_rad;
}

// With its middle where the first heart's is, in the model's frame.
TriangleMesh another_heart(const PreoperativeModel& model, std::uint64_t seed, double phase_rad) {
  TriangleMesh mesh = surface_at(second_heart(seed), phase_rad);
  for (Vector3d& vertex : mesh.vertices) vertex = model.true_X_IW.R * vertex + model.middle_I;
  return mesh;
}

}  // namespace

void PreoperativeOptions::add_to(Command& command) {
  command.add_option(
      "--preoperative", folder_,
      "Of a heart: write a preoperative model of it into this folder (heart.ply, mm), which is not the truth; another "
      "heart (other_heart.ply), the registration that is known of it (start.json) and the true one (truth.json)");
  const auto add = [&](const char* name, double& value, const char* what, const Range& range) {
    others_.emplace_back(name, command.add_option(name, value, what)->check(range)->capture_default_str());
  };
  add("--preoperative-phase", cycle_share_, "With --preoperative: when it was imaged, as a share of the heart's cycle",
      {0.0, 0.999});
  add("--shape-error", shape_mm_, "With --preoperative: how far its shape is off, RMS, mm", {0.0, 20.0});
  add("--shape-length", shape_length_mm_, "With --preoperative: over which distance that changes, mm", {5.0, 200.0});
  add("--off-mm", off_mm_, "With --preoperative: how far the registration that is known is off", {0.01, 100.0});
  add("--off-deg", off_deg_, "With --preoperative: by how much that is turned", {0.01, 90.0});
  others_.emplace_back(
      "--model-phases",
      command
          .add_option("--model-phases", phases_,
                      "With --preoperative: at so many phases of its motion, evenly spread (heart_1.ply and on; "
                      "model.toml has the configuration)")
          ->check(Range(1, kMostPhases))
          ->capture_default_str());
  add("--model-shift", motion_shift_,
      "With --model-phases: its motion is not the heart's, but earlier by this share of the cycle", {-0.5, 0.5});
  add("--model-scale", motion_scale_, "With --model-phases: likewise, so many times as large", {0.0, 3.0});
  add("--model-error", motion_error_,
      "With --model-phases: likewise, too large or too small from place to place, RMS as a share", {0.0, 1.0});
  others_.emplace_back("--other-motion", command.add_flag("--other-motion", other_motion_,
                                                          "With --model-phases: likewise, that of another heart"));
}

std::vector<double> PreoperativeOptions::other_shares() const {
  std::vector<double> shares;
  for (int k = 1; k < phases_; ++k) {
    const double share = cycle_share_ + static_cast<double>(k) / phases_;
    shares.push_back(share - std::floor(share));
  }
  return shares;
}

std::vector<std::string> PreoperativeOptions::other_names() const {
  std::vector<std::string> names;
  for (int k = 1; k < phases_; ++k) names.push_back(fmt::format("heart_{}.ply", k));
  return names;
}

std::string PreoperativeOptions::configuration() const {
  return fmt::format(
      "version = 1\n[model]\nfile = \"heart.ply\"\nphase = {}\nshape_mm = {}\nother_files = [\"{}\"]\n"
      "other_phases = [{}]\n",
      cycle_share_, std::max(shape_mm_, 0.05), fmt::join(other_names(), "\", \""), fmt::join(other_shares(), ", "));
}

std::vector<std::filesystem::path> PreoperativeOptions::files() const {
  std::vector<std::filesystem::path> files = {folder_ / "heart.ply", folder_ / "other_heart.ply",
                                              folder_ / "start.json", folder_ / "truth.json"};
  for (const std::string& name : other_names()) files.push_back(folder_ / name);
  if (phases_ > 1) files.push_back(folder_ / "model.toml");
  return files;
}

Expected<void> PreoperativeOptions::check() const {
  for (const auto& [name, option] : others_) {
    if (!wanted() && option->count() > 0) {
      return fail(name + ": expected --preoperative, whose model it is of");
    }
  }
  const bool of_motion = motion_shift_ != 0.0 || motion_scale_ != 1.0 || motion_error_ > 0.0 || other_motion_;
  if (phases_ < kFewestPhases && of_motion) {
    return fail(
        fmt::format("--model-phases: expected at least {} of a model that moves, got {}", kFewestPhases, phases_));
  }
  if (phases_ > 1 && phases_ < kFewestPhases) {
    return fail(
        fmt::format("--model-phases: expected 1, or at least {} to tell a motion, got {}", kFewestPhases, phases_));
  }
  return {};
}

PreoperativeSettings PreoperativeOptions::settings(const Simulation& simulation) const {
  PreoperativeSettings settings;
  settings.seed = simulation.settings().seed;
  settings.phase_rad = phase_at(simulation.truth().motion(), cycle_share_);
  settings.shape_error_mm = shape_mm_;
  settings.shape_length_mm = shape_length_mm_;
  settings.off_mm = off_mm_;
  settings.off_rad = off_deg_ * kDegree;
  for (const double share : other_shares()) {
    settings.other_phases_rad.push_back(phase_at(simulation.truth().motion(), share));
  }
  settings.motion_shift_rad = 2.0 * std::numbers::pi * motion_shift_;
  settings.motion_scale = motion_scale_;
  settings.motion_error = motion_error_;
  settings.other_motion = other_motion_;
  return settings;
}

Expected<void> PreoperativeOptions::write(const Simulation& simulation) const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) return fail(on_one_line(fmt::format("{}: cannot be made: {}", folder_.string(), error.message())));
  const PreoperativeSettings settings = this->settings(simulation);
  const PreoperativeModel model = preoperative_model(simulation.truth().mesh(), settings);
  std::vector<std::string> texts = {ply_text(model.mesh_I),
                                    ply_text(another_heart(model, settings.seed, settings.phase_rad)),
                                    start_registration_of(model, settings), true_registration_of(model)};
  for (const TriangleMesh& other : model.others_I) texts.push_back(ply_text(other));
  if (phases_ > 1) texts.push_back(configuration());
  const std::vector<std::filesystem::path> files = this->files();
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (auto written = write_text_file(files[i], texts[i]); !written) return written;
  }
  return {};
}

}  // namespace perimap

#include "daemon/standins/options/preoperative_options.hpp"

#include <fmt/format.h>

#include <system_error>

#include "core/angle/angle.hpp"
#include "core/error/one_line.hpp"
#include "drivers/mesh_file/mesh_file.hpp"
#include "drivers/standins/simulator/second_heart.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

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
}

std::vector<std::filesystem::path> PreoperativeOptions::files() const {
  return {folder_ / "heart.ply", folder_ / "other_heart.ply", folder_ / "start.json", folder_ / "truth.json"};
}

Expected<void> PreoperativeOptions::check() const {
  for (const auto& [name, option] : others_) {
    if (!wanted() && option->count() > 0) {
      return fail(name + ": expected --preoperative, whose model it is of");
    }
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
  return settings;
}

Expected<void> PreoperativeOptions::write(const Simulation& simulation) const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) return fail(on_one_line(fmt::format("{}: cannot be made: {}", folder_.string(), error.message())));
  const PreoperativeSettings settings = this->settings(simulation);
  const PreoperativeModel model = preoperative_model(simulation.truth().mesh(), settings);
  const std::vector<std::string> texts = {ply_text(model.mesh_I),
                                          ply_text(another_heart(model, settings.seed, settings.phase_rad)),
                                          start_registration_of(model, settings), true_registration_of(model)};
  const std::vector<std::filesystem::path> files = this->files();
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (auto written = write_text_file(files[i], texts[i]); !written) return written;
  }
  return {};
}

}  // namespace perimap

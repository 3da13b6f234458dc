// What pictures look like, by what matters to a tracker: a line for each video, recording or folder of videos given, so
// that footage and simulated looks can be held side by side. Arguments: [--width PX] [--frames N] [--looks SEED]
// PATH...
// --width: wider pictures are reduced to it first, by their means. --looks: all that the simulator has, of this seed.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/evaluation/tracking/frame_source.hpp"
#include "drivers/standins/simulator/simulation.hpp"
#include "tests/simulated/picture_statistics.hpp"

namespace perimap::bench {
namespace {

struct Looked {
  std::string name;
  int width = 0, height = 0;
  PictureStatistics statistics;
};

bool look_at(const std::string& path, int width, std::size_t frames, std::vector<Looked>& looked) {
  auto source = FrameSource::open(path);
  if (!source) {
    std::fprintf(stderr, "%s\n", source.error().message.c_str());
    return false;
  }
  PictureWatch watch((*source)->frames_per_s() > 0 ? (*source)->frames_per_s() : 25);
  Looked one;
  one.name = std::filesystem::path(path).filename().string();
  cv::Mat reduced;
  for (std::size_t k = 0; k < frames; ++k) {
    const auto frame = (*source)->next();
    if (!frame) {
      std::fprintf(stderr, "%s\n", frame.error().message.c_str());
      return false;
    }
    if (*frame == nullptr) break;
    GreyImage grey = (*frame)->grey;
    if (width > 0 && grey.width > width) {
      const cv::Mat whole(grey.height, grey.width, CV_8UC1, const_cast<std::uint8_t*>(grey.data),
                          static_cast<std::size_t>(grey.stride));
      cv::resize(whole, reduced, {width, grey.height * width / grey.width}, 0, 0, cv::INTER_AREA);
      grey = {reduced.data, reduced.cols, reduced.rows, static_cast<std::ptrdiff_t>(reduced.step)};
    }
    one.width = grey.width;
    one.height = grey.height;
    watch.look_at(grey);
  }
  one.statistics = watch.statistics();
  looked.push_back(one);
  return true;
}

bool look_at_look(const SimulationSettings& settings, std::size_t frames, std::vector<Looked>& looked) {
  const auto simulation = Simulation::create(settings);
  if (!simulation) {
    std::fprintf(stderr, "%s\n", simulation.error().message.c_str());
    return false;
  }
  PictureWatch watch(settings.frames_per_s);
  RenderWorkspace workspace;
  std::vector<std::uint8_t> picture(static_cast<std::size_t>(settings.width) *
                                    static_cast<std::size_t>(settings.height));
  for (std::size_t k = 0; k < std::min(frames, simulation->frames().size()); ++k) {
    simulation->render(k, workspace, picture);
    watch.look_at({picture.data(), settings.width, settings.height, settings.width});
  }
  looked.push_back(
      {std::string("look ") + name_of(settings.look), settings.width, settings.height, watch.statistics()});
  return true;
}

void print(const std::vector<Looked>& looked) {
  std::printf("| picture | size |");
  for (const NamedStatistic& statistic : named_statistics()) {
    std::printf(" %.*s |", static_cast<int>(statistic.name.size()), statistic.name.data());
  }
  std::printf("\n|---|---|");
  for (std::size_t i = 0; i < named_statistics().size(); ++i) std::printf("---|");
  for (const Looked& one : looked) {
    std::printf("\n| %s | %dx%d |", one.name.c_str(), one.width, one.height);
    for (const NamedStatistic& statistic : named_statistics()) {
      std::printf(" %.*f |", statistic.decimals, one.statistics.*statistic.value);
    }
  }
  std::printf("\n");
}

}  // namespace
}  // namespace perimap::bench

int main(int argc, char** argv) {
  int width = 0;
  std::size_t frames = 40;
  std::vector<std::string> paths;
  std::vector<std::uint64_t> seeds;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word(argv[i]);
    const bool is_option = word == "--width" || word == "--frames" || word == "--looks";
    if (is_option && i + 1 < argc) {
      const long value = std::strtol(argv[++i], nullptr, 10);
      if (word == "--width") width = static_cast<int>(value);
      if (word == "--frames") frames = static_cast<std::size_t>(value);
      if (word == "--looks") seeds.push_back(static_cast<std::uint64_t>(value));
      continue;
    }
    if (std::filesystem::is_directory(word)) {
      std::vector<std::string> in_folder;
      for (const auto& entry : std::filesystem::directory_iterator(word)) {
        if (entry.path().extension() == ".mp4") in_folder.push_back(entry.path().string());
      }
      std::sort(in_folder.begin(), in_folder.end());
      paths.insert(paths.end(), in_folder.begin(), in_folder.end());
      continue;
    }
    paths.emplace_back(word);
  }
  if (paths.empty() && seeds.empty()) {
    std::fprintf(stderr, "look_bench [--width PX] [--frames N] [--looks SEED] PATH...\n");
    return 2;
  }
  std::vector<perimap::bench::Looked> looked;
  bool all = true;
  for (const std::string& path : paths) all = perimap::bench::look_at(path, width, frames, looked) && all;
  for (const std::uint64_t seed : seeds) {
    for (const perimap::Look look : {perimap::Look::kRendered, perimap::Look::kTissue}) {
      for (const int side : {1, 2}) {
        perimap::SimulationSettings settings;
        settings.seed = seed;
        settings.look = look;
        settings.width = 320 * side;
        settings.height = 240 * side;
        settings.duration = std::chrono::seconds(10);
        all = perimap::bench::look_at_look(settings, frames, looked) && all;
      }
    }
  }
  perimap::bench::print(looked);
  return all ? 0 : 1;
}

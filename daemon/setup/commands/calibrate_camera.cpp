#include "daemon/setup/commands/calibrate_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/camera_report.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "drivers/video/picture_file.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

struct CameraOptions {
  CommonOptions common;
  std::vector<std::string> pictures;
  std::string board = "auto";
  std::string size;
  std::string lens = "brown-conrady";
  BoardWish wish;
};

struct NamedPicture {
  std::string name;
  PictureFile picture;

  [[nodiscard]] GreyImage grey() const { return {picture.grey.data(), picture.width, picture.height, picture.width}; }
};

constexpr std::size_t kMostPictures = 2000;

bool is_video(const std::filesystem::path& path) {
  constexpr std::string_view kVideos[] = {".mp4", ".mkv", ".avi", ".mov", ".mpg", ".m4v", ".webm"};
  return std::find(std::begin(kVideos), std::end(kVideos), path.extension().string()) != std::end(kVideos);
}

// The files, and those of a folder by their names.
std::vector<std::string> files_of(const std::vector<std::string>& named) {
  std::vector<std::string> files;
  for (const std::string& name : named) {
    std::error_code error;
    if (!std::filesystem::is_directory(name, error)) {
      files.push_back(name);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : std::filesystem::directory_iterator(name, error)) {
      if (entry.is_regular_file(error)) inside.push_back(entry.path().string());
    }
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

// Two a second of a video.
Expected<void> read_video(const std::string& file, std::vector<NamedPicture>& pictures) {
  auto reader = VideoReader::open(file);
  if (!reader) return tl::unexpected(reader.error());
  const double rate = (*reader)->frames_per_s() > 0 ? (*reader)->frames_per_s() : 30.0;
  const auto every = static_cast<std::uint64_t>(std::max(1.0, rate / 2.0));
  std::uint64_t wanted = 0;
  while (pictures.size() < kMostPictures) {
    const auto frame = (*reader)->next();
    if (!frame) return tl::unexpected(frame.error());
    if (*frame == nullptr) break;
    if ((*frame)->number < wanted) continue;
    wanted = (*frame)->number + every;
    const GreyImage& grey = (*frame)->grey;
    NamedPicture picture{fmt::format("{}, frame {}", file, (*frame)->number), {grey.width, grey.height, {}}};
    for (int y = 0; y < grey.height; ++y) {
      const auto* row = grey.data + y * grey.stride;
      picture.picture.grey.insert(picture.picture.grey.end(), row, row + grey.width);
    }
    pictures.push_back(std::move(picture));
  }
  return {};
}

Expected<std::vector<NamedPicture>> read_pictures(const std::vector<std::string>& named) {
  std::vector<NamedPicture> pictures;
  for (const std::string& file : files_of(named)) {
    if (is_video(file)) {
      if (const auto read = read_video(file, pictures); !read) return tl::unexpected(read.error());
    } else {
      auto picture = read_picture(file);
      if (!picture) return tl::unexpected(picture.error());
      pictures.push_back({file, *std::move(picture)});
    }
    const PictureFile& first = pictures.front().picture;
    const PictureFile& last = pictures.back().picture;
    if (last.width != first.width || last.height != first.height) {
      return fail(fmt::format("{}: is {}x{}, and {} is {}x{}: pictures of one camera, uncut, are needed",
                              pictures.back().name, last.width, last.height, pictures.front().name, first.width,
                              first.height));
    }
  }
  if (pictures.empty()) return fail("there are no pictures");
  return pictures;
}

Expected<void> take_board(CameraOptions& options) {
  static const std::vector<std::pair<std::string, BoardKind>> kKinds = {
      {"chessboard", BoardKind::kChessboard},
      {"charuco", BoardKind::kCharuco},
      {"markers", BoardKind::kMarkers},
      {"circles", BoardKind::kCircles},
      {"asymmetric-circles", BoardKind::kAsymmetricCircles}};
  for (const auto& [name, kind] : kKinds) {
    if (options.board == name) options.wish.kind = kind;
  }
  if (options.size.empty()) return {};
  const std::size_t cross = options.size.find('x');
  const auto side = [](std::string_view text, int& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && value >= 2 && value <= 100;
  };
  const std::string_view size = options.size;
  if (cross == std::string::npos || !side(size.substr(0, cross), options.wish.columns) ||
      !side(size.substr(cross + 1), options.wish.rows)) {
    return fail("--size: expected COLUMNSxROWS, such as 9x6, got " + options.size);
  }
  return {};
}

Expected<Measurement> measure(CameraOptions& options) {
  if (const auto taken = take_board(options); !taken) return tl::unexpected(taken.error());
  const auto pictures = read_pictures(options.pictures);
  if (!pictures) return tl::unexpected(pictures.error());
  std::vector<GreyImage> greys;
  for (const NamedPicture& picture : *pictures) greys.push_back(picture.grey());
  const auto board = recognise_board(greys, options.wish);
  if (!board) return tl::unexpected(board.error());
  std::vector<BoardView> views;
  std::vector<std::string> without;
  for (const NamedPicture& picture : *pictures) {
    auto view = find_board(picture.grey(), *board);
    if (!view) {
      without.push_back(picture.name);
      continue;
    }
    view->name = picture.name;
    views.push_back(*std::move(view));
  }
  CameraCalibrationSettings settings;
  if (options.lens == "fisheye") settings.lens = Lens::kKannalaBrandt;
  const GreyImage& first = greys.front();
  const auto result = calibrate_camera(views, first.width, first.height, settings);
  if (!result) {
    return fail(fmt::format("{} (looked for: {}; {} of {} pictures show it)", result.error().message, name_of(*board),
                            views.size(), pictures->size()));
  }
  Measurement measured;
  measured.text = text_of(*result, *board, without);
  measured.json = json_of(*result, *board, without);
  measured.plots = plots_of(*result);
  measured.file = calibration_text_of(*result, *board, date_now());
  return measured;
}

Outcome run(CameraOptions& options) {
  if (auto able = check_outputs(options.common, options.pictures); !able) return able;
  const std::string made_from =
      options.pictures.size() > 3 ? fmt::format("{} and {} more", options.pictures.front(), options.pictures.size() - 1)
                                  : joined(options.pictures);
  return finish(measure(options), options.common, made_from);
}

}  // namespace

void add_calibrate_camera(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<CameraOptions>();
  Command& command =
      commands.add(calibrate, "camera", "Focal lengths, principal point and distortion, from pictures of a board",
                   [options](const Console&) { return run(*options); });
  command.add_option("IMAGES", options->pictures, "Pictures of one board, folders of them, or a video")->required();
  command.add_option("--board", options->board, "What the board is; auto: it is looked for")
      ->check(OneOf({"auto", "chessboard", "charuco", "markers", "circles", "asymmetric-circles"}))
      ->capture_default_str();
  command.add_option(
      "--size", options->size,
      "COLUMNSxROWS: a chessboard's inner corners, a ChArUco board's squares, markers or circles; none: looked for");
  command.add_option("--square-mm", options->wish.square_mm, "Side of a square, or distance of neighbours")
      ->check(Range(0.01, 1e4));
  command.add_option("--marker-mm", options->wish.marker_mm, "Side of a marker")->check(Range(0.01, 1e4));
  command.add_option("--dictionary", options->wish.dictionary, "Of the markers, such as 4X4_250 or APRILTAG_36h11");
  command.add_option("--lens", options->lens, "Model of the distortion; fisheye for more than 120 degrees")
      ->check(OneOf({"brown-conrady", "fisheye"}))
      ->capture_default_str();
  add_common(command, options->common, false, false);
}

}  // namespace perimap

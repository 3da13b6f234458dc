// Legacy VTK, POLYDATA: The VTK User's Guide, "VTK File Formats". Cells as version 4 has them (each with its number of
// corners) or as version 5 (OFFSETS and CONNECTIVITY). What follows the polygons, data of points and cells, is not
// read.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/mesh_file/mesh_formats.hpp"

namespace perimap {
namespace {

class VtkReader {
 public:
  explicit VtkReader(MeshCursor at) : at_(at) {}

  Expected<TriangleMesh> read() {
    static_cast<void>(at_.line());  // the version
    static_cast<void>(at_.line());  // a title of any words
    const std::string_view format = at_.line();
    if (format != "ASCII" && format != "BINARY") {
      return at_.wrong_line(fmt::format("expected ASCII or BINARY, got: {}", quoted(format)));
    }
    binary_ = format == "BINARY";
    if (at_.word() != "DATASET" || at_.word() != "POLYDATA") {
      return at_.wrong_line("expected 'DATASET POLYDATA': another kind of data is no surface");
    }
    for (;;) {
      const std::string_view section = at_.word();
      if (section.empty() || section == "POINT_DATA" || section == "CELL_DATA" || section == "FIELD") break;
      auto read = read_section(section);
      if (!read) return tl::unexpected(read.error());
    }
    return finished();
  }

 private:
  Expected<void> read_section(std::string_view section) {
    if (section == "METADATA") {
      // It ends with an empty line.
      static_cast<void>(at_.line());
      while (!at_.at_end() && !at_.line().empty()) {
      }
      return {};
    }
    if (section == "POINTS") return read_points();
    if (section == "POLYGONS" || section == "VERTICES" || section == "LINES") {
      return read_cells(section == "POLYGONS");
    }
    if (section == "TRIANGLE_STRIPS") return at_.wrong_line("triangle strips are not read: export plain triangles");
    return at_.wrong_line(fmt::format("expected a section of POLYDATA, got: {}", quoted(section)));
  }

  Expected<std::size_t> count(std::string_view what) {
    const auto value = at_.integer(what);
    if (!value) return tl::unexpected(value.error());
    if (*value < 0 || static_cast<std::uint64_t>(*value) > at_.left()) {
      return at_.wrong_line(fmt::format("{} is {}, more than the file holds", what, *value));
    }
    return static_cast<std::size_t>(*value);
  }

  Expected<void> read_points() {
    const auto points = count("the number of points");
    if (!points) return tl::unexpected(points.error());
    const std::string_view type = at_.word();
    if (type != "float" && type != "double") {
      return at_.wrong_line(fmt::format("expected points of type float or double, got: {}", quoted(type)));
    }
    const bool is_double = type == "double";
    static_cast<void>(at_.line());
    mesh_.vertices.clear();
    for (std::size_t i = 0; i < *points; ++i) {
      Vector3d p = Vector3d::Zero();
      for (double& x : p) {
        const auto value = binary_ ? raw_real(is_double) : at_.real("a coordinate");
        if (!value) return tl::unexpected(value.error());
        x = *value;
      }
      mesh_.vertices.push_back(p);
    }
    return {};
  }

  Expected<double> raw_real(bool is_double) {
    std::optional<double> value;
    if (is_double) {
      value = at_.raw<double>(true);
    } else if (const auto narrow = at_.raw<float>(true)) {
      value = static_cast<double>(*narrow);
    }
    if (!value) return at_.wrong_byte("ends within its points");
    return *value;
  }

  Expected<std::int64_t> index(bool wide) {
    if (!binary_) return at_.integer("a vertex or a number of corners");
    std::optional<std::int64_t> value;
    if (wide) {
      value = at_.raw<std::int64_t>(true);
    } else if (const auto narrow = at_.raw<std::int32_t>(true)) {
      value = *narrow;
    }
    if (!value) return at_.wrong_byte("ends within its polygons");
    return *value;
  }

  Expected<std::vector<std::int64_t>> indices(std::size_t number, bool wide) {
    std::vector<std::int64_t> values;
    for (std::size_t i = 0; i < number; ++i) {
      const auto value = index(wide);
      if (!value) return tl::unexpected(value.error());
      values.push_back(*value);
    }
    return values;
  }

  // Two numbers follow: of cells and of all numbers, or of offsets and of corners.
  Expected<void> read_cells(bool are_polygons) {
    const auto first = count("the number of polygons");
    if (!first) return tl::unexpected(first.error());
    const auto second = count("the number of indices");
    if (!second) return tl::unexpected(second.error());
    static_cast<void>(at_.line());
    MeshCursor ahead = at_;
    if (ahead.word() == "OFFSETS") return read_by_offsets(*first, *second, are_polygons);
    const auto numbers = indices(*second, false);
    if (!numbers) return tl::unexpected(numbers.error());
    std::size_t at = 0;
    for (std::size_t cell = 0; cell < *first; ++cell) {
      const std::int64_t corners = at < numbers->size() ? (*numbers)[at++] : -1;
      if (corners < 0 || static_cast<std::uint64_t>(corners) > numbers->size() - at) {
        return at_.wrong_file(fmt::format("polygon {} has more corners than its section has numbers", cell));
      }
      if (are_polygons)
        polygons_.emplace_back(numbers->begin() + static_cast<std::ptrdiff_t>(at),
                               numbers->begin() + static_cast<std::ptrdiff_t>(at) + corners);
      at += static_cast<std::size_t>(corners);
    }
    return {};
  }

  Expected<std::vector<std::int64_t>> named_array(std::string_view name, std::size_t number) {
    if (const auto word = at_.word(); word != name) {
      return at_.wrong_line(fmt::format("expected {}, got: {}", name, quoted(word)));
    }
    const std::string_view type = at_.word();
    if (type != "vtktypeint64" && type != "vtktypeint32" && type != "int") {
      return at_.wrong_line(fmt::format("expected indices of type vtktypeint64, got: {}", quoted(type)));
    }
    const bool wide = type == "vtktypeint64";
    static_cast<void>(at_.line());
    return indices(number, wide);
  }

  Expected<void> read_by_offsets(std::size_t offsets, std::size_t corners, bool are_polygons) {
    const auto begins = named_array("OFFSETS", offsets);
    if (!begins) return tl::unexpected(begins.error());
    const auto all = named_array("CONNECTIVITY", corners);
    if (!all) return tl::unexpected(all.error());
    for (std::size_t cell = 0; are_polygons && cell + 1 < begins->size(); ++cell) {
      const std::int64_t begin = (*begins)[cell], end = (*begins)[cell + 1];
      if (begin < 0 || end < begin || static_cast<std::uint64_t>(end) > all->size()) {
        return at_.wrong_file(fmt::format("the offsets of polygon {} are none", cell));
      }
      polygons_.emplace_back(all->begin() + begin, all->begin() + end);
    }
    return {};
  }

  Expected<TriangleMesh> finished() {
    for (std::size_t i = 0; i < polygons_.size(); ++i) {
      switch (add_polygon(polygons_[i], mesh_.vertices.size(), mesh_)) {
        case AddedPolygon::kAdded:
          break;
        case AddedPolygon::kNoVertex:
          return at_.wrong_file(
              fmt::format("polygon {} has a vertex that is not there: there are {}", i, mesh_.vertices.size()));
        case AddedPolygon::kTooMany:
          return at_.wrong_file(too_many_triangles());
      }
    }
    return std::move(mesh_);
  }

  MeshCursor at_;
  bool binary_ = false;
  TriangleMesh mesh_;
  std::vector<std::vector<std::int64_t>> polygons_;
};

}  // namespace

Expected<TriangleMesh> parse_vtk(MeshCursor at) { return VtkReader(at).read(); }

}  // namespace perimap

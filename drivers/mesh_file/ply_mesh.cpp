// PLY: Turk, The PLY Polygon File Format, 1994. Elements that are neither `vertex` nor `face` are passed over.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/mesh_file/mesh_formats.hpp"

namespace perimap {
namespace {

enum class PlyType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
enum class PlyFormat : std::uint8_t { kText, kLittleEndian, kBigEndian };

std::optional<PlyType> type_named(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames{{{"char", PlyType::kInt8},
                                                                         {"int8", PlyType::kInt8},
                                                                         {"uchar", PlyType::kUint8},
                                                                         {"uint8", PlyType::kUint8},
                                                                         {"short", PlyType::kInt16},
                                                                         {"int16", PlyType::kInt16},
                                                                         {"ushort", PlyType::kUint16},
                                                                         {"uint16", PlyType::kUint16},
                                                                         {"int", PlyType::kInt32},
                                                                         {"int32", PlyType::kInt32},
                                                                         {"uint", PlyType::kUint32},
                                                                         {"uint32", PlyType::kUint32},
                                                                         {"float", PlyType::kFloat},
                                                                         {"float32", PlyType::kFloat},
                                                                         {"double", PlyType::kDouble},
                                                                         {"float64", PlyType::kDouble}}};
  for (const auto& [known, type] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  PlyType type = PlyType::kFloat;
  std::optional<PlyType> length;  // of a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::kText;
  std::vector<Element> elements;
};

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (!line.empty()) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
    const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    if (end > begin) words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
  return words;
}

Expected<Property> property_of(const std::vector<std::string_view>& words, const MeshCursor& at) {
  Property property;
  const bool list = words.size() == 5 && words[1] == "list";
  if (!list && words.size() != 3)
    return at.wrong_line("expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
  const auto type = type_named(words[list ? 3 : 1]);
  const auto length = list ? type_named(words[2]) : std::nullopt;
  if (!type || (list && !length)) return at.wrong_line("the property has a type that PLY does not know");
  if (length == PlyType::kFloat || length == PlyType::kDouble)
    return at.wrong_line("a list's length is a whole number");
  property.name = words.back();
  property.type = *type;
  property.length = length;
  return property;
}

Expected<PlyHeader> header_of(MeshCursor& at) {
  constexpr std::size_t kMostElements = 32, kMostProperties = 128;
  PlyHeader header;
  bool has_format = false;
  static_cast<void>(at.line());  // ply
  for (;;) {
    if (at.at_end()) return at.wrong_line("ends within its header");
    const auto words = words_of(at.line());
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      if (words[1] != "ascii" && words[1] != "binary_little_endian" && words[1] != "binary_big_endian") {
        return at.wrong_line(fmt::format("the format {} is none that PLY has", quoted(words[1])));
      }
      header.format = words[1] == "ascii"                  ? PlyFormat::kText
                      : words[1] == "binary_little_endian" ? PlyFormat::kLittleEndian
                                                           : PlyFormat::kBigEndian;
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3 && header.elements.size() < kMostElements) {
      const auto count = at.integer_of(words[2], "how many elements there are");
      if (!count) return tl::unexpected(count.error());
      if (*count < 0) return at.wrong_line("there are less than no elements");
      header.elements.push_back({std::string(words[1]), static_cast<std::size_t>(*count), {}});
    } else if (words[0] == "property" && !header.elements.empty() &&
               header.elements.back().properties.size() < kMostProperties) {
      auto property = property_of(words, at);
      if (!property) return tl::unexpected(property.error());
      header.elements.back().properties.push_back(*std::move(property));
    } else {
      return at.wrong_line(fmt::format("{} is no line of a header here", quoted(words[0])));
    }
  }
  if (!has_format) return at.wrong_line("the header has no 'format'");
  return header;
}

class PlyBody {
 public:
  PlyBody(MeshCursor at, PlyHeader header) : at_(at), header_(std::move(header)) {}

  Expected<TriangleMesh> read() {
    for (const Element& element : header_.elements) {
      // Nothing of it is in the file, however many there are.
      if (element.properties.empty()) continue;
      const bool faces = element.name == "face";
      if (element.name == "vertex" && !find_axes(element)) return at_.wrong_file("its vertices have no x, y and z");
      if (faces && !find_corners(element)) return at_.wrong_file("its faces have no list 'vertex_indices'");
      if (faces && element.count > kMostTriangles) {
        return at_.wrong_file(fmt::format("says {} faces: {}", element.count, too_many_triangles()));
      }
      for (std::size_t i = 0; i < element.count; ++i) {
        if (auto read = read_element(element); !read) return tl::unexpected(read.error());
        if (element.name == "vertex") {
          if (mesh_.vertices.size() >= 3 * kMostTriangles) return at_.wrong_file(too_many_triangles());
          mesh_.vertices.push_back(vertex_);
        }
        if (!faces) continue;
        switch (add_polygon(corners_, vertex_count(), mesh_)) {
          case AddedPolygon::kAdded:
            break;
          case AddedPolygon::kNoVertex:
            return wrong(fmt::format("face {} has a vertex that is not there: there are {}", i, vertex_count()));
          case AddedPolygon::kTooMany:
            return at_.wrong_file(too_many_triangles());
        }
      }
    }
    if (mesh_.vertices.size() != vertex_count()) return at_.wrong_file("its vertices are said twice");
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> wrong(const std::string& what) const {
    return header_.format == PlyFormat::kText ? at_.wrong_line(what) : at_.wrong_byte(what);
  }

  // Faces may come before vertices.
  [[nodiscard]] std::size_t vertex_count() const {
    for (const Element& element : header_.elements) {
      if (element.name == "vertex" && !element.properties.empty()) return element.count;
    }
    return 0;
  }

  bool find_axes(const Element& element) {
    axes_ = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto found = std::find_if(element.properties.begin(), element.properties.end(), [&](const Property& p) {
        return !p.length && p.name == std::string_view("xyz").substr(axis, 1);
      });
      if (found == element.properties.end()) return false;
      axes_[axis] = static_cast<std::size_t>(found - element.properties.begin());
    }
    return true;
  }

  bool find_corners(const Element& element) {
    const auto found = std::find_if(element.properties.begin(), element.properties.end(), [](const Property& p) {
      return p.length && (p.name == "vertex_indices" || p.name == "vertex_index");
    });
    corners_at_ = static_cast<std::size_t>(found - element.properties.begin());
    return found != element.properties.end();
  }

  Expected<void> read_element(const Element& element) {
    corners_.clear();
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      if (!property.length) {
        const auto value = number(property.type);
        if (!value) return tl::unexpected(value.error());
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (axes_[axis] == p) vertex_[static_cast<Eigen::Index>(axis)] = *value;
        }
        continue;
      }
      const auto length = number(*property.length);
      if (!length) return tl::unexpected(length.error());
      if (*length < 0.0 || *length > static_cast<double>(at_.left())) return wrong("a list is longer than the file");
      for (std::size_t k = 0; k < static_cast<std::size_t>(*length); ++k) {
        const auto value = number(property.type);
        if (!value) return tl::unexpected(value.error());
        // What is no whole number within a double's is no index either.
        const bool index = *value >= 0.0 && *value < 4e9;
        if (element.name == "face" && p == corners_at_)
          corners_.push_back(index ? static_cast<std::int64_t>(*value) : -1);
      }
    }
    return {};
  }

  Expected<double> number(PlyType type) {
    if (header_.format == PlyFormat::kText) return at_.real("a property's value");
    const bool big = header_.format == PlyFormat::kBigEndian;
    std::optional<double> value;
    const auto take = [&](auto raw) {
      if (raw) value = static_cast<double>(*raw);
    };
    switch (type) {
      case PlyType::kInt8:
        take(at_.raw<std::int8_t>(big));
        break;
      case PlyType::kUint8:
        take(at_.raw<std::uint8_t>(big));
        break;
      case PlyType::kInt16:
        take(at_.raw<std::int16_t>(big));
        break;
      case PlyType::kUint16:
        take(at_.raw<std::uint16_t>(big));
        break;
      case PlyType::kInt32:
        take(at_.raw<std::int32_t>(big));
        break;
      case PlyType::kUint32:
        take(at_.raw<std::uint32_t>(big));
        break;
      case PlyType::kFloat:
        take(at_.raw<float>(big));
        break;
      case PlyType::kDouble:
        take(at_.raw<double>(big));
        break;
    }
    if (!value) return at_.wrong_byte("ends before its last element does");
    return *value;
  }

  MeshCursor at_;
  PlyHeader header_;
  TriangleMesh mesh_;
  std::array<std::size_t, 3> axes_{};  // properties of a vertex
  std::size_t corners_at_ = 0;         // property of a face
  Vector3d vertex_ = Vector3d::Zero();
  std::vector<std::int64_t> corners_;
};

}  // namespace

Expected<TriangleMesh> parse_ply(MeshCursor at) {
  auto header = header_of(at);
  if (!header) return tl::unexpected(header.error());
  return PlyBody(at, *std::move(header)).read();
}

}  // namespace perimap

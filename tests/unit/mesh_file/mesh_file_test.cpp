// Surfaces as files: each format gives the same mesh, and what is garbled is refused where it is.
#include "drivers/mesh_file/mesh_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <string>
#include <vector>

namespace perimap {
namespace {

using testing::HasSubstr;

// A tetrahedron, by each writer.
const std::vector<Vector3d> kPlaces = {{0, 0, 0}, {10, 0, 0}, {0, 20, 0}, {0, 0, 30.5}};
const std::vector<TriangleMesh::Triangle> kFaces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

template <class T>
std::string raw(T value, bool big_endian) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

std::string coordinates(const Vector3d& p, bool big_endian) {
  std::string bytes;
  for (const double x : p) bytes += raw(static_cast<float>(x), big_endian);
  return bytes;
}

std::string number(double x) {
  std::string text = std::to_string(x);
  return text;
}

std::string binary_stl(std::uint32_t claimed = 4) {
  std::string bytes = "solid, and yet binary";
  bytes.resize(80, ' ');
  bytes += raw(claimed, false);
  for (const auto& face : kFaces) {
    bytes += coordinates(Vector3d::Zero(), false);
    for (const std::uint32_t v : face) bytes += coordinates(kPlaces[v], false);
    bytes += raw(std::uint16_t{0}, false);
  }
  return bytes;
}

std::string text_stl() {
  std::string text = "solid a name of words\n";
  for (const auto& face : kFaces) {
    text += " facet normal 0 0 1\n  outer loop\n";
    for (const std::uint32_t v : face) {
      text +=
          "   vertex " + number(kPlaces[v].x()) + " " + number(kPlaces[v].y()) + " " + number(kPlaces[v].z()) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid a name of words\n";
}

std::string ply_head(const std::string& format, std::size_t vertices = 4, std::size_t faces = 4) {
  return "ply\r\nformat " + format + " 1.0\r\ncomment of a scan\r\nelement vertex " + std::to_string(vertices) +
         "\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\nproperty uchar red\r\nelement face " +
         std::to_string(faces) + "\r\nproperty list uchar int vertex_index\r\nend_header\n";
}

std::string ply(bool big_endian) {
  std::string bytes = ply_head(big_endian ? "binary_big_endian" : "binary_little_endian");
  for (const Vector3d& p : kPlaces) bytes += coordinates(p, big_endian) + "\x7f";
  for (const auto& face : kFaces) {
    bytes += "\x03";
    for (const std::uint32_t v : face) bytes += raw(static_cast<std::int32_t>(v), big_endian);
  }
  return bytes;
}

std::string obj() {
  std::string text = "# of a scan\nmtllib none.mtl\n";
  for (const Vector3d& p : kPlaces) text += "v " + number(p.x()) + " " + number(p.y()) + " " + number(p.z()) + "\n";
  text += "vn 0 0 1\nf 1//1 3//1 2//1\nf 1/1 2/1 4/1\nf -3 -2 -1\nf 1/1/1 4/1/1 3/1/1\n";
  return text;
}

std::string vtk(bool binary, bool offsets) {
  std::string text = std::string("# vtk DataFile Version ") + (offsets ? "5.1" : "3.0") + "\nof a scan\n" +
                     (binary ? "BINARY" : "ASCII") + "\nDATASET POLYDATA\nPOINTS 4 float\n";
  for (const Vector3d& p : kPlaces) {
    text += binary ? coordinates(p, true) : number(p.x()) + " " + number(p.y()) + " " + number(p.z()) + "\n";
  }
  text += "\n";
  const auto index = [&](std::int64_t i, bool wide) {
    if (!binary) return std::to_string(i) + " ";
    return wide ? raw(i, true) : raw(static_cast<std::int32_t>(i), true);
  };
  if (offsets) {
    text += "POLYGONS 5 12\nOFFSETS vtktypeint64\n";
    for (const std::int64_t i : {0, 3, 6, 9, 12}) text += index(i, true);
    text += "\nCONNECTIVITY vtktypeint64\n";
  } else {
    text += "POLYGONS 4 16\n";
  }
  for (const auto& face : kFaces) {
    if (!offsets) text += index(3, false);
    for (const std::uint32_t v : face) text += index(v, offsets);
  }
  return text + "\nPOINT_DATA 4\nSCALARS of 4 not read\n";
}

// Corners of the triangles, whatever vertices stand for them.
std::vector<Vector3d> corners_of(const TriangleMesh& mesh) {
  std::vector<Vector3d> corners;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) corners.push_back(mesh.vertices.at(v));
  }
  return corners;
}

TEST(MeshFile, EveryFormatGivesTheSameSurface) {
  const auto expected = corners_of({kPlaces, kFaces});
  for (const auto& [name, bytes] :
       std::vector<std::pair<std::string, std::string>>{{"binary.stl", binary_stl()},
                                                        {"text.STL", text_stl()},
                                                        {"little.ply", ply(false)},
                                                        {"big.ply", ply(true)},
                                                        {"written.ply", ply_text({kPlaces, kFaces})},
                                                        {"model.obj", obj()},
                                                        {"text.vtk", vtk(false, false)},
                                                        {"binary.vtk", vtk(true, false)},
                                                        {"text5.vtk", vtk(false, true)},
                                                        {"binary5.vtk", vtk(true, true)}}) {
    const auto mesh = parse_mesh(bytes, name, 1.0);
    ASSERT_TRUE(mesh) << name << ": " << mesh.error().message;
    EXPECT_EQ(corners_of(*mesh), expected) << name;
  }
}

TEST(MeshFile, LengthsAreInTheUnitThatIsSaid) {
  const auto mesh = parse_mesh(obj(), "model.obj", 1000.0);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->vertices[3], Vector3d(0, 0, 30500));
}

TEST(MeshFile, APolygonBecomesAFanOfTriangles) {
  const auto mesh = parse_mesh("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", "model.obj", 1.0);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->triangles, (std::vector<TriangleMesh::Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

struct Garbled {
  std::string name, bytes, message;
};

TEST(MeshFile, WhatIsGarbledIsRefusedWhereItIs) {
  const auto without_end = [](const std::string& bytes, std::size_t count) {
    return bytes.substr(0, bytes.size() - count);
  };
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string ascii =
      ply_head("ascii") + "0 0 0 1\n10 0 0 1\n0 20 0 1\n0 0 30 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  const std::string huge = std::string(80, ' ') + raw(std::uint32_t{5'000'000}, false);
  for (const Garbled& garbled : std::vector<Garbled>{
           {"e.stl", "", "e.stl: is empty"},
           {"e.txt", "some words", "e.txt: expected a surface as STL, PLY, OBJ (named .obj) or legacy VTK"},
           {"cut.stl", without_end(binary_stl(), 7).replace(0, 5, "SOLID"), "cut.stl: is neither STL as text"},
           {"five.stl", huge + std::string(std::size_t{50} * 5'000'000, '\0'),
            "five.stl: says 5000000: has more than 2000000 triangles: reduce it"},
           {"nan.stl",
            replaced(binary_stl(), coordinates(kPlaces[3], false), coordinates(Vector3d(0, 0, std::nan("")), false)),
            "a corner of triangle 1 is no number"},
           {"cut.stl", without_end(text_stl(), 40), "cut.stl:28: expected 'endloop', got: 'end'"},
           {"word.stl", replaced(text_stl(), "30.5", "3O.5"),
            "word.stl:13: expected a coordinate, a number, got: '3O.5"},
           {"two.stl", replaced(text_stl(), "outer", "inner"), "two.stl:3: expected 'outer loop', got: 'inner'"},
           {"a.ply", replaced(ascii, "3 1 2 3", "3 1 2 4"),
            "a.ply:18: face 2 has a vertex that is not there: there are 4"},
           {"a.ply", replaced(ascii, "3 1 2 3", "3 1 -7 3"), "a.ply:18: face 2 has a vertex that is not there"},
           {"a.ply", replaced(ascii, "0 20 0", "0 nan 0"), "a.ply:14: expected a property's value, a number, got: 'nan'"},
           {"a.ply", without_end(ascii, 10), "expected a property's value, a number, got: the file's end"},
           {"a.ply", replaced(ascii, "property float y", "property float w"), "a.ply: its vertices have no x, y and z"},
           {"a.ply", replaced(ascii, "vertex_index", "corner"), "a.ply: its faces have no list 'vertex_indices'"},
           {"a.ply", replaced(ascii, "ascii", "octal"), "a.ply:2: the format 'octal' is none that PLY has"},
           {"a.ply", replaced(ascii, "float z", "complex z"),
            "a.ply:7: the property has a type that PLY does not know"},
           {"a.ply", replaced(ascii, "list uchar", "list float"), "a.ply:10: a list's length is a whole number"},
           {"a.ply", replaced(ascii, "face 4", "face 5000000"), "a.ply: says 5000000 faces: has more than 2000000"},
           {"a.ply", replaced(ascii, "vertex 4", "vertex -4"), "a.ply:4: there are less than no elements"},
           {"a.ply", ascii.substr(0, 60), "ends within its header"},
           {"b.ply", without_end(ply(false), 1), "b.ply: byte 314: ends before its last element does"},
           {"b.ply", replaced(ply(true), std::string("\x03", 1), "\xff"), "a list is longer than the file"},
           {"i.ply", replaced(ply(false), raw(std::int32_t{2}, false), raw(std::int32_t{-2}, false)),
            "face 0 has a vertex that is not there"},
           {"o.obj", "v 0 0\n", "o.obj:1: expected a coordinate, a number, got: the file's end"},
           {"o.obj", "v 0 0 0\nf 1 2\n", "o.obj:2: a face has 2 corners, expected three and more"},
           {"o.obj", obj() + "f 1 2 9\n", "o.obj:12: a face has a vertex that is not there: 4 were before it"},
           {"o.obj", obj() + "f 1 2 0\n", "o.obj:12: a face has a vertex that is not there"},
           {"o.obj", obj() + "f 1 2 x\n", "o.obj:12: expected a vertex of a face, a whole number, got: 'x'"},
           {"v.vtk", "# vtk DataFile Version 3.0\nx\nHEX\n", "v.vtk:3: expected ASCII or BINARY, got: 'HEX'"},
           {"v.vtk", replaced(vtk(false, false), "POLYDATA", "STRUCTURED_POINTS"),
            "v.vtk:4: expected 'DATASET POLYDATA'"},
           {"v.vtk", replaced(vtk(false, false), "POINTS 4", "POINTS 4000000000"),
            "v.vtk:5: the number of points is 4000000000, more than the file holds"},
           {"v.vtk", replaced(vtk(false, false), "3 0 2 1", "9 0 2 1"),
            "v.vtk: polygon 3 has more corners than its section has numbers"},
           {"v.vtk", replaced(vtk(false, false), "3 0 2 1", "3 0 2 7"),
            "v.vtk: polygon 0 has a vertex that is not there"},
           {"v.vtk", replaced(vtk(false, true), "0 3 6", "0 3 1"), "v.vtk: the offsets of polygon 1 are none"},
           {"v.vtk", replaced(vtk(false, false), "POLYGONS", "TRIANGLE_STRIPS"), "triangle strips are not read"},
           {"v.vtk", replaced(vtk(true, false), "POINT_DATA", "WHATEVER"), "expected a section of POLYDATA"},
           {"v.vtk", vtk(true, false).substr(0, 90), "ends within its points"}}) {
    const auto mesh = parse_mesh(garbled.bytes, garbled.name, 1.0);
    ASSERT_FALSE(mesh) << garbled.name << ", expected: " << garbled.message;
    EXPECT_THAT(mesh.error().message, HasSubstr(garbled.message));
    EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos);
  }
}

TEST(MeshFile, EveryCutOfAFileIsRefusedOrSmaller) {
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{{"b.stl", binary_stl()},
                                                                                    {"t.stl", text_stl()},
                                                                                    {"l.ply", ply(false)},
                                                                                    {"o.obj", obj()},
                                                                                    {"b.vtk", vtk(true, true)}}) {
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const auto mesh = parse_mesh(std::string_view(bytes).substr(0, length), name, 1.0);
      if (!mesh) continue;
      for (const auto& triangle : mesh->triangles) {
        for (const std::uint32_t v : triangle) EXPECT_LT(v, mesh->vertices.size());
      }
      EXPECT_LE(mesh->triangles.size(), kFaces.size());
    }
  }
}

TEST(MeshFile, AFileThatIsNotThereIsSaid) {
  const auto mesh = read_mesh("/nowhere/heart.stl", 1.0);
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error().message, HasSubstr("/nowhere/heart.stl: expected a readable surface"));
}

}  // namespace
}  // namespace perimap

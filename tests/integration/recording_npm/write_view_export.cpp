// write_view_export OUT.mcap EXPECTED.json: exports a made recording for viewers, and tells what this project's own
// reader decodes of it.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "daemon/bridge/export/view_export.hpp"
#include "daemon/bridge/messages/view_topics.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "made_recording.hpp"

namespace perimap {
namespace {

using Json = nlohmann::json;

template <class Sequence, class Make>
Json list_of(const Sequence& sequence, Make make) {
  Json list = Json::array();
  for (const auto& element : std::span(sequence._buffer, sequence._length)) list.push_back(make(element));
  return list;
}

Json json_of(const foxglove_Point3& p) { return {p.x, p.y, p.z}; }
Json json_of(const foxglove_Vector3& p) { return {p.x, p.y, p.z}; }
Json json_of(const foxglove_Point2& p) { return {p.x, p.y}; }
Json json_of(const foxglove_Color& c) { return {c.r, c.g, c.b, c.a}; }

Json json_of(const foxglove_SceneEntity& entity) {
  return {{"id", entity.id},
          {"frame", entity.frame_id},
          {"lifetime", {entity.lifetime.sec, entity.lifetime.nsec}},
          {"locked", entity.frame_locked},
          {"triangles", list_of(entity.triangles,
                                [](const auto& t) {
                                  return Json{{"points", list_of(t.points, [](const auto& p) { return json_of(p); })},
                                              {"colors", list_of(t.colors, [](const auto& c) { return json_of(c); })},
                                              {"indices", list_of(t.indices, [](auto i) { return Json(i); })}};
                                })},
          {"spheres", list_of(entity.spheres,
                              [](const auto& s) {
                                return Json{{"position", json_of(s.pose.position)},
                                            {"size", json_of(s.size)},
                                            {"color", json_of(s.color)}};
                              })},
          {"lines", list_of(entity.lines, [](const auto& l) {
             return Json{{"type", l.type},
                         {"thickness", l.thickness},
                         {"points", list_of(l.points, [](const auto& p) { return json_of(p); })}};
           })}};
}

Json json_of(const foxglove_SceneUpdate& scene) {
  return {{"deletions", list_of(scene.deletions,
                                [](const auto& d) {
                                  return Json{{"type", d.type}, {"id", d.id}};
                                })},
          {"entities", list_of(scene.entities, [](const auto& e) { return json_of(e); })}};
}

Json json_of(const foxglove_ImageAnnotations& over) {
  return {{"circles", list_of(over.circles,
                              [](const auto& c) {
                                return Json{{"position", json_of(c.position)},
                                            {"diameter", c.diameter},
                                            {"color", json_of(c.outline_color)}};
                              })},
          {"points", list_of(over.points,
                             [](const auto& p) {
                               return Json{{"type", p.type},
                                           {"points", list_of(p.points, [](const auto& q) { return json_of(q); })},
                                           {"thickness", p.thickness}};
                             })},
          {"texts", list_of(over.texts, [](const auto& t) {
             return Json{{"text", t.text}};
           })}};
}

Json json_of(const foxglove_CameraCalibration& c) {
  return {{"frame", c.frame_id},
          {"size", {c.width, c.height}},
          {"model", c.distortion_model},
          {"D", list_of(c.D, [](double d) { return Json(d); })},
          {"K", c.K},
          {"R", c.R},
          {"P", c.P}};
}

Json json_of(const foxglove_FrameTransform& t) {
  return {{"parent", t.parent_frame_id},
          {"child", t.child_frame_id},
          {"translation", json_of(t.translation)},
          {"rotation", {t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w}}};
}

Json json_of(const perimap_view_EcgValue& v) { return {{"mV", v.mV}}; }
Json json_of(const perimap_view_SurfaceWorth& w) {
  return {{"state", w.state},
          {"reason", w.reason},
          {"features", w.features},
          {"converged", w.converged},
          {"phase_rad", w.phase_rad}};
}
Json json_of(const foxglove_RawImage& image) {
  return {{"frame", image.frame_id},
          {"size", {image.width, image.height}},
          {"encoding", image.encoding},
          {"data", list_of(image.data, [](auto byte) { return Json(byte); })}};
}

template <class... T>
Json decoded(const RecordingReader& reader, const RecordedMessage& message) {
  Json value;
  const auto take = [&]<class One>(One*) {
    if (message.type != topic_type<One>().schema_name()) return;
    if (const auto sample = reader.decode<One>(message)) value = json_of(**sample);
  };
  (take(static_cast<T*>(nullptr)), ...);
  return value;
}

int write(const std::string& file, const std::string& expected) {
  const ViewExportFiles files{file + ".made", "", file, file + ".layout.json"};
  test::MadeRecording().write(files.recording);
  if (const auto exported = export_view(files, "test"); !exported) {
    std::fprintf(stderr, "write_view_export: %s\n", exported.error().message.c_str());
    return 1;
  }
  auto reader = RecordingReader::open(files.output);
  Json messages = Json::array();
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    messages.push_back(
        {{"topic", (*message)->channel},
         {"time", std::to_string(to_ns((*message)->arrival))},
         {"value",
          decoded<foxglove_SceneUpdate, foxglove_ImageAnnotations, foxglove_CameraCalibration, foxglove_FrameTransform,
                  perimap_view_EcgValue, perimap_view_SurfaceWorth, foxglove_RawImage>(*reader, **message)}});
  }
  std::ofstream(expected) << messages.dump();
  return 0;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "write_view_export OUT.mcap EXPECTED.json\n");
    return 2;
  }
  return perimap::write(argv[1], argv[2]);
}

#include "daemon/bridge/igtl/igtl_messages.hpp"

#include <fmt/format.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTimeStamp.h>
#include <igtlTransformMessage.h>

#include <cstring>
#include <limits>
#include <string_view>
#include <vector>

#include "daemon/publishing/advice.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/subscribing/any_time.hpp"

namespace perimap {
namespace {

using Subject = IgtlOutgoing::Subject;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

// No stamp where UTC is not told: zero, as the protocol has it.
void stamp(igtl::MessageBase& message, Instant instant, const ShownSurface& surface) {
  auto time = igtl::TimeStamp::New();
  time->SetTime(0U, 0U);
  const std::int64_t utc_ns = wrapped_sum(to_ns(instant), surface.utc_minus_monotonic.count());
  if (surface.utc_minus_monotonic.count() != 0 && utc_ns > 0) {
    time->SetTime(static_cast<igtlUint32>(utc_ns / kSecond_ns), static_cast<igtlUint32>(utc_ns % kSecond_ns));
  }
  message.SetTimeStamp(time);
}

IgtlOutgoing packed(Subject subject, igtl::MessageBase& message) {
  message.Pack();
  const auto* bytes = static_cast<const char*>(message.GetPackPointer());
  return {subject, std::make_shared<const std::string>(bytes, static_cast<std::size_t>(message.GetPackSize()))};
}

void add_points(const std::vector<std::array<double, 3>>& positions, igtl::PolyDataPointArray& points) {
  points.SetNumberOfPoints(static_cast<int>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    points.SetPoint(static_cast<unsigned>(i), static_cast<float>(positions[i][0]), static_cast<float>(positions[i][1]),
                    static_cast<float>(positions[i][2]));
  }
}

void add_scalars(const char* name, std::vector<float> values, igtl::PolyDataMessage& message) {
  auto scalars = igtl::PolyDataAttribute::New();
  scalars->SetType(igtl::PolyDataAttribute::POINT_SCALAR, 1);
  scalars->SetName(name);
  scalars->SetSize(static_cast<igtlUint32>(values.size()));
  scalars->SetData(values.data());
  message.AddAttribute(scalars);
}

void add_mesh(const ShownMesh& mesh, igtl::PolyDataMessage& message) {
  add_points(mesh.positions_W_mm, *message.GetPoints());
  for (std::array<std::uint32_t, 3> triangle : mesh.triangles) message.GetPolygons()->AddCell(3, triangle.data());
  add_scalars("deviation_mm", {mesh.deviations_mm.begin(), mesh.deviations_mm.end()}, message);
}

void add_features(const std::vector<ShownFeature>& features, igtl::PolyDataMessage& message) {
  std::vector<std::array<double, 3>> positions;
  std::vector<float> deviations;
  for (const ShownFeature& feature : features) {
    if (feature.state != perimap_FEATURE_CONVERGED) continue;
    auto vertex = static_cast<igtlUint32>(positions.size());
    message.GetVertices()->AddCell(1, &vertex);
    positions.push_back(feature.position_W_mm);
    deviations.push_back(static_cast<float>(feature.deviation_mm));
  }
  if (positions.empty()) return;
  add_points(positions, *message.GetPoints());
  add_scalars("deviation_mm", std::move(deviations), message);
}

// libopenigtlink 1.11 leaves the body of a message without points as it was allocated, whatever was there before. What
// it ought to write are counts and sizes, all of them zero.
class SurfaceMessage : public igtl::PolyDataMessage {
 public:
  using Self = SurfaceMessage;
  using Superclass = igtl::PolyDataMessage;
  using Pointer = igtl::SmartPointer<Self>;
  igtlTypeMacro(SurfaceMessage, igtl::PolyDataMessage);
  igtlNewMacro(SurfaceMessage);

 protected:
  int PackBody() override {
    if (GetPoints()->GetNumberOfPoints() > 0) return igtl::PolyDataMessage::PackBody();
    AllocatePack();
    std::memset(GetPackBodyPointer(), 0, static_cast<std::size_t>(GetPackBodySize()));
    return 1;
  }
};

// All of its arrays are there, be they empty: clients of the library ask for each.
SurfaceMessage::Pointer empty_surface(const char* device) {
  auto message = SurfaceMessage::New();
  message->SetDeviceName(device);
  message->SetPoints(igtl::PolyDataPointArray::New());
  message->SetVertices(igtl::PolyDataCellArray::New());
  message->SetLines(igtl::PolyDataCellArray::New());
  message->SetPolygons(igtl::PolyDataCellArray::New());
  message->SetTriangleStrips(igtl::PolyDataCellArray::New());
  return message;
}

}  // namespace

IgtlState surface_state_of(const ShownSurface& surface) {
  IgtlState state{IgtlState::Code::kDisabled, surface.reason, std::string(name_of(surface.state)),
                  std::string(permission_of(surface.state))};
  if (surface.state == perimap_SURFACE_GOOD) state.code = IgtlState::Code::kOk;
  if (surface.state == perimap_SURFACE_DEGRADED) state.code = IgtlState::Code::kNotReady;
  for (const std::string_view more : {std::string_view(surface.why), std::string_view(surface.remedy)}) {
    if (!more.empty()) state.words += fmt::format("; {}", more);
  }
  if (surface.usable() && !surface.why_no_mesh.empty()) {
    state.words += fmt::format("; converged features alone: {}", surface.why_no_mesh);
  }
  state.words += fmt::format("; source {}, frame {}", surface.source, surface.frame_id);
  return state;
}

IgtlState camera_state_of(const ShownSurface& surface) {
  if (surface.X_WC) return {IgtlState::Code::kOk, 0, "known", "where the camera was at capture"};
  return {IgtlState::Code::kNotFound, surface.reason, "unknown",
          surface.usable() ? "the pose of the camera is not known" : "nothing is told of an invalid surface"};
}

IgtlOutgoing pack_surface(const ShownSurface& surface) {
  const auto message = empty_surface(igtl_names::kSurface);
  stamp(*message, surface.valid, surface);
  if (!surface.mesh.triangles.empty()) {
    add_mesh(surface.mesh, *message);
  } else if (!surface.features.empty()) {
    add_features(surface.features, *message);
  }
  return packed(Subject::kSurface, *message);
}

IgtlOutgoing pack_no_surface() {
  const auto message = empty_surface(igtl_names::kSurface);
  stamp(*message, Instant(), {});
  return packed(Subject::kSurface, *message);
}

IgtlOutgoing pack_camera(const ShownSurface& surface) {
  const auto message = igtl::TransformMessage::New();
  message->SetDeviceName(igtl_names::kCamera);
  stamp(*message, surface.capture, surface);
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix[row][column] = static_cast<float>(surface.X_WC->R(row, column));
    matrix[row][3] = static_cast<float>(surface.X_WC->t(row));
  }
  message->SetMatrix(matrix);
  return packed(Subject::kCamera, *message);
}

IgtlOutgoing pack_tools(const ShownSurface& surface) {
  const auto message = empty_surface(igtl_names::kTools);
  stamp(*message, surface.valid, surface);
  std::vector<std::array<double, 3>> tips;
  std::vector<float> lines, distances, deviations, touches;
  for (std::size_t line = 0; line < surface.tools.size(); ++line) {
    const client::ToolAtInstant& at = surface.tools[line].at;
    if (!at.tip_known) continue;
    auto vertex = static_cast<igtlUint32>(tips.size());
    message->GetVertices()->AddCell(1, &vertex);
    tips.push_back(at.tip_W_mm);
    lines.push_back(static_cast<float>(line));
    distances.push_back(static_cast<float>(at.distance_mm));
    deviations.push_back(static_cast<float>(at.deviation_mm));
    const bool told = at.refusal == client::ToolRefusal::kNone;
    touches.push_back(!told ? std::numeric_limits<float>::quiet_NaN() : at.touches ? 1.0F : 0.0F);
  }
  if (!tips.empty()) {
    add_points(tips, *message->GetPoints());
    add_scalars("line", std::move(lines), *message);
    add_scalars("distance_mm", std::move(distances), *message);
    add_scalars("deviation_mm", std::move(deviations), *message);
    add_scalars("touches", std::move(touches), *message);
  }
  return packed(Subject::kTools, *message);
}

IgtlOutgoing pack_tool_words(const ShownSurface& surface) {
  const auto message = igtl::StringMessage::New();
  message->SetDeviceName(igtl_names::kTools);
  stamp(*message, surface.valid, surface);
  std::string words;
  for (const ShownTool& tool : surface.tools) {
    if (!words.empty()) words += '\n';
    words += tool_words(tool.name, tool.at);
  }
  message->SetString(words);
  return packed(Subject::kToolWords, *message);
}

IgtlOutgoing pack_state(IgtlOutgoing::Subject subject, const IgtlState& state) {
  const auto message = igtl::StatusMessage::New();
  message->SetDeviceName(subject == Subject::kCameraStatus ? igtl_names::kCamera : igtl_names::kSurface);
  message->SetCode(static_cast<int>(state.code));
  message->SetSubCode(state.reason);
  message->SetErrorName(state.name.c_str());
  message->SetStatusString(state.words.c_str());
  return packed(subject, *message);
}

}  // namespace perimap

// What ties a C++ type of `idl` to the schema of a channel.
#pragma once

#include <foxglove.h>
#include <perimap.h>
#include <perimap_mesh.h>
#include <perimap_procedure.h>
#include <perimap_tool.h>
#include <perimap_trace.h>

#include <string_view>

namespace perimap {

struct TopicType {
  const dds_topic_descriptor_t* descriptor;
  std::string_view schema_text;  // the whole IDL file that defines the type

  // The scoped IDL name, as "perimap::Surface".
  [[nodiscard]] std::string_view schema_name() const noexcept { return descriptor->m_typename; }
};

// MCAP's registered names (https://mcap.dev/spec/registry).
inline constexpr std::string_view kSchemaEncoding = "omgidl";
inline constexpr std::string_view kMessageEncoding = "cdr";

// Defined for every type that a channel can carry, and for no other.
template <class T>
[[nodiscard]] TopicType topic_type() noexcept = delete;

template <>
[[nodiscard]] TopicType topic_type<perimap_Surface>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_SurfaceModel>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_SurfaceMesh>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_ToolDistance>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_Phase>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_Status>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TrackerPose>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_EcgSamples>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_RTriggerPulse>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_RespirationSamples>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_RecordingInfo>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthMesh>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthMotion>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthCamera>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthEvent>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthProcedure>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthTool>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_TruthTrace>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<foxglove_RawImage>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<foxglove_CompressedImage>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<foxglove_PoseInFrame>() noexcept;

}  // namespace perimap

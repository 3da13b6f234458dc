#include "drivers/recording/topic.hpp"

#include "drivers/recording/schema_text.hpp"

namespace perimap {

template <>
TopicType topic_type<perimap_Surface>() noexcept {
  return {&perimap_Surface_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_SurfaceModel>() noexcept {
  return {&perimap_SurfaceModel_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_SurfaceMesh>() noexcept {
  return {&perimap_SurfaceMesh_desc, kPerimapMeshSchemaText};
}
template <>
TopicType topic_type<perimap_ToolDistance>() noexcept {
  return {&perimap_ToolDistance_desc, kPerimapToolSchemaText};
}
template <>
TopicType topic_type<perimap_Phase>() noexcept {
  return {&perimap_Phase_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_Status>() noexcept {
  return {&perimap_Status_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_TrackerPose>() noexcept {
  return {&perimap_TrackerPose_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_EcgSamples>() noexcept {
  return {&perimap_EcgSamples_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_RTriggerPulse>() noexcept {
  return {&perimap_RTriggerPulse_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_RespirationSamples>() noexcept {
  return {&perimap_RespirationSamples_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_RecordingInfo>() noexcept {
  return {&perimap_RecordingInfo_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_TruthMesh>() noexcept {
  return {&perimap_TruthMesh_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_TruthMotion>() noexcept {
  return {&perimap_TruthMotion_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_TruthCamera>() noexcept {
  return {&perimap_TruthCamera_desc, kPerimapSchemaText};
}
template <>
TopicType topic_type<perimap_TruthEvent>() noexcept {
  return {&perimap_TruthEvent_desc, kPerimapProcedureSchemaText};
}
template <>
TopicType topic_type<perimap_TruthProcedure>() noexcept {
  return {&perimap_TruthProcedure_desc, kPerimapProcedureSchemaText};
}
template <>
TopicType topic_type<perimap_TruthTool>() noexcept {
  return {&perimap_TruthTool_desc, kPerimapToolSchemaText};
}
template <>
TopicType topic_type<perimap_TruthTrace>() noexcept {
  return {&perimap_TruthTrace_desc, kPerimapTraceSchemaText};
}
template <>
TopicType topic_type<foxglove_RawImage>() noexcept {
  return {&foxglove_RawImage_desc, kFoxgloveSchemaText};
}
template <>
TopicType topic_type<foxglove_CompressedImage>() noexcept {
  return {&foxglove_CompressedImage_desc, kFoxgloveSchemaText};
}
template <>
TopicType topic_type<foxglove_PoseInFrame>() noexcept {
  return {&foxglove_PoseInFrame_desc, kFoxgloveSchemaText};
}

}  // namespace perimap

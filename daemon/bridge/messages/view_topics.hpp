// The types of idl/foxglove/foxglove_view.idl as what channels can carry.
#pragma once

#include <foxglove_view.h>

#include "drivers/recording/topic.hpp"

namespace perimap {

template <>
[[nodiscard]] TopicType topic_type<foxglove_CameraCalibration>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<foxglove_FrameTransform>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<foxglove_SceneUpdate>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<foxglove_ImageAnnotations>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_view_EcgValue>() noexcept;
template <>
[[nodiscard]] TopicType topic_type<perimap_view_SurfaceWorth>() noexcept;

}  // namespace perimap

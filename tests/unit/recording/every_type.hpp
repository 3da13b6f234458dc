// The types that recordings carry, for tests that go through all of them.
#pragma once

#include <tuple>

#include "drivers/recording/topic.hpp"

namespace perimap::test {

using EveryType = std::tuple<perimap_Surface, perimap_SurfaceModel, perimap_SurfaceMesh, perimap_ToolDistance,
                             perimap_Phase, perimap_Status, perimap_TrackerPose, perimap_EcgSamples,
                             perimap_RTriggerPulse, perimap_RespirationSamples, perimap_RecordingInfo,
                             perimap_TruthMesh, perimap_TruthMotion, perimap_TruthCamera, perimap_TruthTool,
                             foxglove_RawImage, foxglove_CompressedImage, foxglove_PoseInFrame>;

// Calls visit.operator()<T>() for every one.
template <class Visit>
void for_every_type(Visit visit) {
  [&]<class... T>(std::tuple<T...>*) { (visit.template operator()<T>(), ...); }(static_cast<EveryType*>(nullptr));
}

}  // namespace perimap::test

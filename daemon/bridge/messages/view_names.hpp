// Topics and frames of what viewers get; the layout names them too.
#pragma once

namespace perimap::view_names {

inline constexpr const char* kImage = "/camera/image";              // foxglove::RawImage or CompressedImage
inline constexpr const char* kCalibration = "/camera/calibration";  // foxglove::CameraCalibration
inline constexpr const char* kAnnotations = "/camera/annotations";  // foxglove::ImageAnnotations
inline constexpr const char* kTransforms = "/transforms";           // foxglove::FrameTransform
inline constexpr const char* kScene = "/surface/scene";             // foxglove::SceneUpdate
inline constexpr const char* kWorth = "/surface/worth";             // perimap_view::SurfaceWorth
inline constexpr const char* kEcg = "/ecg/value";                   // perimap_view::EcgValue

inline constexpr const char* kCameraFrame = "camera";
inline constexpr const char* kSensorFrame = "scope_sensor";  // the tracked sensor on the scope

}  // namespace perimap::view_names

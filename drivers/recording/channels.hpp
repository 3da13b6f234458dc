// The names that recordings of this project use: channels with the type of their messages, and attachments.
#pragma once

#include <string_view>

namespace perimap::channels {

// What the devices gave. Log time is the arrival, publish time the source's own stamp.
inline constexpr std::string_view kCameraImage = "camera/image";  // foxglove::RawImage or CompressedImage
inline constexpr std::string_view kTrackerPose = "tracker/pose";  // perimap::TrackerPose
// Of other tracked tools each a channel of its own below this: perimap::TrackerPose, likewise in the frame W, but of
// the reference in the tracker's own. "tracker/reference", "tracker/pointer", "tracker/second_sensor",
// "tracker/patient_tool", "tracker/instrument/NAME".
inline constexpr std::string_view kTrackedTools = "tracker/";
inline constexpr std::string_view kSecondSensor = "tracker/second_sensor";  // that tells how the scope is turned
// Those of which a distance from the surface is told.
inline constexpr std::string_view kPointer = "tracker/pointer";
inline constexpr std::string_view kInstruments = "tracker/instrument/";
inline constexpr std::string_view kPatientTool = "tracker/patient_tool";  // that is moved as the organ is moved
inline constexpr std::string_view kTrackerViewer = "tracker/viewer";  // foxglove::PoseInFrame, metres, valid poses only
inline constexpr std::string_view kEcgSamples = "ecg/samples";        // perimap::EcgSamples
// Of the same device, measured together with those and with their count and stamps: each message stands right before
// that of the first lead.
inline constexpr std::string_view kEcgSecondLead = "ecg/second_lead";  // perimap::EcgSamples; optional
inline constexpr std::string_view kRTrigger = "ecg/r_trigger";  // perimap::RTriggerPulse, where there is a trigger
inline constexpr std::string_view kRespirationSamples = "respiration/samples";  // perimap::RespirationSamples; optional

// Facts of the whole recording.
inline constexpr std::string_view kRecordingInfo = "recording/info";  // perimap::RecordingInfo

// Ground truth of a simulated heart.
inline constexpr std::string_view kTruthMesh = "truth/mesh";            // perimap::TruthMesh
inline constexpr std::string_view kTruthMotion = "truth/motion";        // perimap::TruthMotion
inline constexpr std::string_view kTruthCamera = "truth/camera";        // perimap::TruthCamera
inline constexpr std::string_view kTruthProcedure = "truth/procedure";  // perimap::TruthProcedure, with a procedure
inline constexpr std::string_view kTruthTrace = "truth/trace";          // perimap::TruthTrace, with a motion trace
// Of the tip of a tool, by its name of those below kTrackedTools: "truth/tool/instrument/NAME", perimap::TruthTool.
inline constexpr std::string_view kTruthTool = "truth/tool/";
inline constexpr std::string_view kTruthEvent = "truth/event";  // perimap::TruthEvent, likewise

// What was published.
inline constexpr std::string_view kSurface = "surface";             // perimap::Surface
inline constexpr std::string_view kSurfaceModel = "surface_model";  // perimap::SurfaceModel
inline constexpr std::string_view kSurfaceMesh = "surface_mesh";    // perimap::SurfaceMesh
inline constexpr std::string_view kTool = "tool";                   // perimap::ToolDistance
inline constexpr std::string_view kPhase = "phase";                 // perimap::Phase
inline constexpr std::string_view kStatus = "status";               // perimap::Status

}  // namespace perimap::channels

namespace perimap::attachments {

inline constexpr std::string_view kCalibration = "calibration.yaml";
inline constexpr std::string_view kConfiguration = "configuration.toml";
inline constexpr std::string_view kProcedure = "procedure.toml";  // of a simulation
inline constexpr std::string_view kTurnedScope = "turned_scope.json";
// The tip of a tool, "tip/NAME.json" by its name of those below channels::kTrackedTools.
inline constexpr std::string_view kTips = "tip/";
inline constexpr std::string_view kVerification = "verification.json";  // what perimap verify said last before it

}  // namespace perimap::attachments

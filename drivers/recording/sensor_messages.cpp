#include "drivers/recording/sensor_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace perimap {
namespace {

constexpr std::array<std::pair<ToolState, perimap_ToolState>, 4> kStates{
    {{ToolState::kOk, perimap_TOOL_OK},
     {ToolState::kMissing, perimap_TOOL_MISSING},
     {ToolState::kOutOfVolume, perimap_TOOL_OUT_OF_VOLUME},
     {ToolState::kDisabled, perimap_TOOL_DISABLED}}};

// What blocks of evenly spaced samples have in common.
template <class Block, class Message, class Sequence>
void lend_samples(const Block& block, Message& message, Sequence& samples) noexcept {
  message.first_sample_time_ns = to_ns(block.first_sample_time);
  message.sample_period_ns = block.sample_period.count();
  message.device_sequence = block.device_sequence;
  // The C type has no const; the serialiser does not write.
  samples._buffer = const_cast<float*>(block.samples().data());
  samples._length = block.count;
  samples._maximum = block.count;
}

template <class Message, class Sequence, class Block>
Expected<void> take_samples(const Message& message, const Sequence& samples, Block& block,
                            std::array<float, Block::kCapacity>& values) {
  if (samples._length > Block::kCapacity) {
    return fail(fmt::format("{} samples in a block, at most {} can be taken", samples._length, Block::kCapacity));
  }
  block.first_sample_time = from_ns(message.first_sample_time_ns);
  block.sample_period = Duration(message.sample_period_ns);
  block.device_sequence = message.device_sequence;
  block.count = samples._length;
  std::copy_n(samples._buffer, samples._length, values.begin());
  return {};
}

}  // namespace

perimap_TrackerPose to_tracker_pose(const TrackerSample& sample) noexcept {
  perimap_TrackerPose message{};
  message.source_time_ns = to_ns(sample.source_time);
  message.device_frame = sample.device_frame;
  for (const auto& [state, wire] : kStates) {
    if (state == sample.state) message.state = wire;
  }
  for (int axis = 0; axis < 3; ++axis) message.translation_WS_mm[axis] = sample.X_WS.t[axis];
  if (sample.state == ToolState::kOk) {
    rotation_to_wxyz(sample.X_WS.R, message.rotation_WS_wxyz);
  } else {
    for (double& component : message.rotation_WS_wxyz) component = std::numeric_limits<double>::quiet_NaN();
  }
  message.error_mm = sample.error_mm;
  return message;
}

perimap_EcgSamples borrow_ecg_samples(const EcgBlock& block) noexcept {
  perimap_EcgSamples message{};
  lend_samples(block, message, message.ecg_mV);
  message.lead_off = block.lead_off;
  return message;
}

perimap_EcgSamples borrow_second_lead(const EcgBlock& block) noexcept {
  perimap_EcgSamples message{};
  lend_samples(block, message, message.ecg_mV);
  message.ecg_mV._buffer = const_cast<float*>(block.second_samples().data());
  message.lead_off = block.second_off;
  return message;
}

perimap_RTriggerPulse to_r_trigger_message(const RTriggerPulse& pulse) noexcept {
  return {to_ns(pulse.time), pulse.device_count};
}

perimap_RespirationSamples borrow_respiration_samples(const RespirationBlock& block) noexcept {
  perimap_RespirationSamples message{};
  lend_samples(block, message, message.values);
  message.sensor_off = block.sensor_off;
  return message;
}

Expected<TrackerSample> to_tracker_sample(const perimap_TrackerPose& message) {
  TrackerSample sample;
  sample.source_time = from_ns(message.source_time_ns);
  sample.device_frame = message.device_frame;
  for (const auto& [state, wire] : kStates) {
    if (wire == message.state) sample.state = state;
  }
  if (sample.state != ToolState::kOk) return sample;
  const double(&t)[3] = message.translation_WS_mm;
  const double(&q)[4] = message.rotation_WS_wxyz;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(norm - 1.0) < 1e-3)) return fail("rotation is not a unit quaternion");
  sample.X_WS = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), q);
  // Of others' recordings it may be anything: what is no figure is none.
  constexpr double kLargestError_mm = 1000.0;
  if (message.error_mm > 0.0 && message.error_mm <= kLargestError_mm) sample.error_mm = message.error_mm;
  return sample;
}

Expected<EcgBlock> to_ecg_block(const perimap_EcgSamples& message) {
  EcgBlock block;
  if (auto taken = take_samples(message, message.ecg_mV, block, block.mV); !taken) return tl::unexpected(taken.error());
  block.lead_off = message.lead_off;
  return block;
}

void join_second_lead(const EcgBlock& second, EcgBlock& first) noexcept {
  if (second.first_sample_time != first.first_sample_time || second.device_sequence != first.device_sequence ||
      second.count != first.count) {
    return;
  }
  first.has_second = true;
  first.second_off = second.lead_off;
  first.second_mV = second.mV;
}

RTriggerPulse to_r_trigger_pulse(const perimap_RTriggerPulse& message) noexcept {
  RTriggerPulse pulse;
  pulse.time = from_ns(message.edge_time_ns);
  pulse.device_count = message.device_count;
  return pulse;
}

Expected<RespirationBlock> to_respiration_block(const perimap_RespirationSamples& message) {
  RespirationBlock block;
  if (auto taken = take_samples(message, message.values, block, block.values); !taken)
    return tl::unexpected(taken.error());
  block.sensor_off = message.sensor_off;
  return block;
}

}  // namespace perimap

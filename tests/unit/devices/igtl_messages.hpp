// What tests of OpenIGTLink have in common.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <igtlPositionMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "drivers/standins/emulator/igtl_emulator.hpp"
#include "drivers/tracker/igtl_message.hpp"
#include "drivers/tracker/igtl_session.hpp"
#include "scripted_link.hpp"

namespace perimap {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

const Pose kPose{so3_exp(Vector3d(0.3, -0.4, 0.5)), Vector3d(10, -20, 30)};

inline void expect_pose(const Expected<Pose>& pose) {
  ASSERT_TRUE(pose) << pose.error().message;
  EXPECT_LT((pose->R - kPose.R).norm(), 1e-6);
  EXPECT_LT((pose->t - kPose.t).norm(), 1e-5);
}

inline IgtlMessage transform(unsigned version = 1) {
  return {version, "TRANSFORM", "Scope", 5ULL << 32U, encode_igtl_transform(kPose), {}};
}

inline std::string kind_of(IgtlFramer& framer) {
  const auto next = framer.next();
  if (!next) return "more";
  if (const auto* message = std::get_if<IgtlMessage>(&*next)) return message->type;
  return std::get<IgtlDamaged>(*next).lost_track ? "lost" : "damaged";
}

}  // namespace perimap

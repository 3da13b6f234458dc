#include "daemon/setup/device_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perimap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> values(const std::vector<DeviceChoice>& choices) {
  std::vector<std::string> all;
  for (const DeviceChoice& choice : choices) all.push_back(choice.value);
  return all;
}

const std::vector<AttachedPort> kPorts{{"/dev/a", "", ""}, {"/dev/b", "ndi", ""}, {"/dev/c", "", "cyton"}};

TEST(DeviceChoice, OffersWhatANameSuggestsFirstAndAllElseAsEachProtocol) {
  EXPECT_THAT(values(port_choices(kPorts, &AttachedPort::tracker, {"ndi", "igtl"})),
              ElementsAre("ndi=/dev/b", "ndi=/dev/a", "igtl=/dev/a", "ndi=/dev/c", "igtl=/dev/c"));
  EXPECT_EQ(port_choices(kPorts, &AttachedPort::tracker, {}).front().what, "ndi at /dev/b");
}

TEST(DeviceChoice, WithoutProtocolsOnlyWhatANameSuggestsIsOffered) {
  EXPECT_THAT(values(port_choices(kPorts, &AttachedPort::ecg, {})), ElementsAre("cyton=/dev/c"));
  EXPECT_THAT(values(camera_choices({"/dev/video0"})), ElementsAre("v4l2:/dev/video0"));
}

TEST(DeviceChoice, APortIsNamedWithItsProtocol) {
  const auto port = parse_named_port("--tracker", "ndi=tcp:10.0.0.2:8765", kTrackerProtocols);
  ASSERT_TRUE(port);
  EXPECT_EQ(port->protocol, "ndi");
  EXPECT_EQ(port->port, "tcp:10.0.0.2:8765");
  for (const char* none : {"", "none"}) EXPECT_EQ(parse_named_port("--ecg", none, kEcgProtocols)->protocol, "");
  for (const char* wrong : {"ndi", "ndi=", "=x", "cyton=/dev/a", "NDI=/dev/a"}) {
    EXPECT_THAT(parse_named_port("--tracker", wrong, kTrackerProtocols).error().message,
                HasSubstr("--tracker: expected PROTOCOL=PORT with a protocol of ndi, igtl"))
        << wrong;
  }
}

}  // namespace
}  // namespace perimap

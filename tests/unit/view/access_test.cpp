#include "daemon/web/access.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "daemon/web/request_target.hpp"

namespace perimap {
namespace {

using namespace std::string_literals;

bool printable(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

struct Garbled {
  const char* name;
  std::string text;
};

class GarbledTarget : public testing::TestWithParam<Garbled> {};
TEST_P(GarbledTarget, IsRefusedInOnePrintableLine) {
  const auto target = parse_request_target(GetParam().text);
  ASSERT_FALSE(target);
  EXPECT_TRUE(printable(target.error().message)) << target.error().message;
}
INSTANTIATE_TEST_SUITE_P(View, GarbledTarget,
                         testing::Values(Garbled{"Nothing", ""}, Garbled{"NoSlash", "view.css"},
                                         Garbled{"AbsoluteForm", "http://elsewhere/"}, Garbled{"Escape", "/%2e%2e/x"},
                                         Garbled{"Nul", "/a\0b"s}, Garbled{"Bytes", "/\xFF\xFE"},
                                         Garbled{"Backslash", "/..\\x"}, Garbled{"Space", "/a b"},
                                         Garbled{"Token", "/?token=a%20b"},
                                         Garbled{"TooLong", "/" + std::string(kLongestTarget, 'a')}),
                         [](const auto& param) { return param.param.name; });

TEST(RequestTarget, IsItsPathAndTheTokenOfItsQuery) {
  const auto plain = parse_request_target("/view.css");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->path, "/view.css");
  EXPECT_EQ(plain->token, "");
  const auto asked = parse_request_target("/?from=mail&token=0123abcd&x");
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->path, "/");
  EXPECT_EQ(asked->token, "0123abcd");
}

class GarbledHost : public testing::TestWithParam<Garbled> {};
TEST_P(GarbledHost, IsRefusedInOnePrintableLine) {
  const auto host = parse_host(GetParam().text);
  ASSERT_FALSE(host);
  EXPECT_TRUE(printable(host.error().message)) << host.error().message;
}
INSTANTIATE_TEST_SUITE_P(View, GarbledHost,
                         testing::Values(Garbled{"Nothing", ""}, Garbled{"PortAlone", ":80"},
                                         Garbled{"NoPort", "localhost:"}, Garbled{"Letters", "localhost:http"},
                                         Garbled{"PortTooLarge", "localhost:65536"}, Garbled{"Sign", "localhost:+80"},
                                         Garbled{"More", "localhost:80:80"}, Garbled{"OpenBracket", "[::1"},
                                         Garbled{"NameInBrackets", "[localhost]:80"}, Garbled{"Empty", "[]:80"},
                                         Garbled{"AfterBracket", "[::1]x:80"}, Garbled{"Nul", "127.0.0.1\0:80"s},
                                         Garbled{"TooLong", std::string(300, 'a')}),
                         [](const auto& param) { return param.param.name; });

TEST(Host, IsLoopbackAnotherAddressOrAName) {
  using Kind = HostName::Kind;
  const auto kind = [](std::string_view host) { return parse_host(host)->kind; };
  EXPECT_EQ(kind("127.0.0.1:7374"), Kind::kLoopback);
  EXPECT_EQ(kind("127.8.9.1"), Kind::kLoopback);
  EXPECT_EQ(kind("[::1]:7374"), Kind::kLoopback);
  EXPECT_EQ(kind("LocalHost:7374"), Kind::kLoopback);
  EXPECT_EQ(kind("192.168.1.20:7374"), Kind::kAddress);
  EXPECT_EQ(kind("[fe80::1]:7374"), Kind::kAddress);
  EXPECT_EQ(kind("localhost.elsewhere.example:7374"), Kind::kName);
  EXPECT_EQ(kind("127.0.0.1.elsewhere.example"), Kind::kName);
  EXPECT_EQ(parse_host("localhost:7374")->port, 7374);
  EXPECT_EQ(parse_host("localhost")->port, 80);
}

const Access kAtHome{true, 7374, "", {}};
const Access kAbroad{false, 7374, "00112233445566778899aabbccddeeff", {}};

TEST(Access, OnLoopbackAsksForNoTokenButForTheRightHost) {
  EXPECT_TRUE(admit(kAtHome, {"/", "127.0.0.1:7374", "", ""}));
  EXPECT_TRUE(admit(kAtHome, {"/", "localhost:7374", "", ""}));
  for (const char* host : {"127.0.0.1", "127.0.0.1:7375", "192.168.1.20:7374", "rebound.example:7374"}) {
    const auto denied = admit(kAtHome, {"/", host, "", ""});
    ASSERT_FALSE(denied) << host;
    EXPECT_EQ(denied.error().status, 403U) << host;
  }
  EXPECT_EQ(admit(kAtHome, {"/", "", "", ""}).error().status, 400U);
}

TEST(Access, APageOfElsewhereIsRefusedWhateverItAsks) {
  EXPECT_TRUE(admit(kAtHome, {"/live", "127.0.0.1:7374", "http://127.0.0.1:7374", ""}));
  for (const char* origin : {"http://elsewhere.example", "https://127.0.0.1:7374", "null", "http://127.0.0.1:7375",
                             "http://localhost:7374", "http://127.0.0.1:7374.elsewhere.example", "http://"}) {
    const auto denied = admit(kAtHome, {"/live", "127.0.0.1:7374", origin, ""});
    ASSERT_FALSE(denied) << origin;
    EXPECT_EQ(denied.error().status, 403U) << origin;
  }
}

TEST(Access, APageOfElsewhereMayAskWhenItsOriginIsAllowed) {
  const Access allowed{true, 7374, "", {"https://app.example"}};
  EXPECT_TRUE(admit(allowed, {"/", "localhost:7374", "https://app.example", ""}));
  EXPECT_FALSE(admit(allowed, {"/", "localhost:7374", "http://app.example", ""}));
  EXPECT_FALSE(admit(allowed, {"/", "localhost:7374", "https://app.example.elsewhere", ""}));
  EXPECT_FALSE(admit(allowed, {"/", "rebound.example:7374", "https://app.example", ""}));
  EXPECT_TRUE(admit(allowed, {"/", "localhost:7374", "http://localhost:7374", ""}));
}

TEST(Access, ElsewhereTheTokenIsAskedForInTheAddressOrTheCookie) {
  EXPECT_FALSE(admit(kAbroad, {"/", "192.168.1.20:7374", "", ""}));
  EXPECT_TRUE(admit(kAbroad, {"/?token=" + kAbroad.token, "192.168.1.20:7374", "", ""}));
  EXPECT_TRUE(admit(kAbroad, {"/view.css", "192.168.1.20:7374", "", "a=b; " + token_cookie(kAbroad)}));
  EXPECT_FALSE(admit(kAbroad, {"/?token=" + kAbroad.token.substr(1), "192.168.1.20:7374", "", ""}));
  EXPECT_FALSE(admit(kAbroad, {"/?token=", "192.168.1.20:7374", "", "perimap_7374="}));
  EXPECT_FALSE(admit(kAbroad, {"/", "192.168.1.20:7374", "", "perimap_7375=" + kAbroad.token}));
  EXPECT_FALSE(admit(kAbroad, {"/?token=" + kAbroad.token, "name.example:7374", "", ""}));
}

TEST(Access, TokensAreLongAndNeverTheSame) {
  const auto first = make_token();
  const auto second = make_token();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->size(), 32U);
  EXPECT_NE(*first, *second);
  EXPECT_TRUE(parse_request_target("/?token=" + *first));
}

TEST(Access, AnAddressIsInNumbers) {
  EXPECT_TRUE(*is_loopback("127.0.0.1"));
  EXPECT_TRUE(*is_loopback("::1"));
  EXPECT_FALSE(*is_loopback("0.0.0.0"));
  EXPECT_FALSE(*is_loopback("::"));
  for (const std::string& address : {"localhost"s, ""s, "127.0.0"s, "[::1]"s, "127.0.0.1\0"s}) {
    EXPECT_FALSE(is_loopback(address)) << address;
  }
}

}  // namespace
}  // namespace perimap

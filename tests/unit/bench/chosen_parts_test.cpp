#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/evaluation/bench/bench.hpp"

namespace perimap::bench {
namespace {

using ::testing::UnorderedElementsAre;
using ::testing::UnorderedElementsAreArray;

TEST(ChosenParts, AreAllWhereNoneIsNamed) { EXPECT_THAT(chosen_parts({}, false), UnorderedElementsAreArray(kParts)); }

TEST(ChosenParts, AreThoseThatAreNamedWithWhatTheyAreHeldBeside) {
  EXPECT_THAT(chosen_parts({"clock", "memory"}, false), UnorderedElementsAre("clock", "memory"));
  EXPECT_THAT(chosen_parts({"ddsperf"}, false), UnorderedElementsAre("ddsperf", "live"));
}

TEST(ChosenParts, OfSecurityAreThatAloneAndWhatIsNamedBeside) {
  EXPECT_THAT(chosen_parts({}, true), UnorderedElementsAre(kSecurityPart));
  EXPECT_THAT(chosen_parts({"rate"}, true), UnorderedElementsAre(kSecurityPart, "rate"));
}

}  // namespace
}  // namespace perimap::bench

#include "core/error/nearest_name.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

const std::vector<std::string> kNames{"replay", "report", "record", "watch", "ctl"};

TEST(LettersApart, CountsWhatMustBeDone) {
  EXPECT_EQ(letters_apart("", ""), 0U);
  EXPECT_EQ(letters_apart("", "abc"), 3U);
  EXPECT_EQ(letters_apart("replay", "replay"), 0U);
  EXPECT_EQ(letters_apart("replay", "relay"), 1U);   // left out
  EXPECT_EQ(letters_apart("relay", "replay"), 1U);   // put in
  EXPECT_EQ(letters_apart("rebuy", "replay"), 3U);   // exchanged and put in
  EXPECT_EQ(letters_apart("repaly", "replay"), 1U);  // swapped
  EXPECT_EQ(letters_apart("REPLAY", "replay"), 0U);  // case
  EXPECT_EQ(letters_apart("kitten", "sitting"), 3U);
}

TEST(LettersApart, IsADistance) {
  for (const std::string& a : kNames) {
    for (const std::string& b : kNames) {
      EXPECT_EQ(letters_apart(a, b), letters_apart(b, a));
      for (const std::string& c : kNames) {
        EXPECT_LE(letters_apart(a, c), letters_apart(a, b) + letters_apart(b, c)) << a << b << c;
      }
    }
  }
}

TEST(NearestName, IsWhatWasMeant) {
  EXPECT_EQ(nearest_name("repaly", kNames), "replay");
  EXPECT_EQ(nearest_name("recrod", kNames), "record");
  EXPECT_EQ(nearest_name("wathc", kNames), "watch");
  EXPECT_EQ(nearest_name("ctrl", kNames), "ctl");
  EXPECT_EQ(did_you_mean("ctrl", kNames), "; did you mean 'ctl'?");
}

TEST(NearestName, IsTheOnlyOneOfWhichTheBeginningIsGiven) {
  EXPECT_EQ(nearest_name("rec", kNames), "record");
  EXPECT_EQ(nearest_name("WAT", kNames), "watch");
  EXPECT_EQ(nearest_name("rep", kNames), "") << "replay or report";
  EXPECT_EQ(nearest_name("wa", kNames), "") << "as good as nothing";
}

TEST(NearestName, IsNoneWhereNothingIsNear) {
  EXPECT_EQ(nearest_name("simulate", kNames), "");
  EXPECT_EQ(nearest_name("", kNames), "");
  EXPECT_EQ(nearest_name("x", kNames), "");
  EXPECT_EQ(nearest_name(std::string(1000, 'r'), kNames), "");
  EXPECT_EQ(did_you_mean("simulate", kNames), "");
}

}  // namespace
}  // namespace perimap

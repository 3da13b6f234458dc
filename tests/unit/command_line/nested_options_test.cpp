// Options that are the value of an option: the text taken apart, and what is wrong in it.
#include "daemon/command_line/nested_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/shell_words.hpp"

namespace perimap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> words_of(const std::string& text) {
  const auto words = split_as_a_shell(text);
  EXPECT_TRUE(words) << words.error().message;
  return words.value_or(std::vector<std::string>{"refused"});
}

TEST(SplitAsAShell, SpacesEndWordsButForThoseInQuotes) {
  EXPECT_THAT(words_of(""), IsEmpty());
  EXPECT_THAT(words_of("  --seed 7\t--ecg=119 "), ElementsAre("--seed", "7", "--ecg=119"));
  EXPECT_THAT(words_of("--procedure 'my script.toml'"), ElementsAre("--procedure", "my script.toml"));
  EXPECT_THAT(words_of(R"(--procedure="my script.toml" a\ b '')"),
              ElementsAre("--procedure=my script.toml", "a b", ""));
}

TEST(SplitAsAShell, AVariableIsReplacedButNotInSingleQuotes) {
  ASSERT_EQ(::setenv("PERIMAP_TEST_WORD", "one", 1), 0);
  EXPECT_THAT(words_of("$PERIMAP_TEST_WORD '$PERIMAP_TEST_WORD'"), ElementsAre("one", "$PERIMAP_TEST_WORD"));
  ASSERT_EQ(::unsetenv("PERIMAP_TEST_WORD"), 0);
  const auto unset = split_as_a_shell("$PERIMAP_TEST_WORD");
  ASSERT_FALSE(unset);
  EXPECT_THAT(unset.error().message, HasSubstr("variable that is set"));
}

TEST(SplitAsAShell, WhatEndsNoWordIsRefused) {
  for (const auto& [text, reason] : {std::pair("--procedure 'script.toml", "quote"), std::pair("--seed \"7", "quote"),
                                     std::pair("--seed $(id)", "no command"), std::pair("--seed `id`", "no command"),
                                     std::pair("--seed 7; id", "with quotes"), std::pair("--seed 7 > x", "with quotes"),
                                     std::pair("--seed 7\n--fps 5", "with quotes")}) {
    const auto words = split_as_a_shell(text);
    ASSERT_FALSE(words) << text;
    EXPECT_THAT(words.error().message, HasSubstr(reason)) << text;
  }
}

TEST(NestedOptions, AreParsedAsThoseOfACommand) {
  int seed = 0;
  bool loudly = false;
  const auto add = [&](Command& command) {
    command.add_option("--seed", seed)->check(Range(1, 9));
    command.add_flag("--loudly", loudly);
  };
  const auto parsed = parse_nested_options({"--seed", "7", "--loudly"}, add);
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(seed, 7);
  EXPECT_TRUE(loudly);
}

TEST(NestedOptions, EachThatIsWrongIsToldOnALine) {
  int seed = 0;
  const auto error_of = [&](const std::vector<std::string>& words) {
    const auto parsed =
        parse_nested_options(words, [&](Command& command) { command.add_option("--seed", seed)->check(Range(1, 9)); });
    return parsed ? "" : told_of_option("--simulated", parsed.error()).message;
  };
  EXPECT_EQ(error_of({"--sead=1", "x.mcap", "--loud"}),
            "--simulated: --sead=1: is no option; did you mean '--seed'?\n"
            "--simulated: 'x.mcap': is one argument too many\n"
            "--simulated: --loud: is no option");
  EXPECT_THAT(error_of({"--seed", "10"}), HasSubstr("--simulated: --seed:"));
  EXPECT_THAT(error_of({"--seed"}), HasSubstr("--simulated: --seed"));
  EXPECT_THAT(error_of({"--help"}), HasSubstr("--help: is no option"));
}

}  // namespace
}  // namespace perimap

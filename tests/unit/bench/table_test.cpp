#include "daemon/evaluation/bench/table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perimap::bench {
namespace {

using testing::HasSubstr;

const Table kTable{"Releases & more", "A note.", {"run", "us"}, {{"live", "0.8"}, {"recording < all", "1234.5"}}};

TEST(Table, ColumnsStandBelowEachOtherTheFirstToTheLeft) {
  EXPECT_EQ(text_of(kTable),
            "Releases & more\n"
            "run                  us\n"
            "live                0.8\n"
            "recording < all  1234.5\n"
            "A note.\n\n");
}

TEST(Table, OnAPageNothingIsTakenForMarkup) {
  const std::string page = html_of(kTable);
  EXPECT_THAT(page, HasSubstr("<h2>Releases &amp; more</h2>"));
  EXPECT_THAT(page, HasSubstr("<tr><td>recording &lt; all</td><td>1234.5</td></tr>"));
}

TEST(Table, WithoutRowsThereIsNone) {
  const Table empty{"Releases", "A note.", {"run"}, {}};
  EXPECT_EQ(text_of(empty), "");
  EXPECT_EQ(html_of(empty), "");
}

}  // namespace
}  // namespace perimap::bench

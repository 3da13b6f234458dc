#include "daemon/evaluation/bench/open_pages.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace perimap::bench {
namespace {

TEST(OpenPages, CountsTheConnectionsThatAreEstablishedAtTheirPort) {
  std::string file = (std::filesystem::temp_directory_path() / "perimap-tcp-XXXXXX").string();
  const int descriptor = mkstemp(file.data());
  ASSERT_GE(descriptor, 0);
  close(descriptor);
  // As Linux tells it: the listening socket, two connections with both of their ends, one that is being closed.
  std::ofstream(file) << "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid\n"
                         "   0: 0100007F:1CCE 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0\n"
                         "   1: 0100007F:1CCE 0100007F:9C40 01 00000000:00000000 00:00000000 00000000     0\n"
                         "   2: 0100007F:9C40 0100007F:1CCE 01 00000000:00000000 00:00000000 00000000     0\n"
                         "   3: 0100007F:1CCE 0100007F:9C42 01 00000000:00000000 00:00000000 00000000     0\n"
                         "   4: 0100007F:1CCE 0100007F:9C44 06 00000000:00000000 00:00000000 00000000     0\n"
                         "   5: garbled\n";
  EXPECT_EQ(established_at(0x1CCE, file), 2);
  EXPECT_EQ(established_at(0x1CCF, file), 0);
  EXPECT_EQ(established_at(0x1CCE, file + ".none"), 0);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace perimap::bench

#include "core/realtime/triple_buffer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

namespace perimap {
namespace {

TEST(TripleBuffer, ReaderSeesTheInitialValueUntilTheFirstWrite) {
  TripleBuffer<int> cell(7);
  EXPECT_FALSE(cell.update());
  EXPECT_EQ(cell.front(), 7);
}

TEST(TripleBuffer, ReaderSeesTheNewestAndOnlyOnceAsNew) {
  TripleBuffer<int> cell(0);
  cell.write(1);
  cell.write(2);
  EXPECT_TRUE(cell.update());
  EXPECT_EQ(cell.front(), 2);
  EXPECT_FALSE(cell.update());
  EXPECT_EQ(cell.front(), 2);
}

TEST(TripleBuffer, WriterNeverTouchesWhatTheReaderHolds) {
  TripleBuffer<int> cell(0);
  cell.write(1);
  ASSERT_TRUE(cell.update());
  const int* held = &cell.front();
  for (int i = 2; i < 10; ++i) cell.write(i);
  EXPECT_EQ(*held, 1);
}

// Each value is 64 copies of one number: a torn read would mix two.
TEST(TripleBuffer, NeverTearsAndNeverGoesBackUnderLoad) {
  using Value = std::array<std::uint64_t, 64>;
  constexpr std::uint64_t kWrites = 100'000;
  TripleBuffer<Value> cell(Value{});
  std::thread writer([&cell] {
    for (std::uint64_t i = 1; i <= kWrites; ++i) {
      cell.back().fill(i);
      cell.publish();
    }
  });
  std::uint64_t last = 0;
  while (last < kWrites) {
    if (!cell.update()) {
      std::this_thread::yield();
      continue;
    }
    const Value& value = cell.front();
    ASSERT_GT(value.front(), last);
    for (const std::uint64_t v : value) ASSERT_EQ(v, value.front());
    last = value.front();
  }
  writer.join();
}

}  // namespace
}  // namespace perimap

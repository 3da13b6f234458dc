// What becomes of a file on a bad disk or a full one: copies with a bit flipped, or with their end cut off.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <random>
#include <string>

namespace perimap::test {

// By a seed that is drawn anew in each run; a test that fails while it lives tells it.
class Damage {
 public:
  static constexpr int kCopies = 500;  // of each kind of file

  Damage() : seed_(std::random_device()()), random_(seed_), told_(__FILE__, __LINE__, std::to_string(seed_)) {}

  // `whole` (bytes of any kind, at least one) with one bit flipped, or shorter.
  template <class Bytes>
  [[nodiscard]] Bytes copy_of(const Bytes& whole) {
    Bytes damaged = whole;
    const std::size_t at = random_() % whole.size();
    if (random_() % 2 == 0) {
      using Byte = typename Bytes::value_type;
      damaged[at] = static_cast<Byte>(static_cast<unsigned char>(whole[at]) ^ (1U << (random_() % 8)));
    } else {
      damaged.resize(at);
    }
    return damaged;
  }
  // One of `count`.
  [[nodiscard]] std::size_t one_of(std::size_t count) { return random_() % count; }

 private:
  unsigned seed_;
  std::mt19937 random_;
  testing::ScopedTrace told_;
};

}  // namespace perimap::test

// Where the parts of one group of a bank lie; shared by the bank and its kernels. Every element is an array of eight
// lanes.
//
// P is symmetric: its diagonal is an array of its own, always up to date, and the strictly lower triangle lies in tiles
// of up to four rows of one axis, in the order in which a sweep reads them: first the columns left of the tile's first
// row, `rows` elements each, then the triangle within the tile, row by row. Four rows share each load of what belongs
// to the column.
#pragma once

#include <cstddef>

namespace perimap {

struct CovarianceTile {
  int first_row = 0;
  int rows = 0;  // 1, 3 or 4
  int axis = 0;
  std::size_t offset = 0;  // elements before it
};

inline constexpr int kMaxPendingUpdates = 4;

template <class Real>
struct GroupView {
  int n = 0;  // basis
  int d = 0;  // state, 3 n
  const CovarianceTile* tiles = nullptr;
  int tile_count = 0;
  Real* x = nullptr;         // [d]
  Real* diagonal = nullptr;  // [d] of P
  Real* lower = nullptr;     // [d (d - 1) / 2]
  Real* pending = nullptr;   // [kMaxPendingUpdates][d][2]: U; off the diagonal P is what is stored - sum U U^T
  Real* gains = nullptr;     // [kMaxLearntPhases][3][d]: M = P B^T by columns
  Real* S = nullptr;         // [kMaxSweepPhases][6]: B P B^T, lower triangle by rows
};

}  // namespace perimap

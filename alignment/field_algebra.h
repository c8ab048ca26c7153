// Sums and products over fields, in blocks of fixed size, so that results do not depend on the thread count.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "alignment/sliced_mesh.h"

namespace weft {

inline constexpr int kSlicesPerBlock = 256;

// Calls body(block, SliceRange) for every block, in parallel.
template <typename Body>
void ForEachBlock(int slices, const Body& body) {
  const int blocks = (slices + kSlicesPerBlock - 1) / kSlicesPerBlock;
  tbb::parallel_for(0, blocks, [&](int block) {
    const int first = block * kSlicesPerBlock;
    body(block, SliceRange{first, std::min(first + kSlicesPerBlock, slices)});
  });
}

// Sum of body(SliceRange) over all blocks, added in their order.
template <typename Body>
double SumOverBlocks(int slices, const Body& body) {
  std::vector<double> partial((slices + kSlicesPerBlock - 1) / kSlicesPerBlock);
  ForEachBlock(slices, [&](int block, SliceRange range) { partial[block] = body(range); });
  double sum = 0;
  for (const double p : partial) sum += p;
  return sum;
}

double Dot(const Field3& a, const Field3& b);
void AddScaled(float scale, const Field3& x, Field3* y);                   // y += scale x
void Combine(const Field3& x, float scale, const Field3& y, Field3* out);  // out = x + scale y
// Into records x y z 0, which are as many.
void PackRecords(const Field3& in, Records* out);

}  // namespace weft

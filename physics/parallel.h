// Loops over vertices in the caller's arena, with sums that do not depend on the number of threads.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace weft {

template <typename Body>
void ForEachIndex(size_t count, const Body& body) {
  constexpr size_t kGrain = 2048;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kGrain),
                    [&](const tbb::blocked_range<size_t>& range) {
                      for (size_t i = range.begin(); i < range.end(); ++i) body(i);
                    });
}

// Sum of value(i): blocks of fixed size, added in order.
template <typename Value>
double SumOf(size_t count, const Value& value) {
  constexpr size_t kBlock = 4096;
  const size_t blocks = (count + kBlock - 1) / kBlock;
  std::vector<double> part(blocks, 0);
  tbb::parallel_for(size_t{0}, blocks, [&](size_t k) {
    double sum = 0;
    for (size_t i = k * kBlock; i < std::min(count, (k + 1) * kBlock); ++i) sum += value(i);
    part[k] = sum;
  });
  double sum = 0;
  for (const double p : part) sum += p;
  return sum;
}

}  // namespace weft

// Pages of lists.
#pragma once

#include <cstddef>

namespace weft {

// Messages of lists are at most about this large: gRPC's clients take 4 MiB where nobody says otherwise.
inline constexpr size_t kLargestPage_bytes = 3 << 20;

// Counts what goes to a page of a list. Thread safety: none.
class Page {
 public:
  // `most`: entries; 0: as many as fit.
  explicit Page(size_t most) : most_(most) {}

  // False: the page is full, and this entry belongs to the next one. One alone always fits.
  bool Add(size_t entry_bytes) {
    constexpr size_t kFrame_bytes = 8;  // tag and length of an entry
    if (entries_ > 0 && (entries_ == most_ || bytes_ + entry_bytes + kFrame_bytes > kLargestPage_bytes))
      return false;
    ++entries_;
    bytes_ += entry_bytes + kFrame_bytes;
    return true;
  }

 private:
  const size_t most_;
  size_t entries_ = 0, bytes_ = 0;
};

}  // namespace weft

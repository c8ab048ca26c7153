// Pages of lists.
#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/strings/str_format.h"

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

// The place of an entry in a list by age, which grows with its time. Ids may be keys of clients, and tell no
// time.
inline std::string PlaceByAge(int64_t unix_ns, const std::string& id) {
  return absl::StrFormat("%020d-%s", unix_ns, id);
}

// Adds the page behind the place `token`, or the first one, to a list. `by_place`: a std::map of all entries.
// Returns the token of the next page; empty: there is none.
template <typename ByPlace, typename Message>
std::string AddPage(
    const ByPlace& by_place, size_t most, const std::string& token,
    const std::type_identity_t<std::function<Message(const typename ByPlace::mapped_type&)>>& show,
    google::protobuf::RepeatedPtrField<Message>* list) {
  Page page(most);
  std::string last;
  for (auto at = token.empty() ? by_place.begin() : by_place.upper_bound(token); at != by_place.end(); ++at) {
    Message shown = show(at->second);
    if (!page.Add(shown.ByteSizeLong())) return last;
    last = at->first;
    *list->Add() = std::move(shown);
  }
  return "";
}

}  // namespace weft

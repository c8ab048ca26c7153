#include "capture/take/frame_range.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace weft {
namespace {

std::optional<uint64_t> NumberIn(const std::string& text) {
  uint64_t number = 0;
  const bool digits =
      !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  return digits && absl::SimpleAtoi(text, &number) ? std::optional(number) : std::nullopt;
}

class Finder {
 public:
  Finder(const std::string& text, const std::vector<std::string>& names, const std::string& source)
      : text_(text), names_(names), source_(source) {
    for (const std::string& name : names) {
      const std::optional<uint64_t> number = NumberIn(name);
      if (!number) return;
      numbers_.push_back(*number);
    }
    by_number_ = std::is_sorted(numbers_.begin(), numbers_.end());
  }

  absl::StatusOr<FrameRange> Find() const {
    if (names_.empty()) return absl::InvalidArgumentError(absl::StrCat(source_, ": holds no frame"));
    if (text_.empty()) return FrameRange{0, names_.size()};
    if (const auto one = Exactly(text_)) return FrameRange{*one, *one + 1};
    const size_t colon = text_.find(':');
    if (colon == std::string::npos) return NotThere(text_);
    const std::string before = text_.substr(0, colon), after = text_.substr(colon + 1);
    const std::optional<size_t> first = before.empty() ? 0 : Bound(before);
    if (!first || *first == names_.size()) return NotThere(before);
    const std::optional<size_t> end = after.empty() ? names_.size() : Bound(after);
    if (!end) return NotThere(after);
    if (*first < *end) return FrameRange{*first, *end};
    return absl::InvalidArgumentError(absl::StrCat("frames ", text_, " of ", source_,
                                                   ": no frame is in that range, B of A:B is not included; ",
                                                   FramesThere(names_)));
  }

 private:
  // The frame of that name, or with that number.
  std::optional<size_t> Exactly(const std::string& name) const {
    const auto at = std::find(names_.begin(), names_.end(), name);
    if (at != names_.end()) return static_cast<size_t>(at - names_.begin());
    const std::optional<uint64_t> number = NumberIn(name);
    if (!number) return std::nullopt;
    if (!by_number_) return *number < names_.size() ? std::optional<size_t>(*number) : std::nullopt;
    const auto equal = std::find(numbers_.begin(), numbers_.end(), *number);
    if (equal == numbers_.end()) return std::nullopt;
    return static_cast<size_t>(equal - numbers_.begin());
  }
  // The first frame of that name, or of no smaller number; one beyond the last is one beyond the last.
  std::optional<size_t> Bound(const std::string& name) const {
    const std::optional<uint64_t> number = NumberIn(name);
    if (const auto exact = Exactly(name); exact || !number) return exact;
    if (!by_number_) return *number == names_.size() ? std::optional(names_.size()) : std::nullopt;
    if (*number > numbers_.back() && *number - numbers_.back() > 1) return std::nullopt;
    return static_cast<size_t>(std::lower_bound(numbers_.begin(), numbers_.end(), *number) -
                               numbers_.begin());
  }
  absl::Status NotThere(const std::string& name) const {
    return absl::InvalidArgumentError(absl::StrCat("frames ", text_, ": frame ", name, " is not in ", source_,
                                                   "; ", FramesThere(names_),
                                                   "; name one, or a range A:B without its end"));
  }

  const std::string& text_;
  const std::vector<std::string>& names_;
  const std::string& source_;
  std::vector<uint64_t> numbers_;
  bool by_number_ = false;
};

}  // namespace

std::string FramesThere(const std::vector<std::string>& names) {
  if (names.empty()) return "it has no frame";
  if (names.size() == 1) return absl::StrCat("it has one frame, ", names.front());
  return absl::StrCat("it has ", names.size(), " frames, ", names.front(), " to ", names.back());
}

absl::StatusOr<FrameRange> FindFrameRange(const std::string& text, const std::vector<std::string>& names,
                                          const std::string& source) {
  return Finder(text, names, source).Find();
}

}  // namespace weft

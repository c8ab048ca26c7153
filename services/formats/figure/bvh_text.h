// The text of a BVH file as words and numbers.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// Words end at blanks, line ends, braces and colons, each of which but the blanks is a word of its own.
// Errors are InvalidArgument and name the line.
class BvhText {
 public:
  // A byte order mark at the beginning is skipped.
  explicit BvhText(std::string_view text);

  // Empty at the end.
  std::string_view Next();
  std::string_view Peek() const;
  // The rest of the line up to a brace, without blanks around it: a name may have blanks.
  std::string_view RestOfLine();
  // Whether the next word is this one, in any case; takes it then.
  bool Take(std::string_view lower_case);
  absl::Status Expect(std::string_view lower_case);
  // `what` names it in errors. Numbers are finite.
  absl::StatusOr<double> Number(std::string_view what);

  bool AtEnd() const;
  size_t Line() const { return line_; }                   // of the next word
  size_t LineBefore() const { return line_before_; }      // of the last one taken
  absl::Status Error(std::string_view what) const;        // in the line of the next word
  absl::Status ErrorBefore(std::string_view what) const;  // in that of the last one taken

 private:
  void SkipBlanks();
  std::string_view WordAt(size_t at) const;

  std::string_view text_;
  size_t at_ = 0, line_ = 1, line_before_ = 1;
};

// ASCII alone.
std::string LowerCase(std::string_view word);

}  // namespace weft

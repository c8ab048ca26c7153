#include "nets/tensor.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace weft {
namespace {

std::string DescribeSide(int64_t side) { return side == kAnySize ? "any" : absl::StrCat(side); }

bool IsOfShape(const TensorShape& given, const TensorShape& expected) {
  const auto fits = [](int64_t side, int64_t of) { return of == kAnySize || side == of; };
  return fits(given.channels, expected.channels) && fits(given.height, expected.height) &&
         fits(given.width, expected.width);
}

}  // namespace

std::string Describe(const TensorShape& shape) {
  return absl::StrCat(DescribeSide(shape.channels), " x ", DescribeSide(shape.height), " x ",
                      DescribeSide(shape.width));
}

std::string Describe(const std::vector<NamedShape>& shapes) {
  return absl::StrJoin(shapes, ", ", [](std::string* out, const NamedShape& named) {
    absl::StrAppend(out, "\"", named.name, "\" of ", Describe(named.shape));
  });
}

absl::Status CheckInputs(const std::vector<NamedShape>& expected,
                         const std::map<std::string, TensorShape>& given) {
  for (const auto& [name, shape] : given) {
    const auto found = std::find_if(expected.begin(), expected.end(),
                                    [&](const NamedShape& input) { return input.name == name; });
    if (found == expected.end())
      return absl::InvalidArgumentError(
          absl::StrCat("has no input \"", name, "\"; it takes ", Describe(expected)));
    if (!IsOfShape(shape, found->shape))
      return absl::InvalidArgumentError(
          absl::StrCat("takes ", Describe({*found}), ", and this one is of ", Describe(shape)));
  }
  for (const NamedShape& input : expected) {
    if (!given.contains(input.name))
      return absl::InvalidArgumentError(absl::StrCat("takes ", Describe({input}), ", which is missing"));
  }
  return absl::OkStatus();
}

}  // namespace weft

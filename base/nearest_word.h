// What somebody meant who misspelt a name.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace weft {

// Letters to insert, remove, replace or exchange with their neighbour (optimal string alignment).
size_t EditDistance(std::string_view a, std::string_view b);

// The name that is nearest to `word`, the first of several; empty where none is near: a third of the letters
// may be wrong, or one is the beginning of the other.
std::string NearestWord(std::string_view word, std::span<const std::string> names);

// "; did you mean NAME?", or nothing.
std::string DidYouMean(std::string_view word, std::span<const std::string> names);

}  // namespace weft

// How `weft` prints its help.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <string>

namespace weft {

// Breaks `text` at spaces into lines of at most `width` characters; every line after the first starts with
// `indent` spaces. Line breaks of the text stay.
std::string WrapText(const std::string& text, int width, int indent);

// Wraps descriptions, lists subcommands by the first sentence of theirs, and prints an option as
// "--width-px PX (required)" or "--seed N (default 1)".
std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter();

}  // namespace weft

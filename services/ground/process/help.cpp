#include "services/ground/process/help.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

constexpr int kWidth = 100;
constexpr int kColumn = 30;

std::string FirstSentence(const std::string& text) { return text.substr(0, text.find(". ")); }

std::string Row(const std::string& name, const std::string& text) {
  std::string out = absl::StrCat("  ", name);
  if (out.size() + 2 > kColumn) {
    absl::StrAppend(&out, "\n", std::string(kColumn, ' '));
  } else {
    out.resize(kColumn, ' ');
  }
  return absl::StrCat(out, WrapText(text, kWidth - kColumn, kColumn), "\n");
}

// The values that an option takes, "a, b, c"; empty where they are not a list of words, or stand in `about`.
std::string ValuesOf(const CLI::Option& option, const std::string& about) {
  const std::string type = option.get_type_name();  // "NAME:{a,b,c}"
  const size_t begin = type.find(":{"), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return "";
  const std::vector<std::string> values = absl::StrSplit(type.substr(begin + 2, end - begin - 2), ',');
  const std::vector<std::string> words = absl::StrSplit(about, absl::ByAnyChar(" ,;:.\n"), absl::SkipEmpty());
  const bool are_told = std::ranges::all_of(
      values, [&](const std::string& value) { return std::ranges::find(words, value) != words.end(); });
  return are_told ? "" : absl::StrJoin(values, ", ");
}

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override {
    return WrapText(app->get_description(), kWidth, 0) + "\n";
  }
  std::string make_subcommand(const CLI::App* sub) const override {
    return Row(sub->get_name(), FirstSentence(sub->get_description()));
  }
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    std::string name = option->get_name(is_positional, !is_positional);
    if (option->get_type_size() != 0 && !is_positional) {
      const std::string type = option->get_type_name();  // with ":VALIDATOR" behind it
      const std::string word = type.substr(0, type.find(':'));
      absl::StrAppend(&name, word.empty() ? "" : " ", word);  // a flag has none
      if (option->get_expected_max() > 1) name += "...";
    }
    std::string text = option->get_description();
    if (const std::string values = ValuesOf(*option, text); !values.empty())
      absl::StrAppend(&text, ": ", values);
    const std::string& standard = option->get_default_str();
    if (option->get_required()) {
      text += " (required)";
    } else if (!standard.empty() && standard != "[]" && option->get_type_size() != 0) {
      absl::StrAppend(&text, " (default ", standard, ")");
    }
    return Row(name, text);
  }
};

}  // namespace

std::string WrapText(const std::string& text, int width, int indent) {
  std::string out;
  int column = 0;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    if (!out.empty()) absl::StrAppend(&out, "\n", std::string(indent, ' '));
    column = 0;
    for (const absl::string_view word : absl::StrSplit(line, ' ', absl::SkipEmpty())) {
      const int length = static_cast<int>(word.size());
      if (column > 0 && column + 1 + length > width) {
        absl::StrAppend(&out, "\n", std::string(indent, ' '));
        column = 0;
      }
      absl::StrAppend(&out, column > 0 ? " " : "", word);
      column += length + (column > 0 ? 1 : 0);
    }
  }
  return out;
}

std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter() { return std::make_shared<HelpFormatter>(); }

}  // namespace weft

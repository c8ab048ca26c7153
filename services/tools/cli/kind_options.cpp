#include "services/tools/cli/kind_options.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "services/tools/cli/command_line.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

template <typename Infos, typename Is>
auto FindFirst(const Infos& infos, const Is& is) {
  const auto found = std::ranges::find_if(infos, is);
  return found == infos.end() ? nullptr : &*found;
}

const char* PlaceWord(v1::ItemKind item) {
  if (item == v1::ITEM_KIND_UNSPECIFIED) return "PATH";
  if (item == v1::ITEM_KIND_DUMP) return "DUMP";
  return item == v1::ITEM_KIND_TEMPLATE ? "DIR" : "FILE";
}

// Of a text the last word of its name, of a number its unit.
std::string ValueWordOf(const v1::WorkOptionInfo& option) {
  static const std::set<std::string> units = {"mm", "px", "deg"};
  const std::string last = option.name().substr(option.name().rfind('-') + 1);
  const bool is_said = option.type() == v1::OPTION_TYPE_TEXT || units.contains(last);
  return is_said ? absl::AsciiStrToUpper(last) : "N";
}

}  // namespace

KindOptions::KindOptions(CLI::App& command, const std::string& kind)
    : command_(command), kind_(*FindKindInfo(kind)) {}

const v1::WorkInputInfo* KindOptions::Input(const std::string& name) const {
  return FindFirst(kind_.inputs(), [&](const v1::WorkInputInfo& input) { return input.name() == name; });
}

const v1::WorkOptionInfo& KindOptions::Option(const std::string& name) const {
  return *FindFirst(kind_.options(), [&](const v1::WorkOptionInfo& option) { return option.name() == name; });
}

const std::string& KindOptions::LabelOf(const std::string& name) const {
  return Input(name) != nullptr ? Input(name)->label() : Option(name).label();
}

std::string KindOptions::WithValueWord(const std::string& name) const {
  const v1::WorkInputInfo* input = Input(name);
  return absl::StrCat(input != nullptr && input->is_positional() ? "" : "--", name, " ",
                      input != nullptr ? PlaceWord(input->item()) : ValueWordOf(Option(name)));
}

void KindOptions::Restrict(const std::string& name, CLI::Option* option) const {
  if (const v1::WorkInputInfo* input = Input(name)) {
    option->required(input->is_required());
    if (!input->may_repeat()) option->expected(1);
    return;
  }
  const v1::WorkOptionInfo& info = Option(name);
  option->required(info.is_required());
  if (!info.choices().empty()) option->check(OneOf({info.choices().begin(), info.choices().end()}));
  // Of jobs, FaultOfWork checks it.
  if (kind_.start() != v1::WORK_START_OPERATION || (info.least() == 0 && info.most() == 0)) return;
  if (std::isinf(info.most())) {
    option->check(info.least() > 0 ? CLI::PositiveNumber : CLI::NonNegativeNumber);
  } else if (info.type() == v1::OPTION_TYPE_INTEGER) {
    option->check(CLI::Range(static_cast<int>(info.least()), static_cast<int>(info.most())));
  } else {
    option->check(CLI::Range(info.least(), info.most()));
  }
}

void KindOptions::operator()(const std::string& name, PipelineFlags& flags, const std::string& path) {
  const auto set = [&flags, path](const std::string& value) {
    flags.shorthands.push_back(absl::StrCat(path, "=", value));
  };
  if (Option(name).type() == v1::OPTION_TYPE_FLAG) {
    command_.add_flag_callback(
        "--" + name, [set] { set("true"); }, LabelOf(name));
  } else {
    Restrict(name, command_.add_option_function<std::string>("--" + name, set, LabelOf(name))
                       ->type_name(ValueWordOf(Option(name)))
                       ->default_str(DefaultOfOption(path)));
  }
}

v1::WorkSpec WorkOf(const v1::WorkKindInfo& kind, const CLI::App& command,
                    std::vector<const CLI::Option*>* others) {
  v1::WorkSpec work;
  work.set_kind(kind.name());
  for (const CLI::Option* given : command.get_options()) {
    const auto is_it = [given](const auto& known) { return given->check_lname(known.name()); };
    const v1::WorkInputInfo* input = FindFirst(kind.inputs(), [&](const v1::WorkInputInfo& known) {
      return known.is_positional() ? given->get_positional() : is_it(known);
    });
    const v1::WorkOptionInfo* option = FindFirst(kind.options(), is_it);
    if (input == nullptr && option == nullptr) {
      if (given->count() > 0) others->push_back(given);
      continue;
    }
    for (const std::string& value : given->results()) {
      if (value.empty()) continue;
      v1::NamedValue& added = input != nullptr ? *work.add_inputs() : *work.add_options();
      added.set_name(input != nullptr ? input->name() : option->name());
      if (option == nullptr || option->type() != v1::OPTION_TYPE_FLAG) added.set_value(value);
    }
  }
  return work;
}

}  // namespace weft

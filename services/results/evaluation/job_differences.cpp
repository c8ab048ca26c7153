// What two jobs were asked and computed from, where they differ.
#include "absl/strings/str_cat.h"
#include "services/formats/options/option_range.h"
#include "services/results/evaluation/compare_jobs.h"

namespace weft {

std::vector<JobDifference> DifferencesOf(const v1::Job& a, const v1::Job& b) {
  std::vector<JobDifference> out;
  const auto add = [&out](const std::string& what, const std::string& of_a, const std::string& of_b) {
    if (of_a != of_b) out.push_back({what, of_a, of_b});
  };
  const auto yes = [](bool value) { return value ? "yes" : "no"; };
  const auto input = [](const std::string& path, const std::string& hash) {
    return hash.empty() ? path : absl::StrCat(path, " (", hash, ")");
  };
  const v1::RegistrationSpec &spec_a = a.spec(), &spec_b = b.spec();
  const v1::RegistrationOptions &of_a = spec_a.options(), &of_b = spec_b.options();
  add("preset", of_a.preset(), of_b.preset());
  add("take", spec_a.dump(), spec_b.dump());
  if (a.inputs().rig() != b.inputs().rig() || spec_a.rig() != spec_b.rig())
    add("rig", input(spec_a.rig(), a.inputs().rig()), input(spec_b.rig(), b.inputs().rig()));
  if (a.inputs().board() != b.inputs().board())
    add("board", input(spec_a.board(), a.inputs().board()), input(spec_b.board(), b.inputs().board()));
  if (a.inputs().garment() != b.inputs().garment())
    add("template", input(spec_a.garment(), a.inputs().garment()),
        input(spec_b.garment(), b.inputs().garment()));
  add("single pass", yes(of_a.single_pass()), yes(of_b.single_pass()));
  add("frames alone", yes(of_a.frames_alone()), yes(of_b.frames_alone()));
  add("scans", of_a.scans(), of_b.scans());
  add("starts", of_a.starts(), of_b.starts());
  for (const OptionField& option : AllOptions())
    if (!option.IsGroup())
      add(option.path, OptionValue(of_a.pipeline(), option), OptionValue(of_b.pipeline(), option));
  add("version of Weft", a.weft_version(), b.weft_version());
  return out;
}

}  // namespace weft

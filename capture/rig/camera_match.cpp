#include "capture/rig/camera_match.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "capture/file/name_forms.h"

namespace weft {
namespace {

int PositionIn(const std::map<std::string, int>& positions, const std::string& name) {
  const auto found = positions.find(name);
  return found == positions.end() ? -1 : found->second;
}

// "c01 is c1 there".
std::vector<std::string> NamesThatDifferInZeros(const CameraMatch& match) {
  std::map<std::string, std::string> of_rig;
  for (const std::string& id : match.without_images) of_rig[NameWithoutZeros(CaselessName(id))] = id;
  std::vector<std::string> pairs;
  for (const std::string& id : match.without_model) {
    const auto alike = of_rig.find(NameWithoutZeros(CaselessName(id)));
    if (alike != of_rig.end()) pairs.push_back(absl::StrCat(alike->second, " is ", id, " there"));
  }
  return pairs;
}

}  // namespace

CameraNames::CameraNames(const std::vector<std::string>& ids) {
  const auto add = [](std::map<std::string, int>& positions, const std::string& form, size_t i) {
    const auto [at, is_new] = positions.emplace(form, static_cast<int>(i));
    if (!is_new) at->second = -1;
  };
  for (size_t i = 0; i < ids.size(); ++i) {
    add(exact_, ids[i], i);
    add(composed_, ComposedName(ids[i]), i);
    add(caseless_, CaselessName(ids[i]), i);
  }
}

int CameraNames::Find(const std::string& name) const {
  if (const int found = PositionIn(exact_, name); found >= 0) return found;
  if (const int found = PositionIn(composed_, ComposedName(name)); found >= 0) return found;
  return PositionIn(caseless_, CaselessName(name));
}

std::string FirstNames(const std::vector<std::string>& names) {
  constexpr size_t kShown = 8;
  const size_t shown = std::min(names.size(), kShown);
  const std::string first =
      absl::StrJoin(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), ", ");
  return names.size() == shown ? first : absl::StrCat(first, " and ", names.size() - shown, " more");
}

std::vector<std::string> CameraWarnings(const CameraMatch& match, const std::string& recording) {
  std::vector<std::string> lines;
  const size_t missing = match.without_images.size(), unknown = match.without_model.size();
  if (missing == 1) {
    lines.push_back(
        absl::StrCat("camera ", match.without_images[0], " of the rig has no images in ", recording));
  } else if (missing > 1) {
    lines.push_back(absl::StrCat(missing, " of ", match.of_rig, " cameras of the rig have no images in ",
                                 recording, ": ", FirstNames(match.without_images)));
  }
  if (unknown > 0) {
    lines.push_back(absl::StrCat(
        unknown, " of ", match.of_recording, " cameras of ", recording, unknown == 1 ? " is" : " are",
        " not in the rig: ", FirstNames(match.without_model), "; is it the rig of this take?"));
  }
  if (const std::vector<std::string> pairs = NamesThatDifferInZeros(match); !pairs.empty())
    lines.push_back(absl::StrCat("names of cameras differ from the rig's in zeros alone: ", FirstNames(pairs),
                                 "; rename them alike"));
  return lines;
}

}  // namespace weft

#include <algorithm>
#include <cctype>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "figure/retarget.h"

namespace weft {
namespace {

// "mixamorig:LeftUpLeg" and "left_up_leg" are one: lower case, without prefix and separators.
std::string Plain(std::string_view name) {
  const size_t colon = name.rfind(':');
  if (colon != std::string_view::npos) name.remove_prefix(colon + 1);
  std::string out;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Names without their side, the likelier ones first: in some files "LeftShoulder" is a clavicle.
constexpr std::string_view kUpperArmNames[] = {"arm", "uparm", "upperarm", "shldr", "shoulder"};
constexpr std::string_view kForearmNames[] = {"forearm", "lowarm", "lowerarm", "elbow"};
constexpr std::string_view kHandNames[] = {"hand", "wrist"};
constexpr std::string_view kThighNames[] = {"upleg", "upperleg", "thigh", "hip"};
constexpr std::string_view kShinNames[] = {"leg", "lowleg", "lowerleg", "shin", "calf", "knee"};
constexpr std::string_view kAnkleNames[] = {"foot", "ankle"};
constexpr std::string_view kPelvisNames[] = {"hips", "pelvis", "hip", "root"};
constexpr std::string_view kHeadNames[] = {"head", "neck"};

class JointMatcher {
 public:
  explicit JointMatcher(const ForeignMotion& motion) : joints_(motion.joints) {
    for (const ForeignMotion::Joint& joint : joints_) plain_.push_back(Plain(joint.name));
  }

  // `sides`: what may stand before or behind a name.
  int Find(std::span<const std::string_view> names, std::span<const std::string_view> sides) const {
    for (const std::string_view name : names) {
      for (const std::string_view side : sides) {
        const std::string before = absl::StrCat(std::string(side), std::string(name));
        const std::string behind = absl::StrCat(std::string(name), std::string(side));
        for (size_t k = 0; k < plain_.size(); ++k)
          if (plain_[k] == before || plain_[k] == behind) return static_cast<int>(k);
      }
    }
    return -1;
  }

  int Named(const std::string& name) const {
    for (size_t k = 0; k < joints_.size(); ++k)
      if (joints_[k].name == name) return static_cast<int>(k);
    return -1;
  }

  int ParentOf(int joint) const { return joints_[static_cast<size_t>(joint)].parent; }

  bool IsAbove(int above, int joint) const {
    for (; joint >= 0; joint = ParentOf(joint))
      if (joint == above) return true;
    return false;
  }

  // Where the ways from both to the root meet; -1 where they do not.
  int Branch(int a, int b) const {
    while (a >= 0 && !IsAbove(a, b)) a = ParentOf(a);
    return a;
  }

 private:
  const std::vector<ForeignMotion::Joint>& joints_;
  std::vector<std::string> plain_;
};

// The file's left is the side of +x, our "right".
struct FileSide {
  std::string_view names[2];
  Joint clavicle, thigh;
  int ankle;
};
constexpr FileSide kFileSides[] = {{{"left", "l"}, Joint::kRightClavicle, Joint::kRightThigh, 1},
                                   {{"right", "r"}, Joint::kLeftClavicle, Joint::kLeftThigh, 0}};

// Joints by `given` and by their names.
absl::StatusOr<JointMatch> MatchNames(const JointMatcher& find,
                                      const std::map<std::string, std::string>& given) {
  JointMatch out;
  out.of.fill(-1);
  const auto set = [&](Joint joint, int after, int found) {
    out.of[static_cast<size_t>(joint) + static_cast<size_t>(after)] = found;
  };
  constexpr std::string_view kNoSide[] = {""};
  set(Joint::kPelvis, 0, find.Find(kPelvisNames, kNoSide));
  set(Joint::kHead, 0, find.Find(kHeadNames, kNoSide));
  for (const FileSide& side : kFileSides) {
    set(side.clavicle, 1, find.Find(kUpperArmNames, side.names));
    set(side.clavicle, 2, find.Find(kForearmNames, side.names));
    set(side.clavicle, 3, find.Find(kHandNames, side.names));
    set(side.thigh, 0, find.Find(kThighNames, side.names));
    set(side.thigh, 1, find.Find(kShinNames, side.names));
    out.ankles[static_cast<size_t>(side.ankle)] = find.Find(kAnkleNames, side.names);
  }
  for (const auto& [ours, theirs] : given) {
    const std::optional<Joint> joint = JointNamed(ours);
    if (!joint) return absl::InvalidArgumentError(absl::StrCat("joint \"", ours, "\" is none of ours"));
    const int found = find.Named(theirs);
    if (found < 0)
      return absl::InvalidArgumentError(absl::StrCat("the file has no joint called \"", theirs, "\""));
    set(*joint, 0, found);
  }
  return out;
}

// Where the arms branch off is the chest; what carries an arm beyond it is a clavicle.
void MatchTrunk(const JointMatcher& find, JointMatch& match) {
  const auto of = [&](Joint joint) -> int& { return match.of[static_cast<size_t>(joint)]; };
  int& chest = of(Joint::kChest);
  const int pelvis = of(Joint::kPelvis), left = of(Joint::kLeftUpperArm), right = of(Joint::kRightUpperArm);
  if (chest < 0) chest = find.Branch(left, right);
  for (const auto& [clavicle, arm] : {std::pair(Joint::kLeftClavicle, left), {Joint::kRightClavicle, right}})
    if (of(clavicle) < 0 && find.ParentOf(arm) != chest) of(clavicle) = find.ParentOf(arm);
  if (of(Joint::kSpine) >= 0 || !find.IsAbove(pelvis, chest)) return;
  std::vector<int> between;
  for (int k = find.ParentOf(chest); k >= 0 && k != pelvis && chest != pelvis; k = find.ParentOf(k))
    between.push_back(k);
  if (!between.empty()) of(Joint::kSpine) = between[between.size() / 2];
}

}  // namespace

absl::StatusOr<JointMatch> MatchJoints(const ForeignMotion& motion,
                                       const std::map<std::string, std::string>& given) {
  const JointMatcher find(motion);
  absl::StatusOr<JointMatch> out = MatchNames(find, given);
  if (!out.ok()) return out;
  std::string missing;
  for (const Joint joint :
       {Joint::kPelvis, Joint::kLeftUpperArm, Joint::kLeftForearm, Joint::kRightUpperArm,
        Joint::kRightForearm, Joint::kLeftThigh, Joint::kLeftShin, Joint::kRightThigh, Joint::kRightShin})
    if (out->of[static_cast<size_t>(joint)] < 0)
      absl::StrAppend(&missing, missing.empty() ? "" : ", ", std::string(NameOf(joint)));
  if (!missing.empty()) {
    std::string names;
    for (const ForeignMotion::Joint& joint : motion.joints)
      absl::StrAppend(&names, names.empty() ? "" : ", ", joint.name);
    return absl::InvalidArgumentError(absl::StrCat("no joint was recognised as ", missing,
                                                   "; its joints are ", names,
                                                   "; name them with --joint OURS=THEIRS"));
  }
  MatchTrunk(find, *out);
  return out;
}

}  // namespace weft

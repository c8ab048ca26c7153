#include <algorithm>
#include <cctype>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "figure/retarget.h"

namespace weft {
namespace {

// "mixamorig:Left_UpLeg" is "left", "up", "leg": words in lower case, without the name space of a program.
std::vector<std::string> WordsOf(std::string_view name) {
  const size_t colon = name.rfind(':');
  if (colon != std::string_view::npos) name.remove_prefix(colon + 1);
  std::vector<std::string> out;
  bool in_word = false, was_lower = false;
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    if (!std::isalnum(u)) {
      in_word = false;
      continue;
    }
    if (!in_word || (std::isupper(u) && was_lower)) out.emplace_back();
    out.back() += static_cast<char>(std::tolower(u));
    in_word = true;
    was_lower = std::islower(u) || std::isdigit(u);
  }
  return out;
}

// What most names begin with is no part of them: "Bip01 L Thigh", "m_avg_L_Hip".
std::vector<std::string> CommonWords(const std::vector<std::vector<std::string>>& names) {
  constexpr double kMost = 0.8;
  std::vector<std::string> common;
  while (true) {
    std::map<std::string, size_t> counts;
    for (const std::vector<std::string>& words : names)
      if (words.size() > common.size() + 1 && std::equal(common.begin(), common.end(), words.begin()))
        ++counts[words[common.size()]];
    const auto most = std::max_element(counts.begin(), counts.end(), [](const auto& left, const auto& right) {
      return left.second < right.second;
    });
    if (most == counts.end() || static_cast<double>(most->second) < kMost * static_cast<double>(names.size()))
      return common;
    common.push_back(most->first);
  }
}

// Names as they are compared: words without common ones, joined; of ends of limbs, which have no name, none.
std::vector<std::string> PlainNames(const std::vector<ForeignMotion::Joint>& joints) {
  std::vector<std::vector<std::string>> all, named;
  for (const ForeignMotion::Joint& joint : joints) {
    all.push_back(WordsOf(joint.name));
    if (!all.back().empty()) named.push_back(all.back());
  }
  const std::vector<std::string> common = CommonWords(named);
  std::vector<std::string> out;
  for (const std::vector<std::string>& words : all) {
    const bool is_prefixed =
        words.size() > common.size() && std::equal(common.begin(), common.end(), words.begin());
    out.emplace_back();
    for (size_t k = is_prefixed ? common.size() : 0; k < words.size(); ++k) out.back() += words[k];
  }
  return out;
}

// Names without their side, the likelier ones first: in some files "LeftShoulder" is a clavicle. Where there
// is a wrist or an ankle, a hand or a foot is the joint behind it.
constexpr std::string_view kUpperArmNames[] = {"arm", "uparm", "upperarm", "shldrbend", "shldr", "shoulder"};
constexpr std::string_view kForearmNames[] = {"forearm", "lowarm", "lowerarm", "forearmbend", "elbow"};
constexpr std::string_view kHandNames[] = {"wrist", "hand"};
constexpr std::string_view kThighNames[] = {"upleg", "upperleg", "thigh", "thighbend", "hip"};
constexpr std::string_view kShinNames[] = {"leg", "lowleg", "lowerleg", "shin", "calf", "knee"};
constexpr std::string_view kAnkleNames[] = {"ankle", "foot"};
constexpr std::string_view kPelvisNames[] = {"hips", "pelvis", "hip", "root"};
constexpr std::string_view kHeadNames[] = {"head", "neck"};

class JointMatcher {
 public:
  explicit JointMatcher(const ForeignMotion& motion) : joints_(motion.joints), plain_(PlainNames(joints_)) {}

  // `sides`: what may stand before or behind a name. InvalidArgument: two joints of the first name there is.
  absl::StatusOr<int> Find(std::span<const std::string_view> names,
                           std::span<const std::string_view> sides) const {
    for (const std::string_view name : names) {
      for (const std::string_view side : sides) {
        const std::string before = absl::StrCat(std::string(side), std::string(name));
        const std::string behind = absl::StrCat(std::string(name), std::string(side));
        int found = -1;
        for (size_t k = 0; k < plain_.size(); ++k) {
          if (plain_[k] != before && plain_[k] != behind) continue;
          if (found >= 0) return Twice(found, static_cast<int>(k));
          found = static_cast<int>(k);
        }
        if (found >= 0) return found;
      }
    }
    return -1;
  }

  // Joints that turn a limb around itself, as many programs add them, hide no elbow and no knee.
  bool OnlyTurns(int joint) const {
    const std::string& name = plain_[static_cast<size_t>(joint)];
    return name.find("twist") != std::string::npos || name.find("roll") != std::string::npos;
  }

  const std::string& NameOf(int joint) const { return joints_[static_cast<size_t>(joint)].name; }

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
  absl::Status Twice(int a, int b) const {
    if (NameOf(a) == NameOf(b))
      return absl::InvalidArgumentError(
          absl::StrCat("two joints are called \"", NameOf(a), "\"; rename one of them in the file"));
    return absl::InvalidArgumentError(absl::StrCat("joints \"", NameOf(a), "\" and \"", NameOf(b),
                                                   "\" may be the same; rename one of them in the file"));
  }

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
  absl::Status status;
  const auto set = [&](int& joint, bool is_given, std::span<const std::string_view> names,
                       std::span<const std::string_view> sides) {
    if (is_given || !status.ok()) return;
    const absl::StatusOr<int> found = find.Find(names, sides);
    status = found.status();
    if (found.ok()) joint = *found;
  };
  const auto of = [&](Joint joint, int after, std::span<const std::string_view> names,
                      std::span<const std::string_view> sides) {
    const auto j = static_cast<size_t>(joint) + static_cast<size_t>(after);
    set(out.of[j], given.contains(std::string(NameOf(static_cast<Joint>(j)))), names, sides);
  };
  constexpr std::string_view kNoSide[] = {"", "c"};
  of(Joint::kPelvis, 0, kPelvisNames, kNoSide);
  of(Joint::kHead, 0, kHeadNames, kNoSide);
  for (const FileSide& side : kFileSides) {
    of(side.clavicle, 1, kUpperArmNames, side.names);
    of(side.clavicle, 2, kForearmNames, side.names);
    of(side.clavicle, 3, kHandNames, side.names);
    of(side.thigh, 0, kThighNames, side.names);
    of(side.thigh, 1, kShinNames, side.names);
    set(out.ankles[static_cast<size_t>(side.ankle)], false, kAnkleNames, side.names);
  }
  if (!status.ok()) return status;
  for (const auto& [ours, theirs] : given) {
    const std::optional<Joint> joint = JointNamed(ours);
    if (!joint) return absl::InvalidArgumentError(absl::StrCat("joint \"", ours, "\" is none of ours"));
    const int found = find.Named(theirs);
    if (found < 0)
      return absl::InvalidArgumentError(absl::StrCat("the file has no joint called \"", theirs, "\""));
    out.of[static_cast<size_t>(*joint)] = found;
  }
  return out;
}

// One joint of the file moves one of ours.
absl::Status CheckDistinct(const JointMatcher& find, const JointMatch& match) {
  for (size_t a = 0; a < kJoints; ++a)
    for (size_t b = a + 1; b < kJoints; ++b)
      if (match.of[a] >= 0 && match.of[a] == match.of[b])
        return absl::InvalidArgumentError(
            absl::StrCat("\"", find.NameOf(match.of[a]), "\" is matched with both ",
                         std::string(NameOf(static_cast<Joint>(a))), " and ",
                         std::string(NameOf(static_cast<Joint>(b))), "; name them with --joint OURS=THEIRS"));
  return absl::OkStatus();
}

// A limb leads from joint to joint. One in between that no name explains may be the one that is meant: a
// clavicle called shoulder, followed by an arm of an unknown name.
absl::Status CheckLimb(const JointMatcher& find, const JointMatch& match, Joint upper, bool is_given) {
  const auto lower = static_cast<Joint>(static_cast<int>(upper) + 1);
  const int from = match.of[static_cast<size_t>(upper)], to = match.of[static_cast<size_t>(lower)];
  if (from < 0 || to < 0) return absl::OkStatus();
  const std::string ours(NameOf(upper));
  if (!find.IsAbove(from, to))
    return absl::InvalidArgumentError(absl::StrCat(
        "\"", find.NameOf(to), "\", matched with ", std::string(NameOf(lower)), ", does not hang on \"",
        find.NameOf(from), "\", matched with ", ours, "; name them with --joint OURS=THEIRS"));
  if (is_given) return absl::OkStatus();
  for (int k = find.ParentOf(to); k >= 0 && k != from; k = find.ParentOf(k))
    if (!find.OnlyTurns(k))
      return absl::InvalidArgumentError(absl::StrCat(
          ours, " may be \"", find.NameOf(from), "\" or \"", find.NameOf(k), "\", which is between it and \"",
          find.NameOf(to), "\"; name it with --joint ", ours, "=\"", find.NameOf(k), "\" or the other"));
  return absl::OkStatus();
}

absl::Status CheckLimbs(const JointMatcher& find, const JointMatch& match,
                        const std::map<std::string, std::string>& given) {
  for (const Joint upper : {Joint::kLeftUpperArm, Joint::kRightUpperArm, Joint::kLeftForearm,
                            Joint::kRightForearm, Joint::kLeftThigh, Joint::kRightThigh}) {
    const bool is_given = given.contains(std::string(NameOf(upper)));
    WEFT_RETURN_IF_ERROR(CheckLimb(find, match, upper, is_given));
  }
  return CheckDistinct(find, match);
}

// A shin ends at the first joint on the way to the foot that does more than turn; what hangs elsewhere is no
// ankle of this shin.
void MatchAnkles(const JointMatcher& find, JointMatch& match) {
  for (const auto& [side, shin] : {std::pair(size_t{0}, Joint::kLeftShin), {size_t{1}, Joint::kRightShin}}) {
    const int from = match.of[static_cast<size_t>(shin)];
    int& ankle = match.ankles[side];
    if (ankle >= 0 && (ankle == from || !find.IsAbove(from, ankle))) ankle = -1;
    if (ankle < 0) continue;
    for (int k = find.ParentOf(ankle); k != from; k = find.ParentOf(k))
      if (!find.OnlyTurns(k)) ankle = k;
  }
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
      if (!joint.name.empty()) absl::StrAppend(&names, names.empty() ? "" : ", ", joint.name);
    return absl::InvalidArgumentError(absl::StrCat("no joint was recognised as ", missing,
                                                   "; its joints are ", names,
                                                   "; name them with --joint OURS=THEIRS"));
  }
  WEFT_RETURN_IF_ERROR(CheckLimbs(find, *out, given));
  MatchAnkles(find, *out);
  MatchTrunk(find, *out);
  return out;
}

}  // namespace weft

#include "capture/take/image_layout.h"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/file/name_forms.h"

namespace weft {
namespace {

// What programs and people call cameras and frames, before a number.
constexpr std::array kCameraWords = {"cam",  "camera", "c",      "kamera", "kam",   "view",  "v",
                                     "cn",   "dev",    "device", "sensor", "sn",    "gopro", "kinect",
                                     "hero", "basler", "flir",   "phone",  "iphone"};
constexpr std::array kFrameWords = {"frame", "frames", "f",       "fr",  "frm",  "image", "images",
                                    "img",   "im",     "picture", "pic", "shot", "dsc",   "gopr"};
// Cameras without a number.
constexpr std::array kSides = {"left", "right", "top",    "bottom", "front",
                               "back", "rear",  "center", "centre", "middle"};

template <typename Words>
bool IsOneOf(const Words& words, std::string_view text) {
  return std::any_of(words.begin(), words.end(), [text](const char* word) { return text == word; });
}

// "cam" of "Cam_03", "" of "0003"; the name itself where it has no number at its end.
std::string WordOf(const std::string& name) {
  const std::string lower = absl::AsciiStrToLower(name);
  size_t end = lower.size();
  while (end > 0 && IsDigit(lower[end - 1])) --end;
  while (end > 0 && absl::StrContains("_- .", lower[end - 1])) --end;
  return lower.substr(0, end);
}

bool HasNumber(const std::string& name) { return !name.empty() && IsDigit(name.back()); }

enum class Kind { kNumber, kFrame, kCamera, kOther };

Kind KindOf(const std::string& name) {
  const std::string word = WordOf(name);
  if (!HasNumber(name)) return IsOneOf(kSides, word) ? Kind::kCamera : Kind::kOther;
  if (word.empty()) return Kind::kNumber;
  if (IsOneOf(kCameraWords, word) || IsOneOf(kSides, word)) return Kind::kCamera;
  return IsOneOf(kFrameWords, word) ? Kind::kFrame : Kind::kOther;
}

// Names of one kind.
struct Names {
  Kind kind = Kind::kOther;
  std::set<std::string> names;
};

// What most names are alike, three of four at least, else kOther: folders of another kind may lie beside
// them.
Names MostOf(const std::set<std::string>& names) {
  std::map<Kind, std::set<std::string>> by_kind;
  for (const std::string& name : names) by_kind[KindOf(name)].insert(name);
  for (const auto& [kind, alike] : by_kind) {
    if (4 * alike.size() >= 3 * names.size()) return {kind, alike};
  }
  return {Kind::kOther, names};
}

std::string NumberOf(const std::string& name) {
  size_t begin = name.size();
  while (begin > 0 && IsDigit(name[begin - 1])) --begin;
  return name.substr(begin);
}

// Frames are numbered with leading zeros, serial numbers of cameras are not.
bool IsPadded(const std::set<std::string>& names) {
  constexpr size_t kDigits = 3;
  const size_t size = NumberOf(*names.begin()).size();
  return size >= kDigits &&
         std::all_of(names.begin(), names.end(),
                     [&](const auto& name) { return NumberOf(name).size() == size; }) &&
         std::any_of(names.begin(), names.end(),
                     [](const auto& name) { return NumberOf(name).front() == '0'; });
}

std::string NamedAs(const char* what, const std::set<std::string>& names, const char* as) {
  return absl::StrCat(what, " are named as ", as, " are (", *names.begin(),
                      names.size() > 1 ? absl::StrCat(" to ", *names.rbegin()) : "", ")");
}

// Nothing where no name is a camera's.
std::optional<LayoutJudgement> ByCamerasOfRig(const std::set<std::string>& folders,
                                              const std::set<std::string>& files, const CameraNames& rig) {
  const auto known_folders = std::count_if(folders.begin(), folders.end(), [&rig](const std::string& name) {
    return CameraOfFolderName(rig, name) >= 0;
  });
  const auto known_files = std::count_if(files.begin(), files.end(),
                                         [&rig](const std::string& name) { return rig.Find(name) >= 0; });
  // Shares of names that are cameras, made comparable.
  const auto of_folders = known_folders * static_cast<std::ptrdiff_t>(files.size());
  const auto of_files = known_files * static_cast<std::ptrdiff_t>(folders.size());
  if (of_folders == 0 && of_files == 0) return std::nullopt;
  if (of_folders < of_files) return LayoutJudgement{};
  if (of_folders > of_files)
    return LayoutJudgement{ImageLayout::kFolderPerCamera, "the folders have the names of the rig's cameras"};
  return LayoutJudgement{ImageLayout::kFolderPerFrame, "folders and files have names of the rig's cameras",
                         true};
}

}  // namespace

int CameraOfFolderName(const CameraNames& rig, const std::string& folder) {
  constexpr size_t kCam = 3;
  const int found = rig.Find(folder);
  if (found >= 0 || !absl::StartsWithIgnoreCase(folder, "cam")) return found;
  const size_t begin = folder.find_first_not_of("_- ", kCam);
  return begin == std::string::npos ? -1 : rig.Find(folder.substr(begin));
}

LayoutJudgement JudgeLayout(const std::set<std::string>& folders, const std::set<std::string>& files,
                            const CameraNames* rig) {
  if (folders.empty() || files.empty()) return {};
  if (rig != nullptr) {
    if (const std::optional<LayoutJudgement> judgement = ByCamerasOfRig(folders, files, *rig))
      return *judgement;
  }
  const Names of_folders = MostOf(folders), of_files = MostOf(files);
  const Kind outer = of_folders.kind, inner = of_files.kind;
  const LayoutJudgement open = {ImageLayout::kFolderPerFrame,
                                "names of folders and pictures fit frames and cameras alike", true};
  if (outer == Kind::kCamera && inner == Kind::kCamera) return open;
  if (outer == Kind::kCamera)
    return {ImageLayout::kFolderPerCamera, NamedAs("the folders", of_folders.names, "cameras")};
  if (inner == Kind::kCamera || inner == Kind::kOther || outer == Kind::kFrame) return {};
  const bool outer_padded = outer == Kind::kNumber && IsPadded(of_folders.names),
             inner_padded = IsPadded(of_files.names);
  if (outer_padded && !inner_padded) return inner == Kind::kFrame ? open : LayoutJudgement{};
  if (inner == Kind::kFrame || (inner_padded && !outer_padded))
    return {ImageLayout::kFolderPerCamera, NamedAs("the pictures", of_files.names, "frames")};
  return open;
}

}  // namespace weft

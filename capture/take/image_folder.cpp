#include "capture/take/image_folder.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/name_forms.h"
#include "capture/file/plain_text.h"
#include "capture/image/image_header.h"
#include "capture/rig/camera_match.h"
#include "capture/take/image_layout.h"
#include "capture/take/picture_choice.h"
#include "capture/take/picture_copies.h"
#include "capture/take/picture_names.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

struct Picture {
  std::string folder, stem;  // composed
  std::string path;
};

// All pictures below a dump, and what lies beside them.
struct Found {
  std::vector<Picture> pictures;
  std::vector<std::string> unfit, foreign_files, foreign_folders, empty_folders, closed_folders, loose,
      unread, copies;
  std::set<std::string> decomposed;  // names
};

// The rig, where one is given, and its cameras by their names.
struct KnownCameras {
  const Rig* rig;
  CameraNames names;

  explicit KnownCameras(const Rig* given) : rig(given), names(IdsOf(given)) {}
  static std::vector<std::string> IdsOf(const Rig* rig) {
    std::vector<std::string> ids;
    if (rig == nullptr) return ids;
    for (const CameraModel& camera : rig->cameras) ids.push_back(camera.id);
    return ids;
  }
  // As the rig has it, else the name itself.
  std::string IdOf(const std::string& name) const { return IdAt(names.Find(name), name); }
  std::string IdOfFolder(const std::string& name) const {
    return IdAt(CameraOfFolderName(names, name), name);
  }
  std::string IdAt(int index, const std::string& name) const {
    return index < 0 ? name : rig->cameras[static_cast<size_t>(index)].id;
  }
};

// All files of one camera in one frame.
using Files = std::map<std::string, std::map<std::string, std::vector<std::string>>, NaturalOrder>;

std::string NameOf(const fs::path& path) { return path.filename().string(); }

std::vector<fs::directory_entry> Entries(const fs::path& folder, std::error_code& error) {
  std::vector<fs::directory_entry> out;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    out.push_back(*it);
  std::sort(out.begin(), out.end());
  return out;
}

std::string Composed(const std::string& name, Found& found) {
  std::string composed = ComposedName(name);
  if (composed != name) found.decomposed.insert(name);
  return composed;
}

void LookInto(const fs::path& folder, Found& found) {
  std::error_code error;
  const std::string name = NameOf(folder);
  const std::vector<fs::directory_entry> entries = Entries(folder, error);
  if (IsForeignName(name)) {
    const bool holds_pictures = std::any_of(entries.begin(), entries.end(), [](const auto& entry) {
      return IsPictureName(NameOf(entry.path()));
    });
    if (holds_pictures) found.foreign_folders.push_back(EscapedText(name));
    return;
  }
  if (error) found.closed_folders.push_back(EscapedText(name));
  if (entries.empty() && !error && IsPlainText(name)) found.empty_folders.push_back(name);
  const bool fit = IsPlainText(name);
  for (const fs::directory_entry& file : entries) {
    const std::string file_name = NameOf(file.path()), stem = file.path().stem().string();
    if (IsUnreadPictureName(file_name) && !IsForeignName(file_name))
      found.unread.push_back(EscapedText(absl::StrCat(name, "/", file_name)));
    if (!IsPictureName(file_name)) continue;
    if (IsForeignName(file_name)) {
      found.foreign_files.push_back(EscapedText(file_name));
    } else if (!fit || !IsPlainText(stem)) {
      found.unfit.push_back(fit ? file.path().string() : folder.string());
      if (!fit) return;
    } else {
      found.pictures.push_back({Composed(name, found), Composed(stem, found), file.path().string()});
    }
  }
}

absl::StatusOr<Found> LookThrough(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return absl::NotFoundError(absl::StrCat(EscapedText(folder), ": no such folder"));
  Found found;
  for (const fs::directory_entry& entry : Entries(folder, error)) {
    std::error_code entry_error;
    if (entry.is_directory(entry_error)) {
      LookInto(entry.path(), found);
    } else if (IsPictureName(NameOf(entry.path())) && !IsForeignName(NameOf(entry.path()))) {
      found.loose.push_back(EscapedText(NameOf(entry.path())));
    }
  }
  if (!error) return found;
  return absl::PermissionDeniedError(
      absl::StrCat(EscapedText(folder), ": cannot be listed (", error.message(), ")"));
}

std::string ComplainOfNames(const std::vector<std::string>& paths) {
  return absl::StrCat(EscapedText(paths.front()),
                      paths.size() == 1 ? "" : absl::StrCat(" and ", paths.size() - 1, " more"),
                      ": the name is not UTF-8 text without control characters; rename it");
}

std::string Counted(size_t count, const char* one, const char* many) {
  return absl::StrCat(count, " ", count == 1 ? one : many);
}

// "c01 (1)" beside "c01", of pictures in a folder and of folders.
void LeaveOutCopies(Found& found) {
  std::set<std::pair<std::string, std::string>> names;
  std::set<std::string> folders;
  for (const Picture& picture : found.pictures) {
    names.emplace(picture.folder, picture.stem);
    folders.insert(picture.folder);
  }
  std::erase_if(found.pictures, [&](const Picture& picture) {
    const bool is_copy = folders.contains(OriginalOfCopy(picture.folder)) ||
                         names.contains({picture.folder, OriginalOfCopy(picture.stem)});
    if (is_copy) found.copies.push_back(absl::StrCat(picture.folder, "/", picture.stem));
    return is_copy;
  });
}

// Pictures of a folder c01 that are named c01_0007. Where all do so, and no camera of the rig is called so.
void ShortenNames(const KnownCameras& known, Found& found) {
  std::vector<std::string> shorter;
  for (const Picture& picture : found.pictures) {
    shorter.push_back(NameWithoutFolder(picture.stem, picture.folder));
    if (shorter.back().empty() || known.names.Find(picture.stem) >= 0) return;
  }
  for (size_t i = 0; i < shorter.size(); ++i) found.pictures[i].stem = shorter[i];
}

// The camera of <dump>/cam<camera>/image<frame>.png, empty for other files.
std::string CameraOfFolder(const Picture& picture, const KnownCameras& known) {
  constexpr size_t kCam = 3, kImage = 5;
  if (!absl::StartsWithIgnoreCase(picture.folder, "cam") ||
      !absl::StartsWithIgnoreCase(picture.stem, "image") || picture.stem.size() == kImage)
    return "";
  const std::string id = picture.folder.substr(kCam);
  if (known.rig == nullptr || known.names.Find(id) >= 0) return id;
  return known.names.Find(picture.folder) >= 0 ? picture.folder : "";
}

using Size = std::pair<int, int>;

std::optional<Size> SizeInHeader(const Picture& picture) {
  const absl::StatusOr<ImageHeader> header = ReadImageFileHeader(picture.path);
  if (!header.ok()) return std::nullopt;
  return Size(header->width_px, header->height_px);
}

// Cameras that differ in size tell which names are theirs: there all pictures are alike.
std::optional<ImageLayout> LayoutBySizes(const std::vector<const Picture*>& pictures) {
  constexpr size_t kMostNames = 8;
  std::map<std::string, std::set<Size>> of_folder, of_stem;
  std::set<Size> all;
  for (const Picture* picture : pictures) {
    const bool is_known = of_folder.contains(picture->folder) || of_folder.size() < kMostNames;
    if (!is_known || (!of_stem.contains(picture->stem) && of_stem.size() >= kMostNames)) continue;
    const std::optional<Size> size = SizeInHeader(*picture);
    if (!size) continue;
    of_folder[picture->folder].insert(*size);
    of_stem[picture->stem].insert(*size);
    all.insert(*size);
  }
  const auto alike = [](const auto& sizes) {
    return std::all_of(sizes.begin(), sizes.end(), [](const auto& one) { return one.second.size() == 1; });
  };
  if (all.size() < 2 || alike(of_folder) == alike(of_stem)) return std::nullopt;
  return alike(of_folder) ? ImageLayout::kFolderPerCamera : ImageLayout::kFolderPerFrame;
}

// Of the pictures that are no cam<camera>/image<frame>.
LayoutJudgement Judge(const std::vector<const Picture*>& pictures, const KnownCameras& known) {
  std::set<std::string> folders, stems;
  for (const Picture* picture : pictures) {
    folders.insert(picture->folder);
    stems.insert(picture->stem);
  }
  LayoutJudgement judgement = JudgeLayout(folders, stems, known.rig == nullptr ? nullptr : &known.names);
  if (!judgement.is_open || known.rig != nullptr) return judgement;
  const std::optional<ImageLayout> by_sizes = LayoutBySizes(pictures);
  if (!by_sizes) return judgement;
  if (*by_sizes == ImageLayout::kFolderPerFrame) return {};
  return {*by_sizes, "pictures of a folder have one size, and folders differ"};
}

void NoteLayout(const LayoutJudgement& judgement, std::vector<std::string>& notes) {
  const bool per_camera = judgement.layout == ImageLayout::kFolderPerCamera;
  if (!per_camera && !judgement.is_open) return;
  const char* taken = per_camera ? "<camera>/<frame>" : "<frame>/<camera>";
  const char* other = per_camera ? "<frame>/<camera>" : "<camera>/<frame>";
  notes.push_back(absl::StrCat(
      "folders are read as ", taken, ", since ", judgement.why, "; if they are ", other, ", name them ",
      per_camera ? "by numbers, and pictures by cameras" : "cam<camera>/image<frame>"));
}

// "masks" and "calib" among 0000, 0001 ... hold no frames.
void LeaveOutUnnumbered(std::vector<const Picture*>& pictures, std::vector<std::string>& notes) {
  std::set<std::string> numbered, others;
  for (const Picture* picture : pictures) {
    const bool has_number = std::any_of(picture->folder.begin(), picture->folder.end(), IsDigit);
    (has_number ? numbered : others).insert(picture->folder);
  }
  if (others.empty() || numbered.size() < 2) return;
  std::erase_if(pictures, [&](const Picture* picture) { return others.contains(picture->folder); });
  notes.push_back(absl::StrCat("folders without a number among ", numbered.size(),
                               " numbered ones are left out: ", FirstNames({others.begin(), others.end()})));
}

Files ByFrameAndCamera(const Found& found, const KnownCameras& known, std::vector<std::string>& notes) {
  Files files;
  std::vector<const Picture*> others;
  for (const Picture& picture : found.pictures) {
    const std::string camera = CameraOfFolder(picture, known);
    if (camera.empty()) {
      others.push_back(&picture);
    } else {
      files[picture.stem.substr(5)][known.IdOf(camera)].push_back(picture.path);
    }
  }
  const LayoutJudgement judgement = Judge(others, known);
  if (!others.empty()) NoteLayout(judgement, notes);
  if (judgement.layout == ImageLayout::kFolderPerFrame) LeaveOutUnnumbered(others, notes);
  for (const Picture* picture : others) {
    if (judgement.layout == ImageLayout::kFolderPerCamera) {
      files[picture->stem][known.IdOfFolder(picture->folder)].push_back(picture->path);
    } else {
      files[picture->folder][known.IdOf(picture->stem)].push_back(picture->path);
    }
  }
  return files;
}

// Frames whose names differ in leading zeros alone become the one with most of them.
void JoinNumbers(Files& files, std::vector<std::string>& notes) {
  std::map<std::string, std::vector<std::string>> alike;
  for (const auto& [name, cameras] : files) alike[NameWithoutZeros(name)].push_back(name);
  std::vector<std::string> joined, apart;
  for (auto& [number, names] : alike) {
    if (names.size() < 2) continue;
    std::sort(names.begin(), names.end(), [](const auto& a, const auto& b) {
      return a.size() > b.size() || (a.size() == b.size() && a < b);
    });
    std::set<std::string> cameras;
    size_t count = 0;
    for (const std::string& name : names) {
      count += files[name].size();
      for (const auto& [camera, paths] : files[name]) cameras.insert(camera);
    }
    (cameras.size() == count ? joined : apart).push_back(absl::StrCat(names[1], " and ", names[0]));
    if (cameras.size() < count) continue;
    for (size_t i = 1; i < names.size(); ++i) {
      files[names[0]].merge(files[names[i]]);
      files.erase(names[i]);
    }
  }
  if (!joined.empty())
    notes.push_back(
        absl::StrCat("frames whose numbers differ in zeros alone are taken as one: ", FirstNames(joined)));
  if (!apart.empty())
    notes.push_back(
        absl::StrCat("frames are kept apart although their numbers differ in zeros alone, since "
                     "they have pictures of the same cameras: ",
                     FirstNames(apart)));
}

// Of the files of one camera in a frame. Cameras that the rig lacks are not read.
absl::StatusOr<std::string> ChooseFile(const std::vector<std::string>& paths, const std::string& camera,
                                       const Rig* rig) {
  if (paths.size() == 1) return paths.front();
  if (rig == nullptr) return ChoosePicture(paths, std::nullopt);
  const int index = rig->IndexOf(camera);
  if (index < 0) return paths.front();
  const CameraModel& model = rig->cameras[static_cast<size_t>(index)];
  return ChoosePicture(paths, ImageSize{model.width_px, model.height_px});
}

absl::Status ChooseFiles(const Files& files, const Rig* rig, ImageFolder& listing) {
  std::vector<std::string> left_out;
  for (const auto& [frame, cameras] : files) {
    for (const auto& [camera, paths] : cameras) {
      WEFT_ASSIGN_OR_RETURN(const std::string chosen, ChooseFile(paths, camera, rig));
      listing.frames[frame][camera] = chosen;
      for (const std::string& path : paths) {
        if (path != chosen) left_out.push_back(absl::StrCat(frame, "/", EscapedText(NameOf(path))));
      }
    }
  }
  if (left_out.empty()) return absl::OkStatus();
  listing.notes.push_back(
      absl::StrCat("of several files of one camera in a frame, ",
                   rig == nullptr ? "the largest picture is taken" : "the one of the rig's size is taken",
                   "; left out: ", FirstNames(left_out)));
  return absl::OkStatus();
}

void NoteCameras(const ImageFolder& listing, const Rig* rig, std::vector<std::string>& notes) {
  std::map<std::string, std::string> pictures;
  for (const auto& [frame, cameras] : listing.frames)
    for (const auto& [camera, path] : cameras) pictures.emplace(camera, path);
  if (rig == nullptr) {
    std::map<std::string, std::string> alike;
    for (const auto& [camera, path] : pictures) {
      const auto [first, is_new] = alike.emplace(NameWithoutZeros(CaselessName(camera)), camera);
      if (!is_new)
        notes.push_back(absl::StrCat("cameras ", first->second, " and ", camera,
                                     " are two, though their names differ in case or zeros alone"));
    }
  }
  for (std::string& note : OrientationNotes(pictures)) notes.push_back(std::move(note));
}

void NoteLeftOut(const Found& found, std::vector<std::string>& notes) {
  if (!found.foreign_files.empty())
    notes.push_back(absl::StrCat(Counted(found.foreign_files.size(), "hidden file is", "hidden files are"),
                                 " left out: ", FirstNames(found.foreign_files)));
  if (!found.foreign_folders.empty())
    notes.push_back(absl::StrCat("pictures in folders of other programs are left out: ",
                                 FirstNames(found.foreign_folders)));
  if (!found.unread.empty())
    notes.push_back(absl::StrCat(Counted(found.unread.size(), "picture is", "pictures are"),
                                 " not read, being unfinished or of another kind than PNG, JPEG and TIFF: ",
                                 FirstNames(found.unread), "; convert them"));
  if (!found.copies.empty())
    notes.push_back(
        absl::StrCat(Counted(found.copies.size(), "picture is a copy", "pictures are copies"),
                     " by the name, beside the original, and left out: ", FirstNames(found.copies)));
  if (!found.closed_folders.empty())
    notes.push_back(absl::StrCat("folders that cannot be listed (permissions?) are left out: ",
                                 FirstNames(found.closed_folders)));
  if (!found.empty_folders.empty())
    notes.push_back(absl::StrCat("empty folders are no frames: ", FirstNames(found.empty_folders)));
  if (!found.decomposed.empty())
    notes.push_back(absl::StrCat(Counted(found.decomposed.size(), "name is", "names are"),
                                 " decomposed as macOS writes it, and taken as composed (NFC), such as ",
                                 ComposedName(*found.decomposed.begin())));
}

}  // namespace

absl::StatusOr<ImageFolder> ListImageFolder(const std::string& folder, const Rig* rig,
                                            UnfitNames unfit_names) {
  WEFT_ASSIGN_OR_RETURN(Found found, LookThrough(folder));
  LeaveOutCopies(found);
  ShortenNames(KnownCameras(rig), found);
  if (!found.unfit.empty() && unfit_names == UnfitNames::kRefuse)
    return absl::InvalidArgumentError(ComplainOfNames(found.unfit));
  ImageFolder listing;
  if (!found.unfit.empty())
    listing.notes.push_back(absl::StrCat(ComplainOfNames(found.unfit), "; left out until then"));
  Files files = ByFrameAndCamera(found, KnownCameras(rig), listing.notes);
  JoinNumbers(files, listing.notes);
  WEFT_RETURN_IF_ERROR(ChooseFiles(files, rig, listing));
  NoteLeftOut(found, listing.notes);
  NoteCameras(listing, rig, listing.notes);
  if (listing.frames.empty() && !found.loose.empty())
    listing.notes.push_back(absl::StrCat("pictures lie in the folder itself (", FirstNames(found.loose),
                                         "), not in folders of frames"));
  return listing;
}

}  // namespace weft

// Folders of images with known content: bytes choose cameras, frames, the layout, names and what other
// programs put beside them.
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/image/image_encoders.h"
#include "capture/take/image_folder.h"
#include "capture/take/image_folder_dump.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;

// Decisions, one byte each; 0 where there are no more.
class Choices {
 public:
  Choices(const uint8_t* data, size_t size) : data_(data), size_(size) {}
  size_t Below(size_t limit) { return at_ < size_ ? data_[at_++] % limit : 0; }

 private:
  const uint8_t* data_;
  size_t size_;
  size_t at_ = 0;
};

// A picture with nothing in it.
std::string Picture(int width_px) {
  constexpr int kHeight_px = 3;
  const std::vector<uint8_t> pixels(static_cast<size_t>(width_px) * kHeight_px);
  const auto png = weft::EncodePng({width_px, kHeight_px, 1, 8, pixels});
  weft::FuzzRequire(png.ok());
  return {png->begin(), png->end()};
}

void Write(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

struct Names {
  std::string on_disk, id;
};

// Cameras as studios name them, decomposed on the disk or in capitals where `odd`.
std::vector<Names> CameraNames(Choices& choices) {
  const size_t count = 1 + choices.Below(4), kind = choices.Below(4);
  const bool odd = choices.Below(3) == 0;
  std::vector<Names> cameras;
  for (size_t i = 0; i < count; ++i) {
    const std::string number = absl::StrFormat("%02d", i);
    switch (kind) {
      case 0:
        cameras.push_back({(odd ? "C" : "c") + number, "c" + number});
        break;
      case 1:
        cameras.push_back({absl::StrCat(400002 + 13 * i), absl::StrCat(400002 + 13 * i)});
        break;
      case 2:
        cameras.push_back({(odd ? "cam e\xcc\x81" : "cam \xc3\xa9") + number, "cam \xc3\xa9" + number});
        break;
      default:
        cameras.push_back({"view_" + number, "view_" + number});
    }
  }
  return cameras;
}

std::vector<Names> FrameNames(Choices& choices) {
  const size_t count = 1 + choices.Below(4), kind = choices.Below(3), first = choices.Below(200);
  std::vector<Names> frames;
  for (size_t i = 0; i < count; ++i) {
    const size_t number = first + i + (i > 1 ? choices.Below(9) * 10 : 0);
    const std::string name =
        kind == 0   ? absl::StrFormat("%04d", number)
        : kind == 1 ? absl::StrCat(number)
                    : absl::StrCat(1623840123456789012 + 33333333 * static_cast<int64_t>(number));
    if (frames.empty() || frames.back().id != name) frames.push_back({name, name});
  }
  return frames;
}

void WriteForeignFiles(const fs::path& dump, const std::vector<fs::path>& pictures, Choices& choices) {
  const std::string small = Picture(2);
  if (choices.Below(2) == 0) {
    for (const fs::path& picture : pictures)
      Write(picture.parent_path() / ("._" + picture.filename().string()), "Mac OS X");
  }
  for (const char* folder : {"@eaDir", ".thumbnails", "#recycle", "__MACOSX"}) {
    if (choices.Below(2) == 0 && !pictures.empty()) Write(dump / folder / pictures[0].filename(), small);
  }
  if (choices.Below(2) == 0) fs::create_directories(dump / "lost+found");
  if (choices.Below(2) == 0) Write(dump / "Thumbs.db", "");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Choices choices(data, size);
  const fs::path dump = weft::FuzzFolder("image_folder");
  fs::remove_all(dump);
  fs::create_directories(dump);
  const std::vector<Names> cameras = CameraNames(choices), frames = FrameNames(choices);
  enum { kPerFrame, kPerCamera, kPaper } const layout = static_cast<decltype(kPerFrame)>(choices.Below(3));
  constexpr int kWidth_px = 4;
  const std::string picture = Picture(kWidth_px), preview = Picture(2);
  const bool has_previews = choices.Below(4) == 0;
  std::map<std::string, std::set<std::string>> truth;  // cameras of each frame
  std::vector<fs::path> written;
  weft::Rig rig;
  for (const Names& camera : cameras) {
    weft::CameraModel model;
    model.id = camera.id;
    model.width_px = kWidth_px;
    model.height_px = 3;
    rig.cameras.push_back(model);
  }
  for (const Names& frame : frames) {
    for (const Names& camera : cameras) {
      if (choices.Below(8) == 7) continue;  // lost
      const char* ending = choices.Below(3) == 0 ? ".PNG" : ".png";
      const fs::path path = layout == kPerFrame ? dump / frame.on_disk / (camera.on_disk + ending)
                            : layout == kPerCamera
                                ? dump / camera.on_disk / (frame.on_disk + ending)
                                : dump / ("cam" + camera.on_disk) / ("image" + frame.on_disk + ending);
      Write(path, picture);
      if (has_previews) Write(fs::path(path).replace_extension(".tif"), preview);
      written.push_back(path);
      truth[frame.id].insert(camera.id);
    }
  }
  WriteForeignFiles(dump, written, choices);
  const auto source = weft::ImageFolderDump::Open(dump.string(), rig);
  weft::FuzzRequire(source.ok() == !written.empty(), std::string(source.status().message()));
  const auto listing = weft::ListImageFolder(dump.string(), &rig);
  weft::FuzzRequire(listing.ok(), std::string(listing.status().message()));
  std::map<std::string, std::set<std::string>> listed;
  for (const auto& [frame, files] : listing->frames)
    for (const auto& [camera, path] : files) {
      listed[frame].insert(camera);
      weft::FuzzRequire(fs::path(path).extension() != ".tif", path);
    }
  weft::FuzzRequire(listed == truth, dump.string());
  fs::remove_all(dump);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::vector<std::string> seeds;
  for (int seed = 0; seed < 12; ++seed) {
    std::string bytes;
    for (int i = 0; i < 40; ++i) bytes += static_cast<char>(seed * 37 + i * (seed + 11));
    seeds.push_back(bytes);
  }
  return seeds;
}

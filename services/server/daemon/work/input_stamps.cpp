#include "services/server/daemon/work/input_stamps.h"

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "capture/take/take_files.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kDepth = 3;         // as far as FindLinks looks
constexpr time_t kSettled_s = 2;  // the coarsest clocks of file systems, of FAT, tick that slowly

auto Identity(const struct stat& info) {
  return std::tuple(info.st_dev, info.st_ino, info.st_mode, info.st_size, info.st_mtim.tv_sec,
                    info.st_mtim.tv_nsec, info.st_ctim.tv_sec, info.st_ctim.tv_nsec);
}

}  // namespace

void InputStamps::Add(const std::string& path) {
  Stamp stamp{path, {}};
  if (lstat(path.c_str(), &stamp.info) != 0 ||
      std::max(stamp.info.st_mtim.tv_sec, stamp.info.st_ctim.tv_sec) >= now_s_ - kSettled_s) {
    conclusive_ = false;
  }
  stamps_.push_back(std::move(stamp));
}

void InputStamps::AddFolder(const std::string& folder, bool with_files, int depth) {
  Add(folder);
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end && conclusive_;
       it.increment(error)) {
    std::error_code unknown;
    if (it->is_symlink(unknown)) {
      conclusive_ = false;
    } else if (it->is_directory(unknown)) {
      if (depth < kDepth) AddFolder(it->path(), with_files, depth + 1);
    } else if (with_files) {
      Add(it->path());
    }
  }
  if (error) conclusive_ = false;
}

void InputStamps::AddFilesBeside(const std::string& json) {
  const fs::path folder = fs::path(json).parent_path();
  Add(folder);
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end && conclusive_;
       it.increment(error)) {
    std::error_code unknown;
    if (it->is_symlink(unknown)) conclusive_ = false;
    if (it->is_regular_file(unknown)) Add(it->path());
  }
  if (error) conclusive_ = false;
}

InputStamps InputStamps::Take(const v1::RegistrationSpec& spec, time_t now_s) {
  InputStamps stamps(now_s);
  for (const JobInput& input : InputsOf(spec)) {
    const std::string& path = input.path;
    std::error_code error;
    if (path.empty() || !stamps.conclusive_) continue;
    const bool holds_images = input.kind == v1::ITEM_KIND_DUMP && !IsRecordedTake(path);
    if (fs::is_directory(path, error)) {
      stamps.AddFolder(path, !holds_images, 0);
    } else {
      stamps.Add(path);
      if (fs::path(path).extension() == ".json") stamps.AddFilesBeside(path);
    }
  }
  return stamps;
}

bool InputStamps::StillHold() const {
  return std::all_of(stamps_.begin(), stamps_.end(), [](const Stamp& stamp) {
    struct stat now = {};
    return lstat(stamp.path.c_str(), &now) == 0 && Identity(now) == Identity(stamp.info);
  });
}

}  // namespace weft

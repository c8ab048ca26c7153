#include "tests/services/server/catalogue/crash_vfs.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace weft {
namespace {

constexpr char kName[] = "weft-crash";

CrashVfs* disk = nullptr;
sqlite3_vfs* real_vfs = nullptr;

// A file of the real VFS behind ours.
struct File {
  sqlite3_file base;
  std::string* path;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

File& Own(sqlite3_file* file) { return *reinterpret_cast<File*>(file); }
sqlite3_file* Real(sqlite3_file* file) { return Own(file).real(); }

std::string ReadAll(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

void Apply(const CrashVfs::Change& change, std::string& bytes) {
  if (change.kind == CrashVfs::Kind::kTruncate) {
    bytes.resize(static_cast<size_t>(change.offset));
  } else {
    bytes.resize(std::max(bytes.size(), static_cast<size_t>(change.offset) + change.bytes.size()));
    bytes.replace(static_cast<size_t>(change.offset), change.bytes.size(), change.bytes);
  }
}

int Close(sqlite3_file* file) {
  const int code = Real(file)->pMethods->xClose(Real(file));
  delete Own(file).path;
  return code;
}

int Read(sqlite3_file* file, void* to, int size, sqlite3_int64 at) {
  return Real(file)->pMethods->xRead(Real(file), to, size, at);
}

int Write(sqlite3_file* file, const void* from, int size, sqlite3_int64 at) {
  const int failure = disk->Begin(
      *Own(file).path,
      {CrashVfs::Kind::kWrite, at, std::string(static_cast<const char*>(from), static_cast<size_t>(size))});
  return failure != 0 ? failure : Real(file)->pMethods->xWrite(Real(file), from, size, at);
}

int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  const int failure = disk->Begin(*Own(file).path, {CrashVfs::Kind::kTruncate, size, ""});
  return failure != 0 ? failure : Real(file)->pMethods->xTruncate(Real(file), size);
}

// The real disk need not flush: what is safe is ours to say.
int Sync(sqlite3_file* file, int) { return disk->Begin(*Own(file).path, {CrashVfs::Kind::kSync, 0, ""}); }

int FileSize(sqlite3_file* file, sqlite3_int64* size) {
  return Real(file)->pMethods->xFileSize(Real(file), size);
}
int LockFile(sqlite3_file* file, int level) { return Real(file)->pMethods->xLock(Real(file), level); }
int UnlockFile(sqlite3_file* file, int level) { return Real(file)->pMethods->xUnlock(Real(file), level); }
int CheckLock(sqlite3_file* file, int* held) {
  return Real(file)->pMethods->xCheckReservedLock(Real(file), held);
}
int Control(sqlite3_file* file, int what, void* value) {
  return Real(file)->pMethods->xFileControl(Real(file), what, value);
}
int SectorSize(sqlite3_file* file) { return Real(file)->pMethods->xSectorSize(Real(file)); }
int Traits(sqlite3_file* file) { return Real(file)->pMethods->xDeviceCharacteristics(Real(file)); }

// Version 1: no shared memory, which a database that is held alone does not need.
const sqlite3_io_methods kMethods = {1,        Close,      Read,      Write,   Truncate,   Sync,  FileSize,
                                     LockFile, UnlockFile, CheckLock, Control, SectorSize, Traits};

int Open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  if (name == nullptr || !disk->IsOurs(name)) return real_vfs->xOpen(real_vfs, name, file, flags, out_flags);
  disk->Opened(name);
  File& own = *new (file) File{};
  const int code = real_vfs->xOpen(real_vfs, name, own.real(), flags, out_flags);
  own.base.pMethods = nullptr;
  if (code != SQLITE_OK) return code;
  own.path = new std::string(name);
  own.base.pMethods = &kMethods;
  return SQLITE_OK;
}

int Delete(sqlite3_vfs*, const char* name, int sync_folder) {
  if (disk->IsOurs(name)) {
    const int failure = disk->Begin(name, {CrashVfs::Kind::kDelete, sync_folder, ""});
    if (failure != 0) return failure;
  }
  return real_vfs->xDelete(real_vfs, name, sync_folder);
}

sqlite3_vfs MakeVfs() {
  sqlite3_vfs vfs = *real_vfs;
  vfs.szOsFile = static_cast<int>(sizeof(File)) + real_vfs->szOsFile;
  vfs.pNext = nullptr;
  vfs.zName = kName;
  vfs.xOpen = Open;
  vfs.xDelete = Delete;
  return vfs;
}

sqlite3_vfs crash_vfs;

}  // namespace

CrashVfs::CrashVfs(std::string database_path) : database_path_(std::move(database_path)) {
  disk = this;
  real_vfs = sqlite3_vfs_find(nullptr);
  crash_vfs = MakeVfs();
  sqlite3_vfs_register(&crash_vfs, 1);
}

CrashVfs::~CrashVfs() {
  sqlite3_vfs_unregister(&crash_vfs);
  sqlite3_vfs_register(real_vfs, 1);
  disk = nullptr;
}

bool CrashVfs::IsOurs(const std::string& path) const {
  return path == database_path_ || path == database_path_ + "-wal" || path == database_path_ + "-journal";
}

void CrashVfs::Opened(const std::string& path) {
  if (files_.contains(path)) return;
  files_[path] = {std::filesystem::exists(path), ReadAll(path), {}};
}

void CrashVfs::FailFrom(int64_t n, int64_t count) {
  fail_from_ = n;
  fail_until_ = n + count;
}

int CrashVfs::Begin(const std::string& path, Change change) {
  if (power_is_off()) return SQLITE_IOERR;
  ++operations_;
  const bool fails = operations_ >= fail_from_ && operations_ < fail_until_;
  if (!fails && !power_is_off()) {
    Record(path, std::move(change));
    return SQLITE_OK;
  }
  OnDisk& file = files_[path];
  if (change.kind == Kind::kWrite) {
    change.bytes.resize(random_() % (change.bytes.size() + 1));
    Record(path, std::move(change));
    return power_is_off() ? SQLITE_IOERR_WRITE : SQLITE_FULL;
  }
  if (change.kind == Kind::kSync && !power_is_off()) {
    std::erase_if(file.pending, [this](const Change&) { return random_() % 2 == 0; });
    return SQLITE_IOERR_FSYNC;
  }
  return SQLITE_IOERR;
}

void CrashVfs::Record(const std::string& path, Change change) {
  OnDisk& file = files_[path];
  if (change.kind == Kind::kSync) {
    Settle(file);
  } else if (change.kind == Kind::kDelete) {
    const bool flushed = change.offset != 0;
    const std::optional<std::string> old =
        file.exists ? std::optional<std::string>(file.bytes) : file.removed;
    file = {};
    if (!flushed) file.removed = old;
  } else {
    file.pending.push_back(std::move(change));
  }
}

void CrashVfs::Settle(OnDisk& file) {
  for (const Change& change : file.pending) Apply(change, file.bytes);
  file.pending.clear();
  // SQLite flushes the folder with the first flush of a new file, so that removed ones stay removed.
  if (!file.exists) {
    for (auto& [path, other] : files_) other.removed.reset();
  }
  file.exists = true;
}

void CrashVfs::Crash(uint32_t seed) {
  std::mt19937 random(seed);
  for (auto& [path, file] : files_) {
    for (const Change& change : file.pending) {
      const auto fate = random() % 4;  // lost, torn, whole
      if (fate == 0) continue;
      Change kept = change;
      if (fate == 1 && kept.kind == Kind::kWrite) {
        // One end of it.
        const size_t cut = random() % (kept.bytes.size() + 1);
        if (random() % 2 == 0) {
          kept.bytes.resize(cut);
        } else {
          kept.bytes.erase(0, cut);
          kept.offset += static_cast<int64_t>(cut);
        }
      }
      Apply(kept, file.bytes);
      file.exists = file.exists || random() % 2 == 0;
    }
    if (file.removed && random() % 2 == 0) {
      file.bytes = *file.removed;
      file.exists = true;
    }
    std::filesystem::remove(path);
    if (file.exists) std::ofstream(path, std::ios::binary) << file.bytes;
  }
  Forget();
}

void CrashVfs::Forget() {
  files_.clear();
  operations_ = 0;
  fail_from_ = fail_until_ = 0;
  power_off_at_ = INT64_MAX;
}

}  // namespace weft

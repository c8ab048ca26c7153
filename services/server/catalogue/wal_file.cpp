#include "services/server/catalogue/wal_file.h"

#include <algorithm>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"

namespace weft {
namespace {

constexpr size_t kHeaderBytes = 32;
constexpr size_t kPageHeaderBytes = 24;
constexpr uint32_t kMagic = 0x377f0682;  // the lowest bit says in which order the checksum reads its words

uint32_t BigEndian(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

uint32_t LittleEndian(std::string_view bytes, size_t at) { return __builtin_bswap32(BigEndian(bytes, at)); }

struct Sum {
  uint32_t a = 0, b = 0;
  bool operator==(const Sum& other) const { return a == other.a && b == other.b; }
};

Sum Continue(Sum sum, std::string_view bytes, bool big_endian) {
  const auto word = [&](size_t at) { return big_endian ? BigEndian(bytes, at) : LittleEndian(bytes, at); };
  for (size_t at = 0; at + 8 <= bytes.size(); at += 8) {
    sum.a += word(at) + sum.b;
    sum.b += word(at + 4) + sum.a;
  }
  return sum;
}

Sum StoredSum(std::string_view bytes, size_t at) { return {BigEndian(bytes, at), BigEndian(bytes, at + 4)}; }

bool IsPageSize(size_t bytes) { return bytes >= 512 && bytes <= 65536 && (bytes & (bytes - 1)) == 0; }

struct Header {
  bool intact = false;
  bool big_endian = false;
  std::string_view salts;
};

Header ReadHeader(WalFile& wal) {
  const std::string_view bytes = wal.bytes;
  Header header;
  header.big_endian = (BigEndian(bytes, 0) & 1) != 0;
  header.intact = (BigEndian(bytes, 0) & ~1u) == kMagic &&
                  Continue({}, bytes.substr(0, 24), header.big_endian) == StoredSum(bytes, 24);
  wal.page_bytes = BigEndian(bytes, 8);
  header.salts = bytes.substr(16, 8);
  if (header.intact && IsPageSize(wal.page_bytes)) return header;
  // A damaged header: what this machine writes, and what the first page says.
  constexpr size_t kUsualPageBytes = 4096;
  header = {false, false, bytes.substr(std::min(bytes.size(), kHeaderBytes + 8), 8)};
  wal.page_bytes = kUsualPageBytes;
  return header;
}

}  // namespace

absl::StatusOr<WalFile> ReadWalFile(const std::string& path) {
  WalFile wal;
  const uint64_t size = FileBytes(path);
  if (size <= kHeaderBytes) return wal;
  std::ifstream file(path, std::ios::binary);
  wal.bytes.resize(size);
  if (!file.read(wal.bytes.data(), static_cast<std::streamsize>(size)))
    return absl::UnavailableError(absl::StrCat(path, ": cannot be read; check the disk"));
  const Header header = ReadHeader(wal);
  const std::string_view bytes = wal.bytes;

  // Each checksum continues the one that stands before it, so that a damaged page spoils its own and at most
  // the next.
  Sum last = header.intact ? StoredSum(bytes, 24) : Sum();
  bool sound = header.intact;
  size_t commits_after_damage = 0, sound_pages = 0, all_pages = 0;
  const size_t stride = kPageHeaderBytes + wal.page_bytes;
  for (size_t at = kHeaderBytes; at + stride <= size; at += stride) {
    const std::string_view page = bytes.substr(at, stride);
    const Sum stored = StoredSum(page, 16);
    const bool ours = page.substr(8, 8) == header.salts;
    const bool intact = ours && Continue(Continue(last, page.substr(0, 8), header.big_endian),
                                         page.substr(kPageHeaderBytes), header.big_endian) == stored;
    const bool is_commit = BigEndian(page, 4) != 0;
    const bool first_damage = sound && !intact;
    sound = sound && intact;
    if (!sound && (intact || (first_damage && ours)) && is_commit) ++commits_after_damage;
    if (intact) wal.pages.push_back({BigEndian(page, 0), at + kPageHeaderBytes, is_commit});
    if (intact && is_commit) {
      all_pages = wal.pages.size();
      if (sound) sound_pages = all_pages;
    }
    last = stored;
  }
  wal.damaged = commits_after_damage >= 2;
  wal.pages.resize(wal.damaged ? all_pages : sound_pages);
  return wal;
}

absl::Status ApplyWal(const WalFile& wal, const std::string& database_path) {
  if (wal.pages.empty()) return absl::OkStatus();
  { const std::ofstream made(database_path, std::ios::binary | std::ios::app); }
  std::fstream file(database_path, std::ios::binary | std::ios::in | std::ios::out);
  for (const WalFile::Page& page : wal.pages) {
    file.seekp(static_cast<std::streamoff>((page.number - 1) * wal.page_bytes));
    file.write(wal.bytes.data() + page.offset, static_cast<std::streamsize>(wal.page_bytes));
  }
  file.close();
  if (file.good()) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(database_path, ": cannot be written; make room on the disk"));
}

}  // namespace weft

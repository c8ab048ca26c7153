#include "learning/sample_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>

namespace weft::learning {
namespace {

constexpr char kMagic[] = "weftsmp1";
constexpr size_t kHalfBytes = 2;
constexpr uint32_t kMostTexels = 1 << 22, kMostChannels = 1 << 10;

template <class T>
T Read(const char* at) {
  T out;
  std::memcpy(&out, at, sizeof(out));
  return out;
}

}  // namespace

SampleFile::SampleFile(const std::string& path) {
  const auto bad = [&](const std::string& what) { return std::runtime_error(path + ": " + what); };
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw bad("can't be opened");
  struct stat about {};
  const bool known = fstat(file, &about) == 0 && about.st_size > 0;
  bytes_ = known ? static_cast<size_t>(about.st_size) : 0;
  void* mapped = known ? mmap(nullptr, bytes_, PROT_READ, MAP_PRIVATE, file, 0) : MAP_FAILED;
  close(file);
  if (mapped == MAP_FAILED) throw bad("can't be read");
  data_ = static_cast<const char*>(mapped);
  const auto refuse = [&](const std::string& what) {
    munmap(const_cast<char*>(data_), bytes_);
    data_ = nullptr;
    return bad(what);
  };
  constexpr size_t kHead = 8 + 5 * sizeof(uint32_t);
  if (bytes_ < kHead || std::memcmp(data_, kMagic, 8) != 0) throw refuse("is no file of samples");
  std::array<uint32_t, 5> head{};
  for (size_t i = 0; i < head.size(); ++i) head[i] = Read<uint32_t>(data_ + 8 + 4 * i);
  const uint32_t count = head[4];
  if (head[0] == 0 || head[1] == 0 || head[0] > kMostChannels || head[1] > kMostChannels || head[2] == 0 ||
      head[3] == 0 || head[2] > kMostTexels / head[3] || count == 0 || count > head[2] * head[3])
    throw refuse("has a size that makes no sense");
  features_ = static_cast<int>(head[0]), answers_ = static_cast<int>(head[1]);
  height_ = static_cast<int>(head[2]), width_ = static_cast<int>(head[3]);
  const size_t tables = kHead + count * (sizeof(uint32_t) + 1);
  if (bytes_ < tables) throw refuse("ends within its head");
  for (uint32_t i = 0; i < count; ++i) {
    const auto texel = Read<uint32_t>(data_ + kHead + 4 * i);
    if (texel >= head[2] * head[3]) throw refuse("has a texel outside its image");
    texels_.push_back(texel);
    is_panel_.push_back(data_[kHead + 4 * size_t{count} + i] == 1 ? 1.0f : 0.0f);
  }
  const size_t values = kHalfBytes * count * (head[0] + head[1]), record = 4 * sizeof(uint32_t) + values;
  if ((bytes_ - tables) % record != 0) throw refuse("ends within a sample");
  for (size_t at = tables; at < bytes_; at += record) {
    const auto split = Read<uint32_t>(data_ + at);
    if (split > static_cast<uint32_t>(Split::kValidate)) throw refuse("has a sample of an unknown split");
    samples_.push_back({static_cast<Split>(split), static_cast<int>(Read<uint32_t>(data_ + at + 12)),
                        data_ + at + 4 * sizeof(uint32_t)});
  }
}

SampleFile::~SampleFile() {
  if (data_ != nullptr) munmap(const_cast<char*>(data_), bytes_);
}

const void* SampleFile::AnswersOf(int sample) const {
  return samples_[sample].values + kHalfBytes * texels_.size() * static_cast<size_t>(features_);
}

}  // namespace weft::learning
